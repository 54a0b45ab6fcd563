//! The world as it was when a step began, to go back to.

mod joints;

use joints::Joints;

use super::world::{WorldMut, WorldRef};
use crate::math::{ColliderHandle, Pose, RigidBodyHandle};
use crate::rapier::dynamics::{RigidBody, RigidBodyBuilder};
use crate::rigid::Lookup;

/// Copies of the bodies, and of what Rapier knows of joints.
#[derive(Debug, Default)]
pub(crate) struct Rollback {
    /// By the index of a body.
    copies: Vec<Option<BodyCopy>>,
    joints: Joints,
}

/// A body as it was. Where nothing is to be gone back to, an old copy stays for its memory.
#[derive(Debug)]
struct BodyCopy {
    handle: RigidBodyHandle,
    body: RigidBody,
    current: bool,
}

impl Rollback {
    /// Takes the present state.
    pub(crate) fn take(&mut self, world: &WorldMut<'_>) {
        self.clear();
        for (handle, body) in world.bodies.iter() {
            self.put(handle, body);
        }
        self.joints.take(world);
    }

    /// Forgets all: nothing in this step can fail once it has begun.
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

    /// The world pose that a collider had. What was not copied has not moved.
    pub(crate) fn pose_before(&self, handle: ColliderHandle, world: &WorldRef<'_>) -> Option<Pose> {
        let collider = world.collider(handle)?;
        let (Some(parent), Some(local_pose)) = (collider.parent(), collider.position_wrt_parent())
        else {
            return Some(*collider.position());
        };
        let body = self.copy(parent).or_else(|| world.body(parent));
        Some(*body?.position() * *local_pose)
    }

    /// Puts everything back.
    pub(crate) fn restore(&self, world: &mut WorldMut<'_>) {
        let mut moved = false;
        let copies = self.copies.iter().flatten();
        for BodyCopy { handle, body, .. } in copies.filter(|copy| copy.current) {
            let same = |now: &RigidBody| is_same(now, body);
            if world.bodies.get(*handle).is_none_or(same) {
                continue;
            }
            if let Some(now) = world.bodies.get_mut(*handle) {
                // Leaves the colliders, and Rapier's bookkeeping, as they are.
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

/// Whether Rapier's step, and fields, have left a body as it was.
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
