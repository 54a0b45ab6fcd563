//! Joints that keep the bodies they connect from touching.

use crate::math::RigidBodyHandle;
use crate::rapier::dynamics::{ImpulseJointSet, MultibodyJointSet};

/// The joints of a world.
#[derive(Clone, Copy)]
pub(crate) struct Joints<'a> {
    pub impulse: &'a ImpulseJointSet,
    pub multibody: &'a MultibodyJointSet,
}

impl Joints<'_> {
    /// Returns true if a joint, or the multibody to which both belong, disables contacts between two bodies. Fields
    /// report such contacts, but do not answer them.
    pub(crate) fn keep_apart(&self, bodies: [Option<RigidBodyHandle>; 2]) -> bool {
        let [Some(one), Some(two)] = bodies else {
            return false;
        };
        let mut joints = self.impulse.joints_between(one, two);
        joints.any(|(_, joint)| !joint.data.contacts_enabled) || self.in_one_multibody(one, two)
    }

    fn in_one_multibody(&self, one: RigidBodyHandle, two: RigidBodyHandle) -> bool {
        let link = |body| self.multibody.rigid_body_link(body);
        let Some((one_link, two_link)) = link(one).zip(link(two)) else {
            return false;
        };
        let multibody = self.multibody.get_multibody(one_link.multibody);
        one_link.multibody == two_link.multibody
            && (multibody.is_some_and(|it| !it.self_contacts_enabled())
                || self
                    .multibody
                    .joint_between(one, two)
                    .is_some_and(|(_, _, link)| !link.joint.data.contacts_enabled))
    }
}
