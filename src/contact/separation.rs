//! How far pairs were apart when that was last looked at.
//!
//! Near shapes that hardly move, as in a heap, need not be searched in every step: as long as two
//! shapes have moved against each other by less than they were apart, they cannot touch. A pair
//! that is left out so would not have been found, so nothing in a motion depends on what is kept.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::sync::Arc;

use crate::field::Fingerprint;
use crate::math::{ColliderHandle, Pose, Real, SharedShape};

/// A distance is measured again when the pair has moved by this share of it, or by this share of
/// its size: a pair that touches would be measured in every step.
const STALE: Real = 0.5;
const STALE_OF_SIZE: Real = 0.02;

/// Roundings of the size and the place of a pair by which a distance may be off.
const ROUNDINGS: Real = 64.0;

/// Parry's manifolds tell touching from being apart to a share of the size of a pair: those of cuboids
/// were seen to have overlaps of 3.4e-4 of it where the shapes are apart. What they would find must not
/// be missed: this is ten times as much.
const UNSURE: Real = 4e-3;

/// A pair that was not asked about for this many rounds is forgotten.
const KEPT: u32 = 64;

/// Distances of pairs, by their colliders.
#[derive(Debug, Default)]
pub(super) struct Separations {
    known: HashMap<[ColliderHandle; 2], Separation, BuildHasherDefault<Fingerprint>>,
    round: u32,
}

#[derive(Debug)]
struct Separation {
    /// Held, so that no other has their place in memory.
    shapes: [SharedShape; 2],
    relative: Pose,
    /// No smaller was their distance there.
    distance: Real,
    /// No point of the second is farther from its origin.
    reach: Real,
    round: u32,
}

impl Separation {
    fn is_of(&self, shapes: [&SharedShape; 2]) -> bool {
        let mut pairs = self.shapes.iter().zip(shapes);
        pairs.all(|(known, shape)| Arc::ptr_eq(&known.0, &shape.0))
    }

    /// By how much the pair has moved since, at most, rounding included.
    fn moved(&self, relative: &Pose) -> Real {
        let shift = relative.translation - self.relative.translation;
        let turn = self.relative.rotation.inverse() * relative.rotation;
        let size = self.reach + relative.translation.length();
        let rounding = ROUNDINGS * Real::EPSILON * size;
        shift.length() + 2.0 * turn.xyz().length() * self.reach + rounding
    }
}

impl Separations {
    /// Begins a round, of which there are one or two in a step.
    pub(super) fn turn(&mut self) {
        self.round = self.round.wrapping_add(1);
        if self.round.is_multiple_of(KEPT) {
            let now = self.round;
            let kept = |it: &Separation| now.wrapping_sub(it.round) <= KEPT;
            self.known.retain(|_, separation| kept(separation));
        }
    }

    /// Whether two shapes are surely farther apart than `near`, the second at a pose relative to
    /// the first. `measure` finds a distance that theirs is not below; none if that is not known.
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
