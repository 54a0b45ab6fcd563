//! Radial fields of bodies on bodies: every pair of parts once, both ways, and all laws at once.
//!
//! Most sources of a many-body scene sit where a sample sits: the field of an atom, sampled at
//! atoms. Then a pair is worked out once and acts on both. Batches of one range are met in one pass
//! over pairs of tiles, which are four sites of one body. Parts of one body never act on each
//! other. Pairs are met in the order of the bodies, so that it does not show when the list of those
//! that are near was made; copying neighbours together to save lanes cost more than it saved.

mod meet;
mod near;
mod tiles;

use super::contract::Sums;
use super::kernel::Law;
use super::one_way::{Task, weigh};
use super::quantity::Quantity;
use super::sources::Sources;
use crate::compile::{AnchorId, RadialBatch, RadialSource};
use crate::field::{Axis, Coupling, ForceMode, Frame};
use crate::math::{Real, Vector, to_f64};
use crate::sample::{Moment, Samples};
use meet::Laws;
use near::NearTiles;
use tiles::Tiles;

/// Sources that are samples, pair by pair, both ways; the others one way.
#[derive(Debug, Default)]
pub(super) struct PairwiseRadials {
    /// All that the sides and passes were made from.
    made_for: Vec<u64>,
    asked: Vec<u64>,
    /// Of each batch that is met pair by pair; those behind the number are kept for their buffers.
    sides: Vec<Sides>,
    batches: usize,
    passes: Vec<Pass>,
    ranges: usize,
    sources: Sources,
}

/// A batch, as samples are to it.
#[derive(Debug)]
pub(super) struct Sides {
    number: u32,
    law: Law,
    range: Option<Real>,
    /// Of each site as a source.
    strengths: Vec<Real>,
    /// Of each sample: what turns the vector of the field into a force.
    weights: Vec<Real>,
    /// Sources that are no samples.
    apart: Vec<RadialSource>,
}

/// Batches of one range.
#[derive(Debug, Default)]
struct Pass {
    laws: Laws,
    /// By law, the sides it belongs to.
    order: Vec<Option<usize>>,
    tiles: Tiles,
    near: NearTiles,
}

impl PairwiseRadials {
    /// Takes up those of some batches that are wanted, in the order given.
    pub(super) fn take_up<'a>(
        &mut self,
        batches: impl Iterator<Item = (u32, &'a RadialBatch)> + Clone,
        samples: &Samples,
        moment: Moment,
        wanted: impl Fn(&Sides, &RadialBatch) -> bool,
    ) {
        self.asked.clear();
        self.asked.push(samples.stamp);
        for (number, batch) in batches.clone() {
            self.asked.extend([u64::from(number), batch.log.stamp]);
            self.asked.extend(read(batch, moment));
        }
        if self.asked == self.made_for {
            return;
        }
        std::mem::swap(&mut self.asked, &mut self.made_for);
        self.batches = 0;
        for (number, batch) in batches {
            if self.sides.len() == self.batches {
                self.sides.push(Sides::new(batch));
            }
            let sides = &mut self.sides[self.batches];
            sides.fill((number, batch), samples, moment);
            self.batches += usize::from(wanted(sides, batch));
        }
        self.group(samples);
    }

    /// Whether a batch was taken up.
    pub(super) fn has(&self, number: u32) -> bool {
        let sides = &self.sides[..self.batches];
        sides.iter().any(|sides| sides.number == number)
    }

    /// Makes a pass of the batches of each range.
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
                self.passes.push(Pass::default());
            }
            self.passes[self.ranges].fill(&sides[place..], samples);
            self.ranges += 1;
        }
    }

    /// Adds the forces, or potentials, that the samples exert on each other.
    pub(super) fn meet(&mut self, samples: &Samples, quantity: Quantity, sums: &mut [Vector]) {
        for pass in &mut self.passes[..self.ranges] {
            pass.tiles.place(samples);
            pass.near.refresh(&pass.tiles);
            pass.laws.meet(&mut pass.tiles, &pass.near, quantity);
            pass.tiles.give(sums);
        }
    }

    /// Adds what is no pair of sites in a batch that was taken up.
    pub(super) fn add_others(
        &mut self,
        (number, batch): (u32, &RadialBatch),
        (samples, moment): (&Samples, Moment),
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
            samples,
            weights: &sides.weights,
            quantity,
        };
        // What is no site meets all sources one by one.
        if samples.any_cloud(batch.how) {
            let all_sources = &batch.sources;
            self.sources
                .gather(batch, all_sources, &mut frame, quantity);
            self.sources.add_to_clouds(&task, moment, sums.wrenches);
        }
        if !sides.apart.is_empty() {
            self.sources.gather(batch, &sides.apart, frame, quantity);
            self.sources.add_to(&task, sums.forces);
        }
    }
}

/// What the weights of a batch read of the moment.
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
            law: Law::new(&batch.law),
            range: None,
            strengths: Vec::new(),
            weights: Vec::new(),
            apart: Vec::new(),
        }
    }

    fn fill(&mut self, (number, batch): (u32, &RadialBatch), samples: &Samples, moment: Moment) {
        self.number = number;
        self.law = Law::new(&batch.law);
        self.range = batch.range;
        weigh(batch, samples, moment, &mut self.weights);
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
    }

    /// Whether there are enough sources among the samples for every pair of samples to be worth a
    /// look.
    pub(super) fn are_worth_it(&self, batch: &RadialBatch) -> bool {
        let weights = self.weights.iter();
        let coupled = weights.filter(|weight| **weight != 0.0).count();
        let matched = batch.sources.len() - self.apart.len();
        matched * 2 >= coupled && matched > 0
    }

    /// What a site is to the batch.
    fn of(&self, site: usize) -> [Real; 2] {
        [self.strengths[site], self.weights[site]]
    }
}

impl Pass {
    /// Takes up the batches of the range of the first.
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
        for (site, sample) in samples.list[..samples.sites].iter().enumerate() {
            let of = |place: &Option<usize>| place.map_or([0.0; 2], |place| sides[place].of(site));
            let charges = self.order.iter().map(of);
            if charges.clone().any(|charges| charges != [0.0; 2]) {
                self.tiles.push((site, sample), range.is_none(), charges);
            }
        }
        laws.mutual = (0..self.order.len()).all(|law| is_mutual(self.tiles.sides(law)));
        self.near.keep_if_of(range, &self.tiles);
    }
}

/// Whether strengths are to each other as weights are, so that what acts on one of a pair acts on the
/// other, too. Products that were rounded differ by two roundings of either side.
fn is_mutual(sides: impl Iterator<Item = [Real; 2]> + Clone) -> bool {
    let size = |[_, weight]: &[Real; 2]| weight.abs();
    let largest = sides
        .clone()
        .max_by(|a, b| Real::total_cmp(&size(a), &size(b)));
    let ratio = largest.map_or(0.0, |[strength, weight]| match weight == 0.0 {
        true => 0.0,
        false => strength / weight,
    });
    let mut sides = sides;
    sides.all(|[strength, weight]| {
        (strength - ratio * weight).abs() <= 2.0 * Real::EPSILON * strength.abs()
    })
}
