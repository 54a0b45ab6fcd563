//! Distances of pairs, kept over steps.
//!
//! Near shapes that hardly move, as in a heap, need not be searched in every step: as long as two shapes have moved
//! relative to each other by less than their distance, they cannot touch. A pair that is skipped for this reason would
//! have had no contact, so motions do not depend on what is kept.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::sync::Arc;

use crate::field::Fingerprint;
use crate::math::{ColliderHandle, Pose, Real, SharedShape};

/// A distance is measured again when the pair has moved by this share of it, and by this share of the pair's size.
/// Without the second, a pair that touches would be measured in every step.
const STALE: Real = 0.5;
const STALE_OF_SIZE: Real = 0.02;

/// Error of a distance, in roundings of the size and the place of a pair.
const ROUNDINGS: Real = 64.0;

/// Share of a pair's size below which a distance does not count as being apart. Parry's manifolds are less precise than
/// its distances: for cuboids that are apart, overlaps of 3.4e-4 of the size were seen. Pairs for which manifolds would
/// find points must not be skipped, so this is ten times as much.
const UNSURE: Real = 4e-3;

/// Every this many rounds, pairs that were not used for as many are dropped.
const KEPT: u32 = 64;

/// A lower bound of the distance of each pair, and the relative pose at which it was measured.
#[derive(Debug, Default)]
pub(super) struct Separations {
    known: HashMap<[ColliderHandle; 2], Separation, BuildHasherDefault<Fingerprint>>,
    round: u32,
}

#[derive(Debug)]
struct Separation {
    /// Kept alive, so that no other shapes can have their addresses.
    shapes: [SharedShape; 2],
    relative: Pose,
    /// A lower bound of the distance at `relative`; −1 if it was not measured.
    distance: Real,
    /// An upper bound of the distance of the second shape's points from its origin.
    reach: Real,
    round: u32,
}

impl Separation {
    fn is_of(&self, shapes: [&SharedShape; 2]) -> bool {
        let mut pairs = self.shapes.iter().zip(shapes);
        pairs.all(|(known, shape)| Arc::ptr_eq(&known.0, &shape.0))
    }

    /// An upper bound of the displacement of any point of the pair since, with rounding.
    fn moved(&self, relative: &Pose) -> Real {
        let shift = relative.translation - self.relative.translation;
        let turn = self.relative.rotation.inverse() * relative.rotation;
        let size = self.reach + relative.translation.length();
        let rounding = ROUNDINGS * Real::EPSILON * size;
        shift.length() + 2.0 * turn.xyz().length() * self.reach + rounding
    }
}

impl Separations {
    /// Begins a round; there are one or two in a step.
    pub(super) fn turn(&mut self) {
        self.round = self.round.wrapping_add(1);
        if self.round.is_multiple_of(KEPT) {
            let now = self.round;
            let kept = |it: &Separation| now.wrapping_sub(it.round) <= KEPT;
            self.known.retain(|_, separation| kept(separation));
        }
    }

    /// Returns true if two shapes are known to be farther apart than `near`; `relative` is the pose of the second
    /// relative to the first. `measure` is given the second shape's reach, and returns a lower bound of the distance,
    /// or `None` if it is not known.
    pub(super) fn are_apart(
        &mut self,
        pair: [ColliderHandle; 2],
        shapes: [&SharedShape; 2],
        relative: &Pose,
        near: Real,
        measure: impl FnOnce(Real) -> Option<Real>,
    ) -> bool {
        let round = self.round;
        let unknown = || {
            let bounds = shapes[1].compute_local_bounding_sphere();
            Separation {
                shapes: shapes.map(SharedShape::clone),
                relative: *relative,
                distance: -1.0,
                reach: bounds.center.length() + bounds.radius,
                round,
            }
        };
        let known = self.known.entry(pair).or_insert_with(unknown);
        if !known.is_of(shapes) {
            *known = unknown();
        }
        known.round = round;
        let near = near + UNSURE * known.reach;
        let moved = known.moved(relative);
        if known.distance - moved > near {
            return true;
        }
        if known.distance >= 0.0
            && moved < (STALE * known.distance).max(STALE_OF_SIZE * known.reach)
        {
            return false;
        }
        known.relative = *relative;
        known.distance = measure(known.reach).unwrap_or(0.0).max(0.0);
        known.distance - known.moved(relative) > near
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_that_are_not_met_any_more_are_forgotten() {
        let mut separations = Separations::default();
        let balls = [SharedShape::ball(1.0), SharedShape::ball(1.0)];
        let apart = Pose::translation(9.0, 0.0, 0.0);
        let handle = |index| ColliderHandle::from_raw_parts(index, 0);
        for round in 0..4 * KEPT {
            separations.turn();
            for pair in [[0, 1], [2, 3 + round]].map(|pair| pair.map(handle)) {
                let shapes = [&balls[0], &balls[1]];
                let measure = |_| Some(7.0);
                assert!(separations.are_apart(pair, shapes, &apart, 1.0, measure));
            }
        }
        let kept = separations.known.len();
        assert!(kept as u32 <= 2 * KEPT + 1, "{kept} pairs");
        assert!(separations.known.contains_key(&[0, 1].map(handle)));
    }
}
