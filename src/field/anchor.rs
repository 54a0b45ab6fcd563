//! The frames that fields are anchored to: those of the world, a body or a collider.

use std::fmt;

use crate::math::{ColliderHandle, Pose, Real, RigidBodyHandle, Vector};
use crate::rapier::geometry::Collider;

/// The frame that a field moves with.
///
/// The field's own frame is at `local_pose` in that of the world, the body or the collider. A field
/// anchored to a body, or to a collider of a body, does not act on that body; but the reaction of a
/// [reacting](crate::Field::reacting) field does, and so may a [contact](crate::Field::contact) law.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub enum Anchor {
    /// At rest in the world. Inside [`Tree::instances`](crate::Tree::instances), the frame of
    /// the instance takes the world's place.
    World {
        /// The field's frame in the world.
        local_pose: Pose,
    },
    /// Fixed to a rigid body.
    Body {
        /// The body.
        handle: RigidBodyHandle,
        /// The field's frame in the frame of the body.
        local_pose: Pose,
    },
    /// Fixed to a collider.
    Collider {
        /// The collider.
        handle: ColliderHandle,
        /// The field's frame in the frame of the collider.
        local_pose: Pose,
    },
}

impl Anchor {
    /// The world's own frame.
    pub const WORLD: Anchor = Anchor::World {
        local_pose: Pose::IDENTITY,
    };

    /// The field's frame in that of the world, the body or the collider.
    pub fn local_pose(&self) -> &Pose {
        match self {
            Anchor::World { local_pose }
            | Anchor::Body { local_pose, .. }
            | Anchor::Collider { local_pose, .. } => local_pose,
        }
    }

    /// The anchor with the field's frame at `pose`, in the frame of the world, the body or the collider.
    pub fn with_local_pose(mut self, pose: Pose) -> Self {
        match &mut self {
            Anchor::World { local_pose }
            | Anchor::Body { local_pose, .. }
            | Anchor::Collider { local_pose, .. } => *local_pose = pose,
        }
        self
    }

    /// The distance between the origins of two anchors on the same carrier; `None` if the carriers differ.
    pub(crate) fn distance_to(&self, other: &Anchor) -> Option<Real> {
        let from = *self.local_pose();
        let here = other.with_local_pose(from);
        (here == *self).then(|| (other.local_pose().translation - from.translation).length())
    }

    /// The anchor of a field of an instance, given the anchor of the instance. Anchors on bodies and colliders
    /// stay as they are.
    pub(crate) fn within(&self, instance: &Anchor) -> Anchor {
        match self {
            Anchor::World { local_pose } => {
                instance.with_local_pose(*instance.local_pose() * *local_pose)
            }
            _ => *self,
        }
    }

    /// The body that carries the field, if there is one. `collider` looks colliders up.
    pub(crate) fn carrier<'a>(
        &self,
        collider: impl FnOnce(ColliderHandle) -> Option<&'a Collider>,
    ) -> Option<RigidBodyHandle> {
        match self {
            Anchor::World { .. } => None,
            Anchor::Body { handle, .. } => Some(*handle),
            Anchor::Collider { handle, .. } => collider(*handle)?.parent(),
        }
    }

    /// The present frame of the field; `None` if its carrier is not in the world. `of_body` gives the frames of bodies,
    /// and `collider` looks colliders up.
    pub(crate) fn frame<'a>(
        &self,
        of_body: impl FnOnce(RigidBodyHandle) -> Option<Frame>,
        collider: impl FnOnce(ColliderHandle) -> Option<&'a Collider>,
    ) -> Option<Frame> {
        let base = match self {
            Anchor::World { .. } => Frame::at_rest(Pose::IDENTITY),
            Anchor::Body { handle, .. } => of_body(*handle)?,
            Anchor::Collider { handle, .. } => {
                let collider = collider(*handle)?;
                let frame = match (collider.parent(), collider.position_wrt_parent()) {
                    // A collider's own world pose lags behind its body until Rapier's next step.
                    (Some(parent), Some(local_pose)) => of_body(parent)?.then(local_pose),
                    _ => Frame::at_rest(*collider.position()),
                };
                frame.of_collider(*handle)
            }
        };
        Some(base.then(self.local_pose()))
    }
}

impl fmt::Display for Anchor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Anchor::World { .. } => f.write_str("the world"),
            Anchor::Body { handle, .. } => write!(f, "body {handle:?}"),
            Anchor::Collider { handle, .. } => write!(f, "collider {handle:?}"),
        }
    }
}

impl Default for Anchor {
    fn default() -> Self {
        Anchor::WORLD
    }
}

impl From<RigidBodyHandle> for Anchor {
    fn from(handle: RigidBodyHandle) -> Self {
        Anchor::Body {
            handle,
            local_pose: Pose::IDENTITY,
        }
    }
}

impl From<ColliderHandle> for Anchor {
    fn from(handle: ColliderHandle) -> Self {
        Anchor::Collider {
            handle,
            local_pose: Pose::IDENTITY,
        }
    }
}

impl From<Pose> for Anchor {
    fn from(local_pose: Pose) -> Self {
        Anchor::World { local_pose }
    }
}

impl From<Vector> for Anchor {
    fn from(world_point: Vector) -> Self {
        Anchor::from(Pose::from_translation(world_point))
    }
}

/// The present pose and velocity of an anchor's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct Frame {
    /// The frame in the world.
    pub pose: Pose,
    /// Velocity of the frame's origin, in world axes.
    pub velocity: Vector,
    /// Angular velocity of the frame, in world axes.
    pub angvel: Vector,
    /// The body that the frame belongs to. The field does not act on this body.
    pub body: Option<RigidBodyHandle>,
    /// The collider that the frame belongs to, if the anchor is on a collider.
    pub collider: Option<ColliderHandle>,
}

impl Frame {
    /// A frame at rest.
    pub fn at_rest(pose: Pose) -> Self {
        Frame {
            pose,
            velocity: Vector::ZERO,
            angvel: Vector::ZERO,
            body: None,
            collider: None,
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.pose.is_finite() && self.velocity.is_finite() && self.angvel.is_finite()
    }

    /// The frame as that of a collider.
    pub(crate) fn of_collider(self, handle: ColliderHandle) -> Frame {
        Frame {
            collider: Some(handle),
            ..self
        }
    }

    /// The frame at `local_pose` within this one, moving with it.
    pub fn then(&self, local_pose: &Pose) -> Frame {
        let pose = self.pose * *local_pose;
        let arm = pose.translation - self.pose.translation;
        Frame {
            pose,
            velocity: self.velocity + self.angvel.cross(arm),
            ..*self
        }
    }
}

/// Looks up the frames of anchors. Implemented for `(&RigidBodySet, &ColliderSet)`.
pub trait Frames {
    /// The frame of `anchor`; `None` if its body or collider does not exist (any more).
    fn frame(&self, anchor: &Anchor) -> Option<Frame>;
}
