//! Radial fields of bodies on bodies: every pair of parts once, in both directions, for all laws at once.
//!
//! Most sources of a many-body scene are at the position of a sample: the field of an atom, sampled at atoms. Such a
//! pair is computed once and acts on both. The batches of one range are evaluated in one pass over pairs of
//! tiles. A tile is up to four sites of one body; without a range, of any bodies. Parts of one body do not act on
//! each other. Pairs are taken in the order of the bodies, so that results do not depend on the age of the list
//! of near tiles. Copying neighbours together to save lanes cost more than it saved.

mod meet;
mod near;
mod tiles;

use super::contract::Sums;
use super::kernel::KernelLaw;
use super::one_way::{Task, weigh};
use super::quantity::Quantity;
use super::sampled_world::SampledWorld;
use super::sources::Sources;
use crate::compile::{AnchorId, RadialBatch, RadialSource};
use crate::field::{Axis, Coupling, ForceMode, Frame, Frames};
use crate::math::{Real, Vector, to_f64};
use crate::sample::{Moment, Samples};
use meet::Laws;
use near::NearTiles;
use tiles::Tiles;

/// Evaluates sources at samples pair by pair, in both directions, and other sources in one direction.
#[derive(Debug, Default)]
pub(super) struct PairwiseRadials {
    /// The stamps, and the properties of the moment, that sides and passes were made from.
    made_for: Vec<u64>,
    wanted_for: Vec<u64>,
    /// The batches that are evaluated pair by pair. The first `batches` are in use; others are kept for their
    /// buffers.
    sides: Vec<Sides>,
    batches: usize,
    passes: Vec<PairPass>,
    ranges: usize,
    sources: Sources,
}

/// A batch, with the strength and the weight of each site in it.
#[derive(Debug)]
pub(super) struct Sides {
    number: u32,
    law: KernelLaw,
    range: Option<Real>,
    /// The strength of each site as a source; zero if it is none.
    strengths: Vec<Real>,
    /// The factor from the vector of the fields to a force on each site.
    weights: Vec<Real>,
    /// Sources that are not at sites.
    apart: Vec<RadialSource>,
}

/// The batches of one range.
#[derive(Debug, Default)]
struct PairPass {
    laws: Laws,
    /// For each law, the index of its batch in the sides; `None` if no batch has it.
    order: Vec<Option<usize>>,
    tiles: Tiles,
    near: NearTiles,
}

impl PairwiseRadials {
    /// Prepares those of `batches` that are `wanted`, in their order.
    pub(super) fn take_up<'a>(
        &mut self,
        batches: impl Iterator<Item = (u32, &'a RadialBatch)> + Clone,
        samples: &Samples,
        moment: Moment,
        wanted: impl Fn(&Sides, &RadialBatch) -> bool,
    ) {
        self.wanted_for.clear();
        self.wanted_for.push(samples.stamp);
        for (number, batch) in batches.clone() {
            self.wanted_for.extend([u64::from(number), batch.log.stamp]);
            self.wanted_for.extend(read(batch, moment));
        }
        if self.wanted_for == self.made_for {
            return;
        }
        std::mem::swap(&mut self.wanted_for, &mut self.made_for);
        self.batches = 0;
        for (number, batch) in batches {
            if self.sides.len() == self.batches {
                self.sides.push(Sides::new(batch));
            }
            let sides = &mut self.sides[self.batches];
            sides.fill(number, batch, samples, moment);
            self.batches += usize::from(wanted(sides, batch));
        }
        self.group(samples);
    }

    /// Returns true if a batch is evaluated pair by pair.
    pub(super) fn has(&self, number: u32) -> bool {
        let sides = &self.sides[..self.batches];
        sides.iter().any(|sides| sides.number == number)
    }

    /// Groups the batches by range into passes.
    fn group(&mut self, samples: &Samples) {
        let sides = &self.sides[..self.batches];
        self.ranges = 0;
        for (place, first) in sides.iter().enumerate() {
            if sides[..place]
                .iter()
                .any(|known| known.range == first.range)
            {
                continue;
            }
            if self.passes.len() == self.ranges {
                self.passes.push(PairPass::default());
            }
            self.passes[self.ranges].fill(&sides[place..], samples);
            self.ranges += 1;
        }
    }

    /// Adds the forces, or potentials, that sites exert on each other.
    pub(super) fn meet(&mut self, samples: &Samples, quantity: Quantity, sums: &mut [Vector]) {
        for pass in &mut self.passes[..self.ranges] {
            pass.tiles.place(samples);
            pass.near.refresh(&pass.tiles);
            pass.laws.meet(&mut pass.tiles, &pass.near, quantity);
            pass.tiles.give(sums);
        }
    }

    /// Adds the forces of a batch that are not between pairs of sites.
    pub(super) fn add_others(
        &mut self,
        number: u32,
        batch: &RadialBatch,
        scene: &SampledWorld<'_, impl Frames>,
        quantity: Quantity,
        mut frame: impl FnMut(AnchorId) -> Option<Frame>,
        sums: &mut Sums<'_>,
    ) {
        let known = self.sides[..self.batches].iter();
        let Some(sides) = known.clone().find(|sides| sides.number == number) else {
            return;
        };
        let task = Task {
            number,
            batch,
            samples: scene.samples,
            weights: &sides.weights,
            quantity,
        };
        // Samples of clouds are in no tile, so all sources act on them here.
        if task.samples.any_cloud(batch.sampling_rule) {
            let all_sources = &batch.sources;
            self.sources
                .gather(batch, all_sources, &mut frame, quantity);
            self.sources
                .add_to_clouds(&task, scene.moment, sums.wrenches);
        }
        if !sides.apart.is_empty() {
            self.sources.gather(batch, &sides.apart, frame, quantity);
            self.sources.add_to(&task, sums.forces);
        }
    }
}

/// The properties of the moment that the weights of a batch depend on, as bits.
fn read(batch: &RadialBatch, moment: Moment) -> [u64; 3] {
    let of_time = batch.weighting.coupling == Coupling::Axis(Axis::Time);
    let of_step = batch.weighting.mode == ForceMode::VelocityChange;
    let bits = |is_read, x: f64| if is_read { x.to_bits() } else { 0 };
    let share = batch.weighting.lifetime().share_of(moment.span);
    let dt = to_f64(moment.dt);
    [
        bits(of_time, moment.time),
        bits(of_step, dt),
        share.to_bits(),
    ]
}

impl Sides {
    fn new(batch: &RadialBatch) -> Self {
        Sides {
            number: 0,
            law: KernelLaw::new(&batch.law),
            range: None,
            strengths: Vec::new(),
            weights: Vec::new(),
            apart: Vec::new(),
        }
    }

    fn fill(&mut self, number: u32, batch: &RadialBatch, samples: &Samples, moment: Moment) {
        self.number = number;
        self.law = KernelLaw::new(&batch.law);
        self.range = batch.range;
        weigh(batch, samples, moment, &mut self.weights);
        self.strengths.clear();
        self.strengths.resize(samples.sites.len(), 0.0);
        self.apart.clear();
        for source in &batch.sources {
            let number = source
                .collider
                .and_then(|collider| samples.of_collider(collider));
            match number.filter(|number| samples.sites[*number].at_origin) {
                Some(number) => self.strengths[number] += source.strength,
                None => self.apart.push(*source),
            }
        }
    }

    /// Returns true if enough of the sources are at sites for a test of every pair of samples to pay off.
    pub(super) fn are_worth_it(&self, batch: &RadialBatch) -> bool {
        let weights = self.weights.iter();
        let coupled = weights.filter(|weight| **weight != 0.0).count();
        let matched = batch.sources.len() - self.apart.len();
        matched * 2 >= coupled && matched > 0
    }

    /// The strength and the weight of a site in the batch.
    fn of(&self, site: usize) -> [Real; 2] {
        [self.strengths[site], self.weights[site]]
    }
}

impl PairPass {
    /// Sets up the batches that have the range of the first.
    fn fill(&mut self, sides: &[Sides], samples: &Samples) {
        let Some(range) = sides.first().map(|first| first.range) else {
            return;
        };
        let laws = &mut self.laws;
        laws.clear(range);
        self.order.clear();
        self.order.extend([None, None]);
        let like = sides.iter().enumerate();
        for (place, sides) in like.filter(|(_, sides)| sides.range == range) {
            match laws.put(sides.law) {
                Some(slot) => self.order[slot] = Some(place),
                None => self.order.push(Some(place)),
            }
        }
        self.tiles.clear(self.order.len());
        for (site, sample) in samples.sites.iter().enumerate() {
            let of = |place: &Option<usize>| place.map_or([0.0; 2], |place| sides[place].of(site));
            let charges = self.order.iter().map(of);
            if charges.clone().any(|charges| charges != [0.0; 2]) {
                self.tiles.push(site, sample, range.is_none(), charges);
            }
        }
        laws.mutual = (0..self.order.len()).all(|law| is_mutual(self.tiles.sides(law)));
        self.near.keep_if_of(range, &self.tiles);
    }
}

/// Returns true if strengths are proportional to weights, so that the two forces of each pair are opposite.
/// Allows for two roundings of a product.
fn is_mutual(sides: impl Iterator<Item = [Real; 2]> + Clone) -> bool {
    let size = |[_, weight]: &[Real; 2]| weight.abs();
    let largest = sides
        .clone()
        .max_by(|a, b| Real::total_cmp(&size(a), &size(b)));
    let coupled = largest.filter(|[_, weight]| *weight != 0.0);
    let ratio = coupled.map_or(0.0, |[strength, weight]| strength / weight);
    let mut sides = sides;
    sides.all(|[strength, weight]| {
        (strength - ratio * weight).abs() <= 2.0 * Real::EPSILON * strength.abs()
    })
}
