//! Sources and instances of many terms, in the order of the terms.

use std::ops::Range;

use super::anchors::{AnchorId, Anchors};
use super::ordered::Keyed;
use super::program::{NO_ANCHOR, Program};
use super::{Key, RadialBatch, RadialSource, Weighting};
use crate::math::Real;

/// What sources of one batch have in common.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct RadialKey {
    pub law: [u64; 6],
    pub range: u64,
    pub weighting: Weighting,
    pub how: (u8, u64, bool, bool),
    pub lifetime: (u64, u64),
}

/// Where the entries of a term are.
fn places_of(serials: &[Key], serial: Key) -> Range<usize> {
    // Mostly at the end, where new terms are.
    if serials.last().is_none_or(|last| *last < serial) {
        return serials.len()..serials.len();
    }
    let start = serials.partition_point(|known| *known < serial);
    let count = serials[start..].partition_point(|known| *known == serial);
    start..start + count
}

impl Keyed for RadialBatch {
    fn first(&self) -> Key {
        self.serials.first().copied().unwrap_or(Key::MAX)
    }
}

impl RadialBatch {
    /// Puts the sources of one term, which come as a batch, in place of those it had; returns
    /// these, which are still to be taken off the counts.
    pub(super) fn put(&mut self, serial: Key, term: Option<RadialBatch>) -> Vec<RadialSource> {
        let places = places_of(&self.serials, serial);
        let Some(term) = term else {
            self.serials.drain(places.clone());
            return self.sources.drain(places).collect();
        };
        self.on_colliders += term.on_colliders;
        self.moving += term.moving;
        self.serials.splice(places.clone(), term.serials);
        self.sources.splice(places, term.sources).collect()
    }
}

/// Instances of a program.
#[derive(Debug, Default)]
pub(crate) struct Instances {
    /// Of the term of each.
    pub serials: Vec<Key>,
    /// The anchor of each, around which the reach of the program is measured.
    pub centres: Vec<AnchorId>,
    /// The anchor of each leaf, then of each modifier (or [`NO_ANCHOR`]), of each instance.
    pub anchors: Vec<AnchorId>,
    /// The place in the set of whatever has an anchor, for messages; as `anchors`.
    pub places: Vec<u32>,
    /// The strength of each, if the program is one field; else those of its leaves hold.
    pub strengths: Vec<Real>,
    /// How many hang on a body or collider.
    pub moving: usize,
}

impl Instances {
    pub(crate) fn len(&self) -> usize {
        self.centres.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.centres.is_empty()
    }

    /// The number of the first instance of a term.
    pub(crate) fn start_of(&self, serial: Key) -> u32 {
        places_of(&self.serials, serial).start as u32
    }

    /// The numbers of the instances of a term.
    pub(crate) fn of_term(&self, serial: Key) -> Range<usize> {
        places_of(&self.serials, serial)
    }

    /// All anchors, those that are used several times so many times.
    pub(crate) fn anchors(&self) -> impl Iterator<Item = AnchorId> {
        let all = self.centres.iter().chain(&self.anchors);
        all.copied().filter(|anchor| *anchor != NO_ANCHOR)
    }

    /// How many hang on a body or collider.
    pub(super) fn moves(&self, stride: usize, anchors: &Anchors) -> usize {
        let still = |anchor: &AnchorId| *anchor == NO_ANCHOR || anchors.stands_still(*anchor);
        let of_leaves = self.anchors.chunks(stride.max(1));
        let instances = self.centres.iter().zip(of_leaves);
        let moves =
            instances.filter(|(centre, leaves)| !still(centre) || !leaves.iter().all(still));
        moves.count()
    }
}

impl Keyed for Program {
    fn first(&self) -> Key {
        self.instances.serials.first().copied().unwrap_or(Key::MAX)
    }
}

impl Program {
    /// What it is ordered by.
    pub(crate) fn key(&self) -> Key {
        self.first()
    }

    /// Puts the instances of one term, which come as a program of the same kind, in place of those
    /// it had; returns these, which are still to be taken off the count.
    pub(super) fn put(&mut self, serial: Key, term: Option<Program>) -> Instances {
        let stride = self.stride();
        let known = &mut self.instances;
        let new = term.map(|term| term.instances).unwrap_or_default();
        let places = places_of(&known.serials, serial);
        let strided = places.start * stride..places.end * stride;
        // Composites have no strengths of their own.
        let strengths = match known.strengths.is_empty() {
            true => 0..0,
            false => places.clone(),
        };
        known.moving += new.moving;
        Instances {
            serials: known.serials.splice(places.clone(), new.serials).collect(),
            centres: known.centres.splice(places, new.centres).collect(),
            anchors: known.anchors.splice(strided.clone(), new.anchors).collect(),
            places: known.places.splice(strided, new.places).collect(),
            strengths: known.strengths.splice(strengths, new.strengths).collect(),
            moving: 0,
        }
    }
}
