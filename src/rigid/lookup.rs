//! Read access to bodies and colliders by their handles, for stages that do not write.

use crate::math::{ColliderHandle, Pose, RigidBodyHandle};
use crate::rapier::dynamics::RigidBody;
use crate::rapier::geometry::Collider;

/// Read access to a world. `bridge` implements it for Rapier's sets.
pub(crate) trait Lookup {
    /// The body with this handle, if it is in the world.
    fn body(&self, handle: RigidBodyHandle) -> Option<&RigidBody>;

    /// The collider with this handle, if it is in the world.
    fn collider(&self, handle: ColliderHandle) -> Option<&Collider>;

    /// All bodies, in the order of their handles.
    fn bodies(&self) -> impl Iterator<Item = (RigidBodyHandle, &RigidBody)>;

    /// All colliders without a body, in the order of their handles.
    fn free_colliders(&self) -> impl Iterator<Item = (ColliderHandle, &Collider)>;
}

impl<L: Lookup> Lookup for &L {
    fn body(&self, handle: RigidBodyHandle) -> Option<&RigidBody> {
        (**self).body(handle)
    }

    fn collider(&self, handle: ColliderHandle) -> Option<&Collider> {
        (**self).collider(handle)
    }

    fn bodies(&self) -> impl Iterator<Item = (RigidBodyHandle, &RigidBody)> {
        (**self).bodies()
    }

    fn free_colliders(&self) -> impl Iterator<Item = (ColliderHandle, &Collider)> {
        (**self).free_colliders()
    }
}

/// The pose of a collider on its body.
pub(crate) fn local_pose(collider: &Collider) -> Pose {
    let local_pose = collider.position_wrt_parent().copied();
    local_pose.unwrap_or(Pose::IDENTITY)
}

/// The world pose of a collider, from the pose of its body: the collider's own is outdated until Rapier's next step.
/// `None` if the body is gone.
pub(crate) fn world_pose<'a>(
    collider: &Collider,
    body: impl FnOnce(RigidBodyHandle) -> Option<&'a RigidBody>,
) -> Option<Pose> {
    match collider.parent() {
        Some(parent) => Some(*body(parent)?.position() * local_pose(collider)),
        None => Some(*collider.position()),
    }
}
