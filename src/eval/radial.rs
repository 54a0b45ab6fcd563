//! Batches of radial fields: every sample against every source in range, several at a time.

use super::kernel::{Kernel, Law};
use super::lanes::{Lanes, WIDTH, counting, load};
use super::pairwise::{Pairs, Pairwise};
use super::quantity::Quantity;
use crate::compile::{AnchorId, RadialBatch, RadialSource};
use crate::field::Frame;
use crate::math::{Real, Vector};
use crate::neighbors::{FEWEST_FOR_GRID, Grid};
use crate::sample::{Moment, SamplePoint, Samples, owner};

/// Evaluates radial batches; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(super) struct Radials {
    one_way: OneWay,
    /// One per batch, because each keeps its neighbours.
    mutual: Vec<Pairwise>,
    strengths: Vec<Real>,
    weights: Vec<Real>,
    /// Sources that are not samples, or that are but few.
    apart: Vec<RadialSource>,
}

impl Radials {
    /// Adds the forces (or potentials) of a batch, given with its number, on every sample.
    pub(super) fn add(
        &mut self,
        (number, batch): (usize, &RadialBatch),
        mut frame: impl FnMut(AnchorId) -> Option<Frame>,
        samples: &Samples,
        moment: Moment,
        quantity: Quantity,
        sums: &mut [Vector],
    ) {
        let weight = |sample| match samples.takes(batch.how, sample) {
            true => samples.weight(sample, &batch.weighting, moment),
            false => 0.0,
        };
        self.weights.clear();
        self.weights.extend(samples.list.iter().map(weight));
        let is_mutual = self.split(batch, samples);
        // What is no site meets all sources one by one.
        let several = is_mutual && self.weights[samples.sites..].iter().any(|w| *w != 0.0);
        if several {
            let (_, sums) = sums.split_at_mut(samples.sites);
            let sources = &batch.sources;
            self.one_way.gather(batch, sources, &mut frame, quantity);
            match Law::new(&batch.law) {
                Law::InverseSquare(law) => self.add_to_several(law, batch, samples, quantity, sums),
                Law::LennardJones(law) => self.add_to_several(law, batch, samples, quantity, sums),
                Law::Other(law) => self.add_to_several(law, batch, samples, quantity, sums),
            }
        }
        self.one_way.gather(batch, &self.apart, frame, quantity);
        if self.mutual.len() <= number {
            self.mutual.resize_with(number + 1, Pairwise::default);
        }
        let mut both = Both {
            radials: self,
            number,
            batch,
            samples,
            quantity,
            sums,
            is_mutual,
        };
        match Law::new(&batch.law) {
            Law::InverseSquare(law) => both.add(law),
            Law::LennardJones(law) => both.add(law),
            Law::Other(law) => both.add(law),
        }
    }

    /// Adds what the gathered sources give on the samples that are no sites.
    fn add_to_several(
        &self,
        law: impl Kernel,
        batch: &RadialBatch,
        samples: &Samples,
        quantity: Quantity,
        sums: &mut [Vector],
    ) {
        let (samples, weights) = (
            &samples.list[samples.sites..],
            &self.weights[samples.sites..],
        );
        let range = batch.range;
        self.one_way
            .add(law, range, quantity, samples, weights, sums);
    }

    /// Sets the strengths of the samples that are sources; the others are kept apart. Whether
    /// there are enough of the former for every pair of samples to be worth a look.
    fn split(&mut self, batch: &RadialBatch, samples: &Samples) -> bool {
        self.strengths.clear();
        self.strengths.resize(samples.sites, 0.0);
        self.apart.clear();
        for source in &batch.sources {
            let number = source
                .collider
                .and_then(|collider| samples.of_collider(collider));
            match number.filter(|number| samples.list[*number].at_origin) {
                Some(number) => self.strengths[number] += source.strength,
                None => self.apart.push(*source),
            }
        }
        let weights = &self.weights[..samples.sites];
        let coupled = weights.iter().filter(|weight| **weight != 0.0).count();
        let matched = batch.sources.len() - self.apart.len();
        if matched * 2 >= coupled && matched > 0 {
            return true;
        }
        self.apart.clone_from(&batch.sources);
        false
    }
}

/// One evaluation of a batch, for a law known to the compiler.
struct Both<'a> {
    radials: &'a mut Radials,
    number: usize,
    batch: &'a RadialBatch,
    samples: &'a Samples,
    quantity: Quantity,
    sums: &'a mut [Vector],
    is_mutual: bool,
}

impl Both<'_> {
    fn add(&mut self, law: impl Kernel) {
        let Radials {
            one_way,
            mutual,
            strengths,
            weights,
            apart,
        } = &mut *self.radials;
        let range = self.batch.range;
        let (mut samples, mut weights) = (&self.samples.list[..], &weights[..]);
        if self.is_mutual {
            // The others have met all sources already.
            (samples, weights) = (
                &samples[..self.samples.sites],
                &weights[..self.samples.sites],
            );
            let pairs = Pairs {
                samples: self.samples,
                strengths,
                weights,
                range,
            };
            let mutual = &mut mutual[self.number];
            match self.quantity {
                Quantity::Force => mutual.add::<false>(law, pairs, self.sums),
                Quantity::Potential => mutual.add::<true>(law, pairs, self.sums),
            }
        }
        if !apart.is_empty() {
            one_way.add(law, range, self.quantity, samples, weights, self.sums);
        }
    }
}

/// Sources sorted for one evaluation, as separate arrays padded to whole [`Lanes`].
#[derive(Debug, Default)]
struct OneWay {
    points: Vec<Vector>,
    kept: Vec<(Real, Real)>,
    x: Vec<Real>,
    y: Vec<Real>,
    z: Vec<Real>,
    strength: Vec<Real>,
    owner: Vec<Real>,
    grid: Grid,
    gridded: bool,
}

impl OneWay {
    /// Takes the sources whose anchors are there, and sorts them into a grid if there are many.
    fn gather(
        &mut self,
        batch: &RadialBatch,
        sources: &[RadialSource],
        mut frame: impl FnMut(AnchorId) -> Option<Frame>,
        quantity: Quantity,
    ) {
        self.points.clear();
        self.kept.clear();
        for source in sources {
            let Some(frame) = frame(source.anchor) else {
                continue;
            };
            let shared = quantity == Quantity::Potential && frame.body.is_some();
            let strength = if shared {
                source.strength * 0.5
            } else {
                source.strength
            };
            self.points.push(frame.pose.translation);
            self.kept.push((strength, owner(frame.body)));
        }
        for array in [&mut self.x, &mut self.y, &mut self.z] {
            array.clear();
        }
        self.strength.clear();
        self.owner.clear();
        let range = batch.range.filter(|_| self.points.len() >= FEWEST_FOR_GRID);
        self.gridded = range.is_some();
        // Half the range: finer cells fit the ball better than they cost in ranges.
        self.grid
            .build(&self.points, range.map_or(Real::MAX, |range| range * 0.5));
        for place in 0..self.points.len() {
            self.push(self.grid.order()[place] as usize);
        }
        for array in [&mut self.x, &mut self.y, &mut self.z] {
            array.extend([0.0; WIDTH]);
        }
        self.strength.extend([0.0; WIDTH]);
        self.owner.extend([0.0; WIDTH]);
    }

    fn push(&mut self, source: usize) {
        let (point, (strength, owner)) = (self.points[source], self.kept[source]);
        self.x.push(point.x);
        self.y.push(point.y);
        self.z.push(point.z);
        self.strength.push(strength);
        self.owner.push(owner);
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
        for ((sample, weight), sum) in samples.iter().zip(weights).zip(sums) {
            // Samples that are not coupled are left out; so is what they would cost.
            if *weight == 0.0 {
                continue;
            }
            let mut seen = Accumulator::new(sample.world_point, sample.owner, range, quantity);
            match range.filter(|_| self.gridded) {
                Some(range) => self.grid.for_each_near(sample.world_point, range, |run| {
                    seen.add(self, law, run.start, run.end);
                }),
                None => seen.add(self, law, 0, self.points.len()),
            }
            *sum += seen.total() * *weight;
        }
    }
}

/// The sum over sources at one sample.
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

    /// Adds the sources at places `start..end`.
    fn add(&mut self, sources: &OneWay, law: impl Kernel, start: usize, end: usize) {
        for at in (start..end).step_by(WIDTH) {
            let dx = self.point[0] - load(&sources.x, at);
            let dy = self.point[1] - load(&sources.y, at);
            let dz = self.point[2] - load(&sources.z, at);
            let r2 = dx * dx + dy * dy + dz * dz;
            let left = Lanes::splat((end - at) as Real);
            let acts = r2.simd_le(self.range2)
                & load(&sources.owner, at).simd_ne(self.owner)
                & self.counting.simd_lt(left);
            if !acts.any() {
                continue;
            }
            let strength = load(&sources.strength, at);
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
    }

    fn total(&self) -> Vector {
        let [x, y, z] = self.sum.map(Lanes::reduce_add);
        Vector::new(x, y, z)
    }
}
