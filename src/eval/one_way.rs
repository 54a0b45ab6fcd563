//! Batches of radial fields in which sources act on samples without a reaction: each sample is evaluated against each
//! source in range, several pairs at a time.

use std::ops::Range;

use fearless_simd::{Select, Simd, SimdBase, SimdMask, dispatch};

use super::contract::Sums;
use super::kernel::{Kernel, KernelLaw, with_kernel};
use super::lanes::{Four, WIDTH, load, total};
use super::quantity::Quantity;
use super::sources::Sources;
use crate::compile::{AnchorId, RadialBatch};
use crate::field::Frame;
use crate::math::{Real, Vector};
use crate::number::level;
use crate::sample::{CloudRun, Moment, SamplePoint, Samples};
use crate::threads::each_chunk;

/// Samples that one thread evaluates at a time: a multiple of the lanes.
const CHUNK: usize = 1024;

/// Evaluates every source in range of every sample; keeps its sources between calls.
#[derive(Debug, Default)]
pub(super) struct OneWayRadials {
    sources: Sources,
    /// The sources of batches in which all stand still, by the number of the batch.
    still: Vec<Sources>,
}

/// A batch and the samples on which it is evaluated.
pub(super) struct Task<'a> {
    pub number: u32,
    pub batch: &'a RadialBatch,
    pub samples: &'a Samples,
    /// For each site, the factor from the fields' vector to a force.
    pub weights: &'a [Real],
    pub quantity: Quantity,
}

impl<'a> Task<'a> {
    /// The parts with several samples on which the batch acts: their samples, the body, and the factor from the
    /// fields' vector to a force on the whole part.
    pub(super) fn clouds(
        &self,
        moment: Moment,
    ) -> impl Iterator<Item = (&'a CloudRun, usize, Real)> {
        let (samples, batch) = (self.samples, self.batch);
        samples.clouds.runs.iter().filter_map(move |run| {
            let whole =
                Some(&run.whole).filter(|whole| samples.takes(batch.sampling_rule, whole))?;
            let weight = samples.weight(whole, &batch.weighting, moment);
            (weight != 0.0).then_some((run, whole.body as usize, weight))
        })
    }
}

/// The factor from the vector of a batch to a force on each site; zero at sites where it is not sampled.
pub(super) fn weigh(
    batch: &RadialBatch,
    samples: &Samples,
    moment: Moment,
    weights: &mut Vec<Real>,
) {
    weights.clear();
    weights.extend(samples.sites.iter().map(|sample| {
        if !samples.takes(batch.sampling_rule, sample) {
            return 0.0;
        }
        samples.weight(sample, &batch.weighting, moment)
    }));
}

impl OneWayRadials {
    pub(super) fn run(
        &mut self,
        task: &Task<'_>,
        frame: impl FnMut(AnchorId) -> Option<Frame>,
        moment: Moment,
        sums: &mut Sums<'_>,
    ) {
        let (batch, number) = (task.batch, task.number as usize);
        let mut sources = &mut self.sources;
        if batch.moving == 0 {
            if self.still.len() <= number {
                self.still.resize_with(number + 1, Sources::default);
            }
            sources = &mut self.still[number];
        }
        sources.refresh(batch, frame, task.quantity);
        sources.add_to(task, sums.forces);
        sources.add_to_clouds(task, moment, sums.wrenches);
    }
}

impl Sources {
    /// Adds the forces of the gathered sources on all sites.
    pub(super) fn add_to(&self, task: &Task<'_>, sums: &mut [Vector]) {
        let probes = Probes {
            samples: &task.samples.sites,
            weights: task.weights,
            range: task.batch.range,
            quantity: task.quantity,
        };
        let law = KernelLaw::new(&task.batch.law);
        each_chunk(sums, CHUNK, |first, sums| {
            let probes = probes.from(first);
            dispatch!(level(), simd => with_kernel!(
                law, law => self.add(simd, law, &probes, sums)
            ));
        });
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, law: impl Kernel, probes: &Probes<'_>, sums: &mut [Vector]) {
        if let Some(few) = self.few() {
            return self.add_across(simd, law, few, probes, sums);
        }
        let each = probes.samples.iter().zip(probes.weights).zip(sums);
        for ((sample, weight), sum) in each {
            // Skipped, to save the cost of samples that are not coupled.
            if *weight == 0.0 {
                continue;
            }
            let (point, range) = (sample.world_point, probes.range);
            let mut seen = Accumulator::new(simd, point, sample.owner, range, probes.quantity);
            self.for_each_near(
                point,
                range,
                #[inline(always)]
                |run| seen.add(simd, self, law, run.start, run.end),
            );
            *sum += seen.total() * *weight;
        }
    }

    /// [`Sources::add`] for sources that would not fill the lanes: several samples at once, with the sum over the
    /// sources in each lane. The order of sums is that of [`Accumulator::total`].
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn add_across<S: Simd>(
        &self,
        simd: S,
        law: impl Kernel,
        few: Range<usize>,
        probes: &Probes<'_>,
        sums: &mut [Vector],
    ) {
        let everywhere = counting(simd).simd_ge(0.0);
        let chunks = probes
            .samples
            .chunks(WIDTH)
            .zip(probes.weights.chunks(WIDTH));
        for ((samples, weights), sums) in chunks.zip(sums.chunks_mut(WIDTH)) {
            if weights.iter().all(|weight| *weight == 0.0) {
                continue;
            }
            let mut seen = Accumulator::of_several(simd, samples, probes);
            for at in few.clone() {
                let point = [self.x[at], self.y[at], self.z[at]];
                let point = splat(simd, point);
                let [strength, owner, _] = splat(simd, [self.strength[at], self.owner[at], 0.0]);
                seen.meet(law, point, [strength, owner], everywhere);
            }
            for (lane, (weight, sum)) in weights.iter().zip(sums).enumerate() {
                if *weight != 0.0 {
                    let [x, y, z] = &seen.sum;
                    *sum += Vector::new(x[lane], y[lane], z[lane]) * *weight;
                }
            }
        }
    }
}

/// The numbers of the lanes.
#[inline(always)]
fn counting<S: Simd>(simd: S) -> Four<S> {
    Four::load_array(simd, [0.0, 1.0, 2.0, 3.0])
}

#[inline(always)]
fn splat<S: Simd>(simd: S, [x, y, z]: [Real; 3]) -> [Four<S>; 3] {
    [
        Four::splat(simd, x),
        Four::splat(simd, y),
        Four::splat(simd, z),
    ]
}

/// The samples of one call, with their weights, and the range and the quantity of the batch.
struct Probes<'a> {
    samples: &'a [SamplePoint],
    weights: &'a [Real],
    range: Option<Real>,
    quantity: Quantity,
}

impl Probes<'_> {
    /// The samples and weights from index `first` on.
    fn from(&self, first: usize) -> Self {
        Probes {
            samples: &self.samples[first.min(self.samples.len())..],
            weights: &self.weights[first.min(self.weights.len())..],
            ..*self
        }
    }
}

/// The sum over sources at one sample, or at several, one in each lane.
pub(super) struct Accumulator<S: Simd> {
    point: [Four<S>; 3],
    owner: Four<S>,
    range2: Real,
    quantity: Quantity,
    sum: [Four<S>; 3],
}

impl<S: Simd> Accumulator<S> {
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        point: Vector,
        owner: Real,
        range: Option<Real>,
        quantity: Quantity,
    ) -> Self {
        let range = range.unwrap_or(Real::INFINITY);
        Accumulator {
            point: splat(simd, point.to_array()),
            owner: Four::splat(simd, owner),
            range2: range * range,
            quantity,
            sum: splat(simd, [0.0; 3]),
        }
    }

    /// For at most as many samples as lanes; the other lanes are not read.
    #[inline(always)]
    fn of_several(simd: S, samples: &[SamplePoint], probes: &Probes<'_>) -> Self {
        let (range, quantity) = (probes.range, probes.quantity);
        let mut seen = Accumulator::new(simd, Vector::ZERO, 0.0, range, quantity);
        for (lane, sample) in samples.iter().enumerate() {
            for (axis, x) in sample.world_point.to_array().into_iter().enumerate() {
                seen.point[axis][lane] = x;
            }
            seen.owner[lane] = sample.owner;
        }
        seen
    }

    /// Adds the sources of the indices `start..end`.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        simd: S,
        sources: &Sources,
        law: impl Kernel,
        start: usize,
        end: usize,
    ) {
        for at in (start..end).step_by(WIDTH) {
            let point = [
                load(simd, &sources.x, at),
                load(simd, &sources.y, at),
                load(simd, &sources.z, at),
            ];
            let kept = [
                load(simd, &sources.strength, at),
                load(simd, &sources.owner, at),
            ];
            let left = (end - at) as Real;
            self.meet(law, point, kept, counting(simd).simd_lt(left));
        }
    }

    /// Adds one source in each lane, given by its point, strength and owner, where `there` is set.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn meet(
        &mut self,
        law: impl Kernel,
        point: [Four<S>; 3],
        [strength, owner]: [Four<S>; 2],
        there: <Four<S> as SimdBase<S>>::Mask,
    ) {
        let dx = self.point[0] - point[0];
        let dy = self.point[1] - point[1];
        let dz = self.point[2] - point[2];
        let r2 = dx * dx + dy * dy + dz * dz;
        let acts = r2.simd_le(self.range2) & !owner.simd_eq(self.owner) & there;
        if acts.all_false() {
            return;
        }
        // Selected, since lanes that do not act may be infinite or NaN.
        let zero = Four::splat(owner.simd, 0.0);
        match self.quantity {
            Quantity::Force => {
                let factor = acts.select(strength * law.factor(r2, acts), zero);
                self.sum[0] += factor * acts.select(dx, zero);
                self.sum[1] += factor * acts.select(dy, zero);
                self.sum[2] += factor * acts.select(dz, zero);
            }
            Quantity::Potential => {
                self.sum[0] += acts.select(strength * law.potential(r2, acts), zero);
            }
        }
    }

    #[inline(always)]
    pub(super) fn total(&self) -> Vector {
        Vector::new(total(self.sum[0]), total(self.sum[1]), total(self.sum[2]))
    }
}
