//! Columns of a program's instances: their terms, anchors and strengths.

use std::ops::Range;

use super::anchors::{AnchorId, Anchors, NO_ANCHOR};
use super::ordered::{Key, places_of};
use crate::math::Real;

/// Instances of a program, in the order of their terms.
#[derive(Debug, Default)]
pub(crate) struct Instances {
    /// The term of each instance.
    pub serials: Vec<Key>,
    /// For each instance, the anchor from which the reach of the program is measured.
    pub centres: Vec<AnchorId>,
    /// For each instance, the anchor of each leaf, then of each modifier ([`NO_ANCHOR`] if it has none).
    pub anchors: Vec<AnchorId>,
    /// For each entry of `anchors`, the place of its node in the set, for messages.
    pub places: Vec<u32>,
    /// The strength of each instance, if the program is a single field; else empty, since the leaves hold strengths.
    pub strengths: Vec<Real>,
    /// The number of instances that are anchored to a body or collider.
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
        self.of_term(serial).start as u32
    }

    /// The numbers of the instances of a term.
    pub(crate) fn of_term(&self, serial: Key) -> Range<usize> {
        places_of(&self.serials, serial, Key::clone)
    }

    /// All anchors in use, centres included. An anchor is repeated for each of its uses.
    pub(crate) fn anchors(&self) -> impl Iterator<Item = AnchorId> {
        let all = self.centres.iter().chain(&self.anchors);
        all.copied().filter(|anchor| *anchor != NO_ANCHOR)
    }

    /// The number of instances that are anchored to a body or collider.
    pub(super) fn moves(&self, stride: usize, anchors: &Anchors) -> usize {
        let still = |anchor: &AnchorId| *anchor == NO_ANCHOR || anchors.stands_still(*anchor);
        let of_leaves = self.anchors.chunks(stride.max(1));
        let instances = self.centres.iter().zip(of_leaves);
        let moves =
            instances.filter(|(centre, leaves)| !still(centre) || !leaves.iter().all(still));
        moves.count()
    }
}
