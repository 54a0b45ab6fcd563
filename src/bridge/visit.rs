//! A visit of many bodies in which each is read and written at once, so that the set is walked over only once.

use super::undo::Undo;
use super::world::WorldMut;
use crate::integrate::VelocityUpdate;
use crate::math::{ColliderHandle, ColliderSet, RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::dynamics::RigidBody;
use crate::rapier::geometry::Collider;

/// The bodies of a world; all that is written to them can be taken back.
pub(crate) struct Visit<'a> {
    bodies: &'a mut RigidBodySet,
    colliders: &'a ColliderSet,
    undo: &'a mut Undo,
}

impl<'a> Visit<'a> {
    pub(crate) fn new(world: &'a mut WorldMut<'_>, undo: &'a mut Undo) -> Self {
        undo.clear();
        Visit {
            bodies: world.bodies,
            colliders: world.colliders,
            undo,
        }
    }

    pub(crate) fn bodies(&self) -> &RigidBodySet {
        self.bodies
    }

    #[inline]
    pub(crate) fn body(&self, handle: RigidBodyHandle) -> Option<&RigidBody> {
        self.bodies.get(handle)
    }

    #[inline]
    pub(crate) fn collider(&self, handle: ColliderHandle) -> Option<&Collider> {
        self.colliders.get(handle)
    }

    /// Recomputes the mass of a body as Rapier will in its next step.
    pub(crate) fn weigh(&mut self, handle: RigidBodyHandle) {
        if let Some(body) = self.bodies.get_mut(handle) {
            body.recompute_mass_properties_from_colliders(self.colliders);
        }
    }

    /// Records and writes the linear velocity of a body.
    #[inline]
    pub(crate) fn set_linvel(&mut self, handle: RigidBodyHandle, linvel: Vector) {
        if let Some(body) = self.bodies.get_mut(handle) {
            self.undo.note_linvel(handle, body);
            body.set_linvel(linvel, false);
        }
    }

    /// Records a body and writes both velocities.
    pub(crate) fn write(&mut self, update: &VelocityUpdate) {
        if let Some(body) = self.bodies.get_mut(update.body) {
            self.undo.note(update.body, body);
            update.write(body);
        }
    }

    /// Takes back everything that was written.
    pub(crate) fn take_back(self) {
        self.undo.take_back(self.bodies);
    }
}
