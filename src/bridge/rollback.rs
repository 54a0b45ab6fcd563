//! Copies of the bodies and joints from before a step, to restore them if the step is refused.

mod joints;

use joints::SavedJoints;

use super::world::{WorldMut, WorldRef};
use crate::math::{ColliderHandle, Pose, RigidBodyHandle};
use crate::rapier::dynamics::{RigidBody, RigidBodyBuilder};
use crate::rigid::Lookup;

/// Copies of the bodies, and of the state that Rapier keeps of joints.
#[derive(Debug, Default)]
pub(crate) struct Rollback {
    /// By the index of a body.
    copies: Vec<Option<BodyCopy>>,
    joints: SavedJoints,
}

/// A copy of a body. One that is not `current` is kept for its allocations only.
#[derive(Debug)]
struct BodyCopy {
    handle: RigidBodyHandle,
    body: RigidBody,
    current: bool,
}

impl Rollback {
    /// Copies the present state.
    pub(crate) fn take(&mut self, world: &WorldMut<'_>) {
        self.clear();
        for (handle, body) in world.bodies.iter() {
            self.put(handle, body);
        }
        self.joints.take(world);
    }

    /// Marks all copies as unused: this step cannot fail once it has begun.
    pub(crate) fn clear(&mut self) {
        let copies = self.copies.iter_mut().flatten();
        copies.for_each(|copy| copy.current = false);
        self.joints.clear();
    }

    fn put(&mut self, handle: RigidBodyHandle, body: &RigidBody) {
        let index = handle.into_raw_parts().0 as usize;
        if self.copies.len() <= index {
            self.copies.resize_with(index + 1, || None);
        }
        let copy = self.copies[index].get_or_insert_with(|| BodyCopy {
            handle,
            body: RigidBodyBuilder::fixed().build(),
            current: true,
        });
        (copy.handle, copy.current) = (handle, true);
        copy.body.copy_from(body);
    }

    fn copy(&self, handle: RigidBodyHandle) -> Option<&RigidBody> {
        let index = handle.into_raw_parts().0 as usize;
        let copy = self.copies.get(index)?.as_ref();
        let copy = copy.filter(|copy| copy.current && copy.handle == handle);
        copy.map(|copy| &copy.body)
    }

    /// The world pose that a collider had when the copies were taken. A body without a copy has not moved.
    pub(crate) fn pose_before(&self, handle: ColliderHandle, world: &WorldRef<'_>) -> Option<Pose> {
        let collider = world.collider(handle)?;
        let (Some(parent), Some(local_pose)) = (collider.parent(), collider.position_wrt_parent())
        else {
            return Some(*collider.position());
        };
        let body = self.copy(parent).or_else(|| world.body(parent));
        Some(*body?.position() * *local_pose)
    }

    /// Restores all bodies and joints that have changed.
    pub(crate) fn restore(&self, world: &mut WorldMut<'_>) {
        let mut moved = false;
        let copies = self.copies.iter().flatten();
        for BodyCopy { handle, body, .. } in copies.filter(|copy| copy.current) {
            let same = |now: &RigidBody| is_same(now, body);
            if world.bodies.get(*handle).is_none_or(same) {
                continue;
            }
            if let Some(now) = world.bodies.get_mut(*handle) {
                // This leaves the colliders, and Rapier's bookkeeping, as they are.
                now.copy_from(body);
                moved = true;
            }
        }
        self.joints.restore(world);
        if !moved {
            return;
        }
        let bodies = &mut *world.bodies;
        bodies.propagate_modified_body_positions_to_colliders(world.colliders);
    }
}

/// Returns true if neither Rapier's step nor fields have changed a body.
fn is_same(now: &RigidBody, was: &RigidBody) -> bool {
    now.position() == was.position()
        && now.next_position() == was.next_position()
        && now.vels() == was.vels()
        && now.activation() == was.activation()
        && now.user_force() == was.user_force()
        && now.user_torque() == was.user_torque()
        && now.mass_properties() == was.mass_properties()
        && now.is_enabled() == was.is_enabled()
        && now.gyroscopic_forces_enabled() == was.gyroscopic_forces_enabled()
}
