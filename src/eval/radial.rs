//! Batches of radial fields: every sample against every source in range, several at a time.

use std::ops::Range;

use super::contract::{BatchEvaluator, Scene, Sums};
use super::frames::FrameCache;
use super::kernel::{Kernel, Law};
use super::lanes::{Lanes, WIDTH, counting, load};
use super::pairwise::{Pairs, Pairwise};
use super::quantity::Quantity;
use super::sources::Sources;
use crate::compile::{AnchorId, RadialBatch, RadialSource};
use crate::field::{Frame, Frames};
use crate::math::{Real, Vector};
use crate::sample::{SamplePoint, Samples};

/// Evaluates radial batches, each in the way that suits it; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(super) struct Radials {
    one_way: OneWayRadials,
    pairwise: PairwiseRadials,
    weights: Vec<Real>,
}

/// Every source against every sample in range.
#[derive(Debug, Default)]
pub(super) struct OneWayRadials {
    sources: Sources,
    /// By batch: sources that all stand still.
    still: Vec<Sources>,
}

/// Sources that are samples, pair by pair, both ways; the others one way.
#[derive(Debug, Default)]
pub(super) struct PairwiseRadials {
    /// One per batch, because each keeps its neighbours.
    pairwise: Vec<Pairwise>,
    strengths: Vec<Real>,
    /// Sources that are not samples.
    apart: Vec<RadialSource>,
    sources: Sources,
}

/// A batch with all that it is evaluated on.
struct Task<'a> {
    number: u32,
    batch: &'a RadialBatch,
    samples: &'a Samples,
    /// Of each sample of the list: what turns the vector of the fields into a force.
    weights: &'a [Real],
    quantity: Quantity,
}

impl BatchEvaluator<RadialBatch> for Radials {
    fn add(
        &mut self,
        batch: (u32, &RadialBatch),
        scene: &Scene<'_, impl Frames>,
        frames: &mut FrameCache,
        sums: &mut Sums<'_>,
    ) {
        self.add_quantity(batch, scene, frames, sums.forces, Quantity::Force);
    }
}

impl Radials {
    /// Adds the forces, or potentials, of a batch on every sample.
    pub(super) fn add_quantity(
        &mut self,
        (number, batch): (u32, &RadialBatch),
        scene: &Scene<'_, impl Frames>,
        frames: &mut FrameCache,
        sums: &mut [Vector],
        quantity: Quantity,
    ) {
        if !batch.prototype.is_on(scene.moment.time) {
            return;
        }
        weigh(batch, scene, &mut self.weights);
        let task = Task {
            number,
            batch,
            samples: scene.samples,
            weights: &self.weights,
            quantity,
        };
        let frame = |anchor| frames.get(scene.compiled, scene.world, anchor);
        if self.pairwise.is_worth_it(&task) {
            self.pairwise.run(&task, frame, sums);
        } else {
            self.one_way.run(&task, frame, sums);
        }
    }
}

/// What turns the vector of a batch into a force on each sample; zero where it is not sampled.
fn weigh(batch: &RadialBatch, scene: &Scene<'_, impl Frames>, weights: &mut Vec<Real>) {
    let samples = scene.samples;
    let weight = |sample| match samples.takes(batch.how, sample) {
        true => samples.weight(sample, &batch.weighting, scene.moment),
        false => 0.0,
    };
    weights.clear();
    weights.extend(samples.list.iter().map(weight));
}

impl OneWayRadials {
    fn run(
        &mut self,
        task: &Task<'_>,
        frame: impl FnMut(AnchorId) -> Option<Frame>,
        sums: &mut [Vector],
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
        sources.add_to(task, 0..task.samples.list.len(), sums);
    }
}

impl PairwiseRadials {
    fn run(
        &mut self,
        task: &Task<'_>,
        mut frame: impl FnMut(AnchorId) -> Option<Frame>,
        sums: &mut [Vector],
    ) {
        let (batch, sites) = (task.batch, task.samples.sites);
        self.split(task);
        // What is no site meets all sources one by one.
        if task.weights[sites..].iter().any(|weight| *weight != 0.0) {
            let sources = &batch.sources;
            self.sources
                .gather(batch, sources, &mut frame, task.quantity);
            let several = sites..task.samples.list.len();
            self.sources.add_to(task, several, sums);
        }
        self.sources
            .gather(batch, &self.apart, frame, task.quantity);
        let number = task.number as usize;
        if self.pairwise.len() <= number {
            self.pairwise.resize_with(number + 1, Pairwise::default);
        }
        let pairs = Pairs {
            samples: task.samples,
            strengths: &self.strengths,
            weights: &task.weights[..sites],
            range: batch.range,
        };
        let pairwise = &mut self.pairwise[number];
        match Law::new(&batch.law) {
            Law::InverseSquare(law) => pairwise.run(law, pairs, task.quantity, sums),
            Law::LennardJones(law) => pairwise.run(law, pairs, task.quantity, sums),
            Law::Other(law) => pairwise.run(law, pairs, task.quantity, sums),
        }
        if !self.apart.is_empty() {
            self.sources.add_to(task, 0..sites, sums);
        }
    }

    /// Sets the strengths of the samples that are sources; the others are kept apart.
    fn split(&mut self, task: &Task<'_>) {
        let samples = task.samples;
        self.strengths.clear();
        self.strengths.resize(samples.sites, 0.0);
        self.apart.clear();
        for source in &task.batch.sources {
            let number = source
                .collider
                .and_then(|collider| samples.of_collider(collider));
            match number.filter(|number| samples.list[*number].at_origin) {
                Some(number) => self.strengths[number] += source.strength,
                None => self.apart.push(*source),
            }
        }
    }

    /// Whether there are enough sources among the samples for every pair of samples to be worth a
    /// look.
    fn is_worth_it(&mut self, task: &Task<'_>) -> bool {
        if task.batch.on_colliders == 0 {
            return false;
        }
        self.split(task);
        let weights = &task.weights[..task.samples.sites];
        let coupled = weights.iter().filter(|weight| **weight != 0.0).count();
        let matched = task.batch.sources.len() - self.apart.len();
        matched * 2 >= coupled && matched > 0
    }
}

impl Sources {
    /// Adds what the gathered sources give on some samples of the list.
    fn add_to(&self, task: &Task<'_>, places: Range<usize>, sums: &mut [Vector]) {
        let (range, quantity) = (task.batch.range, task.quantity);
        let samples = &task.samples.list[places.clone()];
        let (weights, sums) = (&task.weights[places.clone()], &mut sums[places]);
        match Law::new(&task.batch.law) {
            Law::InverseSquare(law) => self.add(law, range, quantity, samples, weights, sums),
            Law::LennardJones(law) => self.add(law, range, quantity, samples, weights, sums),
            Law::Other(law) => self.add(law, range, quantity, samples, weights, sums),
        }
    }

    fn add(
        &self,
        law: impl Kernel,
        range: Option<Real>,
        quantity: Quantity,
        samples: &[SamplePoint],
        weights: &[Real],
        sums: &mut [Vector],
    ) {
        if let Some(few) = self.few() {
            return self.add_across(law, (few, range, quantity), samples, weights, sums);
        }
        for ((sample, weight), sum) in samples.iter().zip(weights).zip(sums) {
            // Samples that are not coupled are left out; so is what they would cost.
            if *weight == 0.0 {
                continue;
            }
            let mut seen = Accumulator::new(sample.world_point, sample.owner, range, quantity);
            self.for_each_near(sample.world_point, range, |run| {
                seen.add(self, law, run.start, run.end);
            });
            *sum += seen.total() * *weight;
        }
    }

    /// The same for sources that would not fill the lanes: several samples at once, and in each lane the
    /// sum over the sources in their order, which is that of [`Accumulator::total`].
    fn add_across(
        &self,
        law: impl Kernel,
        (few, range, quantity): (Range<usize>, Option<Real>, Quantity),
        samples: &[SamplePoint],
        weights: &[Real],
        sums: &mut [Vector],
    ) {
        let everywhere = counting().simd_ge(Lanes::splat(0.0));
        let chunks = samples.chunks(WIDTH).zip(weights.chunks(WIDTH));
        for ((samples, weights), sums) in chunks.zip(sums.chunks_mut(WIDTH)) {
            if weights.iter().all(|weight| *weight == 0.0) {
                continue;
            }
            let mut seen = Accumulator::of_several(samples, range, quantity);
            for at in few.clone() {
                let point = [self.x[at], self.y[at], self.z[at]].map(Lanes::splat);
                let kept = [self.strength[at], self.owner[at]].map(Lanes::splat);
                seen.meet(law, point, kept, everywhere);
            }
            let totals = seen.sum.map(Lanes::to_array);
            for (lane, (weight, sum)) in weights.iter().zip(sums).enumerate() {
                if *weight != 0.0 {
                    *sum += Vector::from_array(totals.map(|total| total[lane])) * *weight;
                }
            }
        }
    }
}

/// The sum over sources at one sample, or at several, one per lane.
struct Accumulator {
    point: [Lanes; 3],
    owner: Lanes,
    range2: Lanes,
    counting: Lanes,
    quantity: Quantity,
    sum: [Lanes; 3],
}

impl Accumulator {
    fn new(point: Vector, owner: Real, range: Option<Real>, quantity: Quantity) -> Self {
        let range = range.unwrap_or(Real::INFINITY);
        Accumulator {
            point: point.to_array().map(Lanes::splat),
            owner: Lanes::splat(owner),
            range2: Lanes::splat(range * range),
            counting: counting(),
            quantity,
            sum: [Lanes::splat(0.0); 3],
        }
    }

    /// For no more samples than lanes; what is in the others is never looked at.
    fn of_several(samples: &[SamplePoint], range: Option<Real>, quantity: Quantity) -> Self {
        let gather = |value: &dyn Fn(&SamplePoint) -> Real| {
            let mut lanes = [0.0; WIDTH];
            for (lane, sample) in lanes.iter_mut().zip(samples) {
                *lane = value(sample);
            }
            Lanes::new(lanes)
        };
        Accumulator {
            point: [
                gather(&|sample| sample.world_point.x),
                gather(&|sample| sample.world_point.y),
                gather(&|sample| sample.world_point.z),
            ],
            owner: gather(&|sample| sample.owner),
            ..Accumulator::new(Vector::ZERO, 0.0, range, quantity)
        }
    }

    /// Adds the sources at places `start..end`.
    fn add(&mut self, sources: &Sources, law: impl Kernel, start: usize, end: usize) {
        for at in (start..end).step_by(WIDTH) {
            let point = [&sources.x, &sources.y, &sources.z].map(|x| load(x, at));
            let kept = [load(&sources.strength, at), load(&sources.owner, at)];
            let left = Lanes::splat((end - at) as Real);
            self.meet(law, point, kept, self.counting.simd_lt(left));
        }
    }

    /// Adds a source per lane, given by its point, strength and owner, where it is `there`.
    #[inline]
    fn meet(
        &mut self,
        law: impl Kernel,
        point: [Lanes; 3],
        [strength, owner]: [Lanes; 2],
        there: Lanes,
    ) {
        let dx = self.point[0] - point[0];
        let dy = self.point[1] - point[1];
        let dz = self.point[2] - point[2];
        let r2 = dx * dx + dy * dy + dz * dz;
        let acts = r2.simd_le(self.range2) & owner.simd_ne(self.owner) & there;
        if !acts.any() {
            return;
        }
        match self.quantity {
            Quantity::Force => {
                // Masked bit by bit: what does not act may be infinite or NaN.
                let factor = acts & (strength * law.factor(r2));
                self.sum[0] += factor * (acts & dx);
                self.sum[1] += factor * (acts & dy);
                self.sum[2] += factor * (acts & dz);
            }
            Quantity::Potential => self.sum[0] += acts & (strength * law.potential(r2)),
        }
    }

    fn total(&self) -> Vector {
        let [x, y, z] = self.sum.map(Lanes::reduce_add);
        Vector::new(x, y, z)
    }
}

#[cfg(test)]
mod by_themselves {
    use super::*;

    /// The two ways by themselves: whatever the batch, they differ in rounding only.
    macro_rules! by_itself {
        ($way:ty) => {
            impl BatchEvaluator<RadialBatch> for $way {
                fn add(
                    &mut self,
                    (number, batch): (u32, &RadialBatch),
                    scene: &Scene<'_, impl Frames>,
                    frames: &mut FrameCache,
                    sums: &mut Sums<'_>,
                ) {
                    let mut weights = Vec::new();
                    weigh(batch, scene, &mut weights);
                    let task = Task {
                        number,
                        batch,
                        samples: scene.samples,
                        weights: &weights,
                        quantity: Quantity::Force,
                    };
                    let frame = |anchor| frames.get(scene.compiled, scene.world, anchor);
                    if batch.prototype.is_on(scene.moment.time) {
                        self.run(&task, frame, sums.forces);
                    }
                }
            }
        };
    }

    by_itself!(OneWayRadials);
    by_itself!(PairwiseRadials);
}
