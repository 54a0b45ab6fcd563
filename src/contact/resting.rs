//! Points of pairs that rest on each other, kept from step to step.
//!
//! A search for them from nothing costs more than all else that Rapier does for a resting pair.
//! What has hardly moved since is placed anew instead: points on two surfaces slide by the second
//! order of the motion only, as Parry reuses them too.

use std::collections::HashMap;

use super::overlap::{ManifoldPoint, OverlapPoint, PlacedShape};
use crate::math::{ColliderHandle, Pose, Real};
use crate::rapier::geometry::Aabb;

/// Parts that moved by less than this share of their size, against each other, have hardly moved:
/// the depth is then off by its square, a millionth.
const HARDLY: Real = 1e-3;

/// The points found last of pairs that rest.
#[derive(Debug, Default)]
pub(super) struct RestingPoints {
    known: HashMap<[ColliderHandle; 2], Known>,
    /// Counts the rounds; who was not asked about in the last is forgotten.
    round: u32,
}

#[derive(Debug)]
struct Known {
    relative: Pose,
    near: Vec<ManifoldPoint>,
    round: u32,
}

impl RestingPoints {
    /// Begins a round: forgets all that the last one did not ask for.
    pub(super) fn turn(&mut self) {
        let last = self.round;
        self.known.retain(|_, known| known.round == last);
        self.round = last.wrapping_add(1);
    }

    /// The overlaps of a resting pair, bounded by boxes.
    pub(super) fn overlaps(
        &mut self,
        pair: [ColliderHandle; 2],
        [one, two]: [(&PlacedShape, &Aabb); 2],
        points: &mut Vec<OverlapPoint>,
    ) {
        let relative = one.0.pose.inv_mul(&two.0.pose);
        let size = [one.1, two.1].map(|bounds| bounds.half_extents().length());
        let size = size[0].min(size[1]);
        let stands = |known: &Known| {
            let moved = (known.relative.translation - relative.translation).length();
            let turned = known.relative.rotation.inverse() * relative.rotation;
            moved + 2.0 * turned.xyz().length() * size <= HARDLY * size
        };
        let known = self.known.entry(pair).or_insert_with(|| Known {
            relative,
            near: one.0.near(two.0),
            round: self.round,
        });
        known.round = self.round;
        if !stands(known) {
            known.relative = relative;
            known.near = one.0.near(two.0);
        }
        one.0.place(two.0, &known.near, points);
    }
}
