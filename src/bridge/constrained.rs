//! The bodies that Rapier's solver constrains by contacts or joints.

use super::world::WorldMut;
use crate::math::{ColliderHandle, ColliderSet, RigidBodyHandle, RigidBodySet};
use crate::rapier::dynamics::{ImpulseJointSet, MultibodyJointSet, RigidBody};
use crate::rapier::geometry::{ContactPair, NarrowPhase};
use crate::rigid::BodySet;

/// The contacts and joints of a world that may hold bodies.
#[derive(Clone, Copy)]
pub(crate) struct Constraints<'a> {
    bodies: &'a RigidBodySet,
    colliders: &'a ColliderSet,
    pairs: &'a NarrowPhase,
    joints: &'a ImpulseJointSet,
    articulations: &'a MultibodyJointSet,
    /// True if there is any contact pair; saves look-ups in worlds without them.
    contacts: bool,
    /// The same for impulse joints.
    jointed: bool,
}

impl<'a> Constraints<'a> {
    pub(crate) fn new(world: &'a WorldMut<'_>) -> Self {
        Constraints {
            bodies: world.bodies,
            colliders: world.colliders,
            pairs: world.narrow_phase,
            joints: world.impulse_joints,
            articulations: world.multibody_joints,
            contacts: world.narrow_phase.contact_pairs().next().is_some(),
            jointed: !world.impulse_joints.is_empty(),
        }
    }

    /// Returns true if contacts pushed a body in Rapier's last step, or a joint holds it.
    pub(crate) fn hold(&self, handle: RigidBodyHandle, body: &RigidBody) -> bool {
        self.push(body) || self.join(handle)
    }

    /// Returns true if contacts pushed a body in Rapier's last step.
    fn push(&self, body: &RigidBody) -> bool {
        self.any_pair(body, is_pushed)
    }

    fn any_pair(&self, body: &RigidBody, test: impl Fn(&ContactPair) -> bool) -> bool {
        let mut colliders = body.colliders().iter();
        self.contacts && colliders.any(|it| self.pairs.contact_pairs_with(*it).any(&test))
    }

    /// Returns true if a body touches anything or a joint holds it, so that Rapier may move it elsewhere than its
    /// velocity does.
    pub(super) fn concern(&self, handle: RigidBodyHandle, body: &RigidBody) -> bool {
        self.any_pair(body, ContactPair::has_any_active_contact) || self.join(handle)
    }

    /// Returns true if an enabled impulse joint holds a body, or it is a link of a multibody.
    pub(super) fn join(&self, handle: RigidBodyHandle) -> bool {
        let mut joints = self.joints.attached_enabled_joints(handle);
        let articulated = || self.articulations.rigid_body_link(handle).is_some();
        (self.jointed && joints.next().is_some()) || articulated()
    }

    fn parent(&self, collider: ColliderHandle) -> Option<RigidBodyHandle> {
        self.colliders.get(collider)?.parent()
    }

    /// Visits the bodies that are joined to a body, and those of contacts that pushed it in Rapier's last step.
    pub(super) fn each_partner(
        &self,
        handle: RigidBodyHandle,
        mut visit: impl FnMut(RigidBodyHandle),
    ) {
        for (first, second, _, _) in self.joints.attached_enabled_joints(handle) {
            visit(if first == handle { second } else { first });
        }
        for other in self.articulations.attached_bodies(handle) {
            visit(other);
        }
        for (pair, first) in self.pushing(handle) {
            let other = if first {
                pair.collider2
            } else {
                pair.collider1
            };
            self.parent(other).into_iter().for_each(&mut visit);
        }
    }

    /// The contacts that pushed a body in Rapier's last step, each with true if the body is its first side.
    pub(super) fn pushing(
        &self,
        handle: RigidBodyHandle,
    ) -> impl Iterator<Item = (&ContactPair, bool)> {
        let body = self.bodies.get(handle);
        let colliders = body.map_or(&[][..], RigidBody::colliders).iter();
        colliders.flat_map(|collider| {
            let pairs = self.pairs.contact_pairs_with(*collider);
            let pushed = pairs.filter(|pair| is_pushed(pair));
            pushed.map(|pair| (pair, pair.collider1 == *collider))
        })
    }

    /// Collects all bodies that contacts pushed in Rapier's last step, with one walk over all contacts. Impulses are
    /// added up only for bodies that are not yet collected.
    pub(crate) fn find_pushed(&self, pushed: &mut BodySet) {
        pushed.clear();
        let pairs = self.pairs.contact_pairs();
        for pair in pairs.filter(|pair| pair.has_any_active_contact()) {
            let sides = [pair.collider1, pair.collider2].map(|it| self.parent(it));
            let new = |set: &BodySet| sides.iter().flatten().any(|body| !set.contains(*body));
            if new(pushed) && pair.total_impulse_magnitude() > 0.0 {
                sides
                    .into_iter()
                    .flatten()
                    .for_each(|body| pushed.insert(body));
            }
        }
    }

    /// Collects those of `bodies` that contacts pushed in Rapier's last step: cheaper than all contacts where most
    /// bodies sleep.
    pub(crate) fn find_pushed_of(
        &self,
        bodies: impl Iterator<Item = RigidBodyHandle>,
        pushed: &mut BodySet,
    ) {
        pushed.clear();
        let is_pushed = |handle: &RigidBodyHandle| {
            let body = self.bodies.get(*handle);
            body.is_some_and(|body| self.push(body))
        };
        bodies.filter(is_pushed).for_each(|it| pushed.insert(it));
    }

    /// The bodies that enabled impulse joints hold. Links of multibodies are not among them, because the motion of all
    /// links is computed together.
    pub(crate) fn jointed(self) -> impl Iterator<Item = RigidBodyHandle> {
        let enabled = self.joints.iter().filter(|it| it.1.data.is_enabled());
        enabled.flat_map(|(_, joint)| [joint.body1(), joint.body2()])
    }
}

/// Returns true if Rapier's solver pushed the two sides of a contact apart in its last step.
fn is_pushed(pair: &ContactPair) -> bool {
    pair.has_any_active_contact() && pair.total_impulse_magnitude() > 0.0
}
