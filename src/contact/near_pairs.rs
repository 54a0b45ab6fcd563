//! Pairs of solids or bodies that are near each other, kept until one leaves its widened bounding box.

use crate::math::Real;
use crate::neighbors::hierarchy;
use crate::rapier::geometry::Aabb;
use crate::rapier::parry::bounding_volume::BoundingVolume;
use crate::rapier::parry::partitioning::{Bvh, BvhWorkspace};

/// Boxes are wider than their contents by this share of the least half extent.
const WIDER: Real = 0.1;

/// The bounds of a solid at its pose, or of a body over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub bounds: Aabb,
    pub dynamic: bool,
    /// False for a half-space, which has no bounds.
    pub bounded: bool,
}

/// The pairs whose widened boxes intersect, at least one of each dynamic.
#[derive(Debug, Default)]
pub(super) struct NearPairs {
    /// The widened boxes, by the index of the solid or body.
    boxes: Vec<Place>,
    tree: Bvh,
    unbounded: Vec<u32>,
    /// The pairs in ascending order. Within a pair the lower index is first, except that an unbounded one is last. At
    /// least one of a pair is dynamic.
    pub list: Vec<[u32; 2]>,
}

impl NearPairs {
    /// Makes the pairs anew if a place has left its box, or the list of places has changed.
    pub(super) fn refresh(&mut self, places: impl Iterator<Item = Place> + Clone) {
        let mut boxes = self.boxes.iter();
        let holds = |place: Place| {
            boxes.next().is_some_and(|known| {
                let kind = (known.dynamic, known.bounded) == (place.dynamic, place.bounded);
                kind && (!place.bounded || known.bounds.contains(&place.bounds))
            })
        };
        if !places.clone().all(holds) || boxes.next().is_some() {
            self.make(places);
        }
    }

    fn make(&mut self, places: impl Iterator<Item = Place>) {
        let wider = |place: Place| Place {
            bounds: place
                .bounds
                .loosened(WIDER * place.bounds.half_extents().min_element().max(0.0)),
            ..place
        };
        self.boxes.clear();
        self.boxes.extend(places.map(wider));
        let boxes = &self.boxes;
        let numbers = || (0..boxes.len() as u32).zip(boxes);
        self.unbounded.clear();
        let unbounded = numbers().filter(|(_, place)| !place.bounded);
        self.unbounded.extend(unbounded.map(|(number, _)| number));
        let bounded = || numbers().filter(|(_, place)| place.bounded);
        let leaves = bounded().map(|(number, place)| (number as usize, place.bounds));
        self.tree = hierarchy(leaves.collect());
        self.list.clear();
        let list = &mut self.list;
        let mut add = |pair: [u32; 2]| {
            if pair.iter().any(|number| boxes[*number as usize].dynamic) {
                list.push(pair);
            }
        };
        let mut workspace = BvhWorkspace::default();
        self.tree
            .traverse_bvtt_single_tree::<false>(&mut workspace, &mut |a, b| {
                add([a.min(b), a.max(b)]);
            });
        for wall in &self.unbounded {
            bounded().for_each(|(other, _)| add([other, *wall]));
        }
        // The order in which the tree yields pairs depends on its history.
        self.list.sort_unstable();
    }

    /// The indices whose widened boxes intersect `bounds`, and all unbounded ones.
    pub(super) fn around<'a>(&'a self, bounds: &'a Aabb) -> impl Iterator<Item = u32> + 'a {
        let near = self.tree.intersect_aabb(bounds);
        near.chain(self.unbounded.iter().copied())
    }
}
