//! Copies of joints, because Rapier's step changes them.

use crate::bridge::world::WorldMut;
use crate::math::{Real, RigidBodyHandle, RigidBodySet};
use crate::rapier::dynamics::{
    ImpulseJoint, ImpulseJointHandle, MultibodyIndex, MultibodyJoint, MultibodyJointSet,
};

/// Copies of the joints.
#[derive(Debug, Default)]
pub(super) struct SavedJoints {
    impulse: Vec<(ImpulseJointHandle, ImpulseJoint)>,
    links: Vec<Link>,
    /// Generalised velocities, multibody by multibody.
    velocities: Vec<(MultibodyIndex, Real)>,
}

/// A link of a multibody, whose pose Rapier computes from its joint.
#[derive(Debug)]
struct Link {
    body: RigidBodyHandle,
    articulation: MultibodyIndex,
    joint: MultibodyJoint,
}

impl SavedJoints {
    pub(super) fn clear(&mut self) {
        self.impulse.clear();
        self.links.clear();
        self.velocities.clear();
    }

    pub(super) fn take(&mut self, world: &WorldMut<'_>) {
        let joints = world.impulse_joints.iter();
        self.impulse
            .extend(joints.map(|(handle, joint)| (handle, joint.clone())));
        let set = &*world.multibody_joints;
        for multibody in set.multibodies() {
            let root = multibody.root().rigid_body_handle();
            let Some(id) = set.rigid_body_link(root) else {
                continue;
            };
            let articulation = id.multibody;
            // Rapier may keep a multibody whose only link has become a link of another one.
            let known = set.get_multibody(articulation);
            if !known.is_some_and(|known| std::ptr::eq(known, multibody)) {
                continue;
            }
            self.links.extend(multibody.links().map(|link| Link {
                body: link.rigid_body_handle(),
                articulation,
                joint: link.joint,
            }));
            let velocities = multibody.generalized_velocity();
            self.velocities
                .extend(velocities.iter().map(|it| (articulation, *it)));
        }
    }

    pub(super) fn restore(&self, world: &mut WorldMut<'_>) {
        for (handle, was) in &self.impulse {
            let same = |now: &ImpulseJoint| now.data == was.data && now.impulses == was.impulses;
            if world.impulse_joints.get(*handle).is_none_or(same) {
                continue;
            }
            if let Some(now) = world.impulse_joints.get_mut(*handle, false) {
                (now.data, now.impulses) = (was.data, was.impulses);
            }
        }
        let same = |a: &Link, b: &Link| a.articulation == b.articulation;
        for links in self.links.chunk_by(same) {
            self.restore_links(world.multibody_joints, world.bodies, links);
        }
    }

    /// Restores the links of a multibody, if it still has the same links.
    fn restore_links(&self, set: &mut MultibodyJointSet, bodies: &RigidBodySet, links: &[Link]) {
        let index = links[0].articulation;
        let Some(multibody) = set.get_multibody_mut_internal(index) else {
            return;
        };
        let handles = multibody.links().map(|link| link.rigid_body_handle());
        if !handles.eq(links.iter().map(|link| link.body)) {
            return;
        }
        let was = self.velocities.iter().filter(|(of, _)| *of == index);
        let (had, has) = (was.clone().count(), multibody.ndofs());
        // If the number of degrees of freedom has changed, Rapier's step has fixed the root of a new multibody, and the
        // root is not restored.
        let root = usize::from(had != has);
        let joints = multibody.links_mut().zip(links).skip(root);
        joints.for_each(|(now, was)| now.joint = was.joint);
        let was = was.skip(had.saturating_sub(has));
        let mut now = multibody.generalized_velocity_mut();
        for (now, (_, was)) in now.iter_mut().zip(was) {
            *now = *was;
        }
        multibody.forward_kinematics(bodies, false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prelude::*;

    /// Rapier keeps the multibody of the one link that it made for a joint before it refused the joint.
    #[test]
    fn a_refused_joint_does_not_spoil_the_copy_of_its_link() {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::Y * -9.81;
        let mut body = || {
            let ball = ColliderBuilder::ball(0.1);
            world.insert(RigidBodyBuilder::dynamic(), ball).0
        };
        let [one, two, three] = [body(), body(), body()];
        let joint = SphericalJointBuilder::new();
        let joints = &mut world.multibody_joints;
        assert!(joints.insert(one, two, joint, true).is_some());
        assert!(joints.insert(three, two, joint, true).is_none());
        assert!(joints.insert(three, one, joint, true).is_some());
        assert_eq!(joints.multibodies().count(), 2);
        world.step();
        let velocities = |world: &PhysicsWorld| {
            let multibodies = world.multibody_joints.multibodies();
            let velocities = multibodies.map(|it| it.generalized_velocity().clone_owned());
            velocities.collect::<Vec<_>>()
        };
        let (before, mut saved) = (velocities(&world), SavedJoints::default());
        saved.take(&WorldMut::from(&mut world));
        world.step();
        assert_ne!(velocities(&world), before);
        saved.restore(&mut WorldMut::from(&mut world));
        assert_eq!(velocities(&world), before);
    }

    #[test]
    fn copies_do_not_pile_up() {
        let mut world = PhysicsWorld::new();
        let mut body = || world.insert_body(RigidBodyBuilder::dynamic());
        let bodies = [body(), body(), body(), body()];
        let joint = SphericalJointBuilder::new();
        world.insert_impulse_joint(bodies[0], bodies[1], joint);
        world.insert_multibody_joint(bodies[2], bodies[3], joint);
        world.step();
        let mut saved = SavedJoints::default();
        for _ in 0..3 {
            saved.clear();
            saved.take(&WorldMut::from(&mut world));
        }
        let counts = [saved.impulse.len(), saved.links.len()];
        assert_eq!(counts, [1, 2]);
        // A free root and a ball joint.
        assert_eq!(saved.velocities.len(), 9);
    }
}
