//! The world as it was when a step began, to go back to.

use super::world::{View, WorldMut};
use crate::math::{ColliderHandle, Pose, Real, RigidBodyHandle, RigidBodySet};
use crate::rapier::dynamics::{
    MultibodyIndex, MultibodyJoint, MultibodyJointSet, RigidBody, RigidBodyBuilder,
};
use crate::rigid::Lookup;

/// Copies of the bodies that can move, and of the coordinates of articulations.
#[derive(Debug, Default)]
pub(crate) struct Rollback {
    /// By the index of a body.
    copies: Vec<Option<BodyCopy>>,
    articulations: Articulations,
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
        for (handle, body) in world.bodies.iter().filter(|(_, body)| !body.is_fixed()) {
            self.put(handle, body);
        }
        self.articulations.take(world.multibody_joints);
    }

    /// Forgets all: nothing in this step can fail once it has begun.
    pub(crate) fn clear(&mut self) {
        let copies = self.copies.iter_mut().flatten();
        copies.for_each(|copy| copy.current = false);
        self.articulations.clear();
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
    pub(crate) fn pose_before(&self, handle: ColliderHandle, world: &View<'_>) -> Option<Pose> {
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
        let copies = self.copies.iter().flatten();
        for BodyCopy { handle, body, .. } in copies.filter(|copy| copy.current) {
            let same = |now: &RigidBody| is_same(now, body);
            if world.bodies.get(*handle).is_none_or(same) {
                continue;
            }
            if let Some(now) = world.bodies.get_mut(*handle) {
                // Leaves the colliders, and Rapier's bookkeeping, as they are.
                now.copy_from(body);
            }
        }
        self.articulations
            .restore(world.multibody_joints, world.bodies);
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
        && now.is_enabled() == was.is_enabled()
        && now.gyroscopic_forces_enabled() == was.gyroscopic_forces_enabled()
}

/// Where articulations were, and how they moved: Rapier makes the poses of links of that.
#[derive(Debug, Default)]
struct Articulations {
    /// By a link's body, with its place among the links.
    joints: Vec<(RigidBodyHandle, MultibodyIndex, usize, MultibodyJoint)>,
    /// Of one articulation after the other.
    velocities: Vec<(MultibodyIndex, Real)>,
}

impl Articulations {
    fn clear(&mut self) {
        self.joints.clear();
        self.velocities.clear();
    }

    fn take(&mut self, set: &MultibodyJointSet) {
        for multibody in set.multibodies() {
            for (number, link) in multibody.links().enumerate() {
                let body = link.rigid_body_handle();
                let Some(id) = set.rigid_body_link(body) else {
                    continue;
                };
                if number == 0 {
                    let velocities = multibody.generalized_velocity();
                    let velocities = velocities.iter().map(|it| (id.multibody, *it));
                    self.velocities.extend(velocities);
                }
                self.joints.push((body, id.multibody, number, link.joint));
            }
        }
    }

    /// Puts those back that still are what they were made of.
    fn restore(&self, set: &mut MultibodyJointSet, bodies: &RigidBodySet) {
        for of_one in self.joints.chunk_by(|a, b| a.1 == b.1) {
            let index = of_one[0].1;
            let Some(multibody) = set.get_multibody_mut_internal(index) else {
                continue;
            };
            let links = multibody.links().map(|link| link.rigid_body_handle());
            let mut velocities = self.velocities.iter().filter(|(of, _)| *of == index);
            let same = links.eq(of_one.iter().map(|joint| joint.0))
                && velocities.clone().count() == multibody.ndofs();
            if !same {
                continue;
            }
            for (link, was) in multibody.links_mut().zip(of_one) {
                link.joint = was.3;
            }
            for now in multibody.generalized_velocity_mut().iter_mut() {
                if let Some((_, was)) = velocities.next() {
                    *now = *was;
                }
            }
            multibody.forward_kinematics(bodies, false);
        }
    }
}
