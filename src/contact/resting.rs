//! Contact points of resting pairs, reused instead of searched for anew.
//!
//! If Rapier's solver held a pair, the narrow phase has its manifolds, for the poses at which its step began or, if
//! Rapier reuses them, for earlier ones. They are valid as long as the two have hardly moved relative to each other
//! since. A pair of which neither has moved at all has the points of the previous step. Both follow from the state of
//! the world, so a run resumed from a snapshot is the same bit for bit.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use super::overlap::{ManifoldPoint, points_of};
use super::rules::{Pairs, in_order};
use crate::field::Fingerprint;
use crate::math::{ColliderHandle, Pose, Real, Rotation};
use crate::rapier::geometry::{ContactPair, NarrowPhase};

/// Parts that have moved relative to each other by less than this share of their size have hardly moved: points on
/// curved surfaces are then off by half its square. Rapier reuses its contacts up to a way of 0.05 length units.
const HARDLY: Real = 0.05;

/// The pairs that Rapier's solver held in its last step.
#[derive(Clone, Copy)]
pub(crate) struct HeldPairs<'a> {
    pub pairs: &'a Pairs,
    pub narrow_phase: &'a NarrowPhase,
}

impl<'a> HeldPairs<'a> {
    /// The contact pairs of the narrow phase among them.
    pub(super) fn found(&self) -> impl Iterator<Item = &'a ContactPair> {
        let pairs = self.pairs;
        let found = self.narrow_phase.contact_pairs();
        found.filter(|it| pairs.contains(&in_order([it.collider1, it.collider2])))
    }

    /// Fills `near` with the points that Rapier found for a pair. `swapped` if Rapier's first collider is the second
    /// here; `relative` is the pose of the second relative to the first, and `size` the size of the smaller. Returns
    /// false if the two have moved relative to each other since. The points and normals show it: each point lay on a
    /// normal of the other surface, and the two normals were opposite.
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

/// The points of pairs of which neither solid has moved.
#[derive(Debug, Default)]
pub(super) struct StillPoints {
    known: HashMap<[ColliderHandle; 2], (u32, Vec<ManifoldPoint>), BuildHasherDefault<Fingerprint>>,
    /// The number of the current round; entries that were not used in the previous one are dropped.
    round: u32,
}

impl StillPoints {
    /// Begins a round, and drops the entries that were not used in the last one.
    pub(super) fn turn(&mut self) {
        let last = self.round;
        self.known.retain(|_, (round, _)| *round == last);
        self.round = last.wrapping_add(1);
    }

    /// The points of a pair that has not moved since the last round; `search` finds them if they are not known.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_kept_while_each_round_asks_for_them() {
        let pair = [0, 1].map(|index| ColliderHandle::from_raw_parts(index, 0));
        let (mut points, mut searches) = (StillPoints::default(), 0);
        // True if the pair is asked for in the round.
        for asks in [true, true, true, false, true, false, false, true, true] {
            points.turn();
            if asks {
                points.near(pair, || {
                    searches += 1;
                    Vec::new()
                });
            }
        }
        assert_eq!(searches, 3);
        (0..2).for_each(|_| points.turn());
        assert!(points.known.is_empty());
    }
}
