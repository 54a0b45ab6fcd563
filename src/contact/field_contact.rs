//! A contact as detection fields find it, and the parts of bodies that can have one.

use super::laws::combined;
use super::overlap::OverlapPoint;
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, Real, RigidBodyHandle, Vector};
use crate::rapier::geometry::InteractionGroups;

/// A contact found by detection fields.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FieldContact {
    /// The colliders, in the order of their handles.
    pub colliders: [ColliderHandle; 2],
    /// Their bodies.
    pub bodies: [Option<RigidBodyHandle>; 2],
    /// The middle of the overlap.
    pub world_point: Vector,
    /// Unit vector from the first to the second.
    pub world_normal: Vector,
    /// How far they overlap; more than zero, but for a touch found when it happened.
    pub depth: Real,
    /// Simulated time at which the two touched, found by [`Detection::Swept`](crate::Detection::Swept); `None` for an
    /// overlap seen at the end of a step.
    pub time_of_impact: Option<f64>,
    /// How fast the two approached along the normal when found; negative if they parted.
    pub approach_speed: Real,
    /// The impulses that the fields gave the two bodies, fixed ones included; zero if the fields
    /// did not answer.
    pub impulses: [Vector; 2],
    /// The law of the pair.
    pub law: ContactLaw,
    /// Which of the two have a detection field.
    pub has_field: [bool; 2],
}

impl FieldContact {
    /// Of two parts, in any order; the normal is from the first to the second.
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

    /// Where they overlap most.
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

/// The properties that balls and other shapes have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ContactPart {
    pub collider: ColliderHandle,
    pub body: Option<RigidBodyHandle>,
    pub dynamic: bool,
    /// Of its detection field, if it has one.
    pub law: Option<ContactLaw>,
    pub groups: InteractionGroups,
}

impl ContactPart {
    /// Parts of one body never touch, nor do two that cannot move, nor what Rapier's collision
    /// groups keep apart.
    pub(super) fn may_touch(&self, other: &ContactPart) -> bool {
        let same = self.body.is_some() && self.body == other.body;
        !same && (self.dynamic || other.dynamic) && self.groups.test(other.groups)
    }
}
