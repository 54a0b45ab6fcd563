//! Instances of programs.

use std::ops::Range;

use super::anchors::{AnchorId, Anchors, NO_ANCHOR};
use super::ordered::{Key, places_of};
use crate::math::Real;

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
