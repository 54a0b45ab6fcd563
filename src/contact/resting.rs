//! Points of pairs that rest on each other: taken over, instead of searched for from nothing.
//!
//! A pair that Rapier's solver has held has fresh manifolds in the narrow phase, of the poses when
//! its step began: they do as long as the two have hardly moved against each other since. A pair of which
//! neither has
//! moved at all has the points of the step before. Both follow from the state of the world, so a
//! snapshot goes on bit for bit.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use super::overlap::{ManifoldPoint, points_of};
use super::rules::{Pairs, in_order};
use crate::field::Fingerprint;
use crate::math::{ColliderHandle, Pose, Real};
use crate::rapier::geometry::NarrowPhase;

/// Parts that moved by less than this share of their size, against each other, have hardly moved:
/// points on curved surfaces are then off by half its square.
const HARDLY: Real = 0.02;

/// Pairs that Rapier's solver has held in its last step.
#[derive(Clone, Copy)]
pub(crate) struct HeldPairs<'a> {
    pub pairs: &'a Pairs,
    pub narrow_phase: &'a NarrowPhase,
}

/// A part of a pair: where it was when Rapier's step began and is now, and its size.
#[derive(Clone, Copy)]
pub(super) struct HeldPart {
    pub poses: [Pose; 2],
    pub size: Real,
}

impl HeldPairs<'_> {
    /// The points that Rapier has found of two colliders, if it has held them and they do still.
    pub(super) fn near(
        &self,
        pair: [ColliderHandle; 2],
        parts: impl FnOnce() -> [HeldPart; 2],
    ) -> Option<Vec<ManifoldPoint>> {
        if !self.pairs.contains(&in_order(pair)) {
            return None;
        }
        let parts = parts();
        let size = parts[0].size.min(parts[1].size);
        let relative = |when: usize| parts[0].poses[when].inv_mul(&parts[1].poses[when]);
        let (before, now) = (relative(0), relative(1));
        let shift = (now.translation - before.translation).length();
        let turn = (before.rotation.inverse() * now.rotation).xyz().length();
        if shift + 2.0 * turn * size > HARDLY * size {
            return None;
        }
        let found = self.narrow_phase.contact_pair(pair[0], pair[1])?;
        let of = |manifold| points_of(manifold, found.collider1 != pair[0]);
        Some(found.manifolds().iter().flat_map(of).collect())
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
