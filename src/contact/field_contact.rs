//! A contact found by detection fields, and the collider properties that contacts need.

use super::laws::combined;
use super::overlap::OverlapPoint;
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, DVec3, Real, RigidBodyHandle, Vector, from_dvec3};
use crate::rapier::geometry::InteractionGroups;

/// A contact found by detection fields.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FieldContact {
    /// The colliders, in the order of their handles.
    pub colliders: [ColliderHandle; 2],
    /// Their bodies; `None` for a collider without one.
    pub bodies: [Option<RigidBodyHandle>; 2],
    /// The middle of the overlap, in world space.
    pub world_point: Vector,
    /// Unit vector from the first to the second.
    pub world_normal: Vector,
    /// Depth of the overlap: positive for overlaps at the end of a step; for a touch found by swept detection the depth
    /// at that moment, which is zero to rounding unless the parts overlapped already.
    pub depth: Real,
    /// Simulated time at which the two touched, found by [`Detection::Swept`](crate::Detection::Swept); `None` for an
    /// overlap seen at the end of a step.
    pub time_of_impact: Option<f64>,
    /// Speed of approach along the normal when the contact was found; negative if the two separated.
    pub approach_speed: Real,
    /// The impulses that the fields gave the two sides, in world axes; also set for a side that cannot move. Zero if
    /// the fields did not answer.
    pub impulses: [Vector; 2],
    /// The law of the pair: the stronger of the laws of its two sides.
    pub law: ContactLaw,
    /// For each of the two colliders: true if it has a detection field.
    pub has_field: [bool; 2],
}

impl FieldContact {
    /// A contact of two parts, in any order; `normal` is from the first to the second.
    pub(super) fn new(
        [first, second]: [&ContactPart; 2],
        point: Vector,
        normal: Vector,
        depth: Real,
    ) -> Self {
        let law = combined([first.law, second.law]).unwrap_or(ContactLaw::Observe);
        let swap = second.collider.into_raw_parts() < first.collider.into_raw_parts();
        let (parts, normal) = if swap {
            ([second, first], -normal)
        } else {
            ([first, second], normal)
        };
        FieldContact {
            colliders: parts.map(|part| part.collider),
            bodies: parts.map(|part| part.body),
            world_point: point,
            world_normal: normal,
            depth,
            time_of_impact: None,
            approach_speed: 0.0,
            impulses: [Vector::ZERO; 2],
            law,
            has_field: parts.map(|part| part.law.is_some()),
        }
    }

    /// Returns true if the fields answered it with an impulse.
    pub(super) fn is_answered(&self) -> bool {
        self.impulses != [Vector::ZERO; 2]
    }

    pub(super) fn add_impulses(&mut self, impulses: [DVec3; 2]) {
        for (sum, impulse) in self.impulses.iter_mut().zip(impulses) {
            *sum += from_dvec3(impulse);
        }
    }

    /// The contact's own point, which is its deepest.
    pub(super) fn deepest(&self) -> OverlapPoint {
        OverlapPoint {
            world_point: self.world_point,
            world_normal: self.world_normal,
            depth: self.depth,
        }
    }

    pub(super) fn key(&self) -> [(u32, u32); 2] {
        self.colliders.map(ColliderHandle::into_raw_parts)
    }
}

/// The properties of a collider that detection needs, whatever its shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ContactPart {
    pub collider: ColliderHandle,
    pub body: Option<RigidBodyHandle>,
    pub dynamic: bool,
    /// The law of its detection field, if it has one.
    pub law: Option<ContactLaw>,
    pub groups: InteractionGroups,
}

impl ContactPart {
    /// Returns true unless both parts belong to one body, neither can move, or Rapier's collision groups keep them
    /// apart.
    pub(super) fn may_touch(&self, other: &ContactPart) -> bool {
        let same = self.body.is_some() && self.body == other.body;
        !same && (self.dynamic || other.dynamic) && self.groups.test(other.groups)
    }
}
