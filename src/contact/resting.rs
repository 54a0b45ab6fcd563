//! Points of pairs that rest on each other: taken over, instead of searched for from nothing.
//!
//! A pair that Rapier's solver has held has manifolds in the narrow phase, of the poses when its step
//! began or, if Rapier keeps them, before: they do as long as the two have hardly moved against each
//! other since. A pair of which neither has moved at all has the points of the step before. Both
//! follow from the state of the world, so a snapshot goes on bit for bit.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use super::overlap::{ManifoldPoint, points_of};
use super::rules::{Pairs, in_order};
use crate::field::Fingerprint;
use crate::math::{ColliderHandle, Pose, Real, Rotation};
use crate::rapier::geometry::{ContactPair, NarrowPhase};

/// Parts that moved by less than this share of their size, against each other, have hardly moved:
/// points on curved surfaces are then off by half its square.
const HARDLY: Real = 0.02;

/// Pairs that Rapier's solver has held in its last step.
#[derive(Clone, Copy)]
pub(crate) struct HeldPairs<'a> {
    pub pairs: &'a Pairs,
    pub narrow_phase: &'a NarrowPhase,
}

impl<'a> HeldPairs<'a> {
    /// Their contacts as Rapier found them.
    pub(super) fn found(&self) -> impl Iterator<Item = &'a ContactPair> {
        let pairs = self.pairs;
        let found = self.narrow_phase.contact_pairs();
        found.filter(|it| pairs.contains(&in_order([it.collider1, it.collider2])))
    }

    /// The points that Rapier has found of a pair, `swapped` if its first is the second here; the pose
    /// of the second in the frame of the first, and their size. `false` if the two have moved against
    /// each other since: how far shows in the points, of which each lay on a normal of the other, and
    /// in the normals, which were opposite.
    pub(super) fn near(
        &self,
        found: &ContactPair,
        swapped: bool,
        relative: &Pose,
        size: Real,
        near: &mut Vec<ManifoldPoint>,
    ) -> bool {
        near.clear();
        for manifold in found.manifolds() {
            let one = manifold
                .subshape_pos1()
                .map_or(Rotation::IDENTITY, |it| it.rotation);
            let two = manifold
                .subshape_pos2()
                .map_or(Rotation::IDENTITY, |it| it.rotation);
            let mut normals = [one * manifold.local_n1, two * manifold.local_n2];
            if swapped {
                normals.reverse();
            }
            let tilt = (normals[0] + relative.rotation * normals[1]).length();
            for (point, tracked) in points_of(manifold, swapped).zip(&manifold.points) {
                let [on_one, on_two] = point.local_points;
                let lay = on_one + point.local_normal * tracked.dist;
                let shift = (relative.transform_point(on_two) - lay).length();
                let moved = shift + tilt * size;
                if moved.is_nan() || moved > HARDLY * size {
                    return false;
                }
                near.push(point);
            }
        }
        true
    }
}

/// The points of pairs that stand still.
#[derive(Debug, Default)]
pub(super) struct StillPoints {
    known: HashMap<[ColliderHandle; 2], (u32, Vec<ManifoldPoint>), BuildHasherDefault<Fingerprint>>,
    /// Counts the rounds; who was not asked about in the last is forgotten.
    round: u32,
}

impl StillPoints {
    /// Begins a round: forgets all that the last one did not ask for.
    pub(super) fn turn(&mut self) {
        let last = self.round;
        self.known.retain(|_, (round, _)| *round == last);
        self.round = last.wrapping_add(1);
    }

    /// The points of a pair that has not moved since the last round.
    pub(super) fn near(
        &mut self,
        pair: [ColliderHandle; 2],
        search: impl FnOnce() -> Vec<ManifoldPoint>,
    ) -> &[ManifoldPoint] {
        let (round, near) = self.known.entry(pair).or_insert_with(|| (0, search()));
        *round = self.round;
        near
    }
}
