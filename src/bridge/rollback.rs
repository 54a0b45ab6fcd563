//! Copies of the bodies and joints from before a step, to restore them if the step is refused.

mod joints;

use joints::SavedJoints;

use super::world::{WorldMut, WorldRef};
use crate::math::{ColliderHandle, Pose, RigidBodyHandle};
use crate::rapier::dynamics::{RigidBody, RigidBodyBuilder};
use crate::rigid::{Lookup, find_by, world_pose};

/// Copies of the bodies, and of the state that Rapier keeps of joints.
#[derive(Debug, Default)]
pub(crate) struct Rollback {
    /// In the order of their handles. Those beyond `count` are kept for their allocations only.
    copies: Vec<(RigidBodyHandle, RigidBody)>,
    count: usize,
    joints: SavedJoints,
}

impl Rollback {
    /// Copies the present state.
    pub(crate) fn take(&mut self, world: &WorldMut<'_>) {
        self.clear();
        for (handle, body) in world.bodies.iter() {
            if self.copies.len() == self.count {
                let fresh = RigidBodyBuilder::fixed().build();
                self.copies.push((handle, fresh));
            }
            let copy = &mut self.copies[self.count];
            copy.0 = handle;
            copy.1.copy_from(body);
            self.count += 1;
        }
        self.joints.take(world);
    }

    /// Marks all copies as unused, for a step that cannot fail once it has begun.
    pub(crate) fn clear(&mut self) {
        self.count = 0;
        self.joints.clear();
    }

    fn copy(&self, handle: RigidBodyHandle) -> Option<&RigidBody> {
        let place = find_by(&self.copies[..self.count], handle, |copy| copy.0)?;
        Some(&self.copies[place].1)
    }

    /// The world pose that a collider had when the copies were taken. A body without a copy has not moved.
    pub(crate) fn pose_before(&self, handle: ColliderHandle, world: &WorldRef<'_>) -> Option<Pose> {
        let collider = world.collider(handle)?;
        world_pose(collider, |body| {
            self.copy(body).or_else(|| world.body(body))
        })
    }

    /// Restores all bodies and joints that have changed.
    pub(crate) fn restore(&self, world: &mut WorldMut<'_>) {
        let mut moved = false;
        for (handle, body) in &self.copies[..self.count] {
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
