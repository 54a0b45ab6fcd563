//! The state of bodies before a half step wrote to them, to take the half step back.

use crate::math::{RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::dynamics::{RigidBody, RigidBodyActivation};

/// Velocities, activation and gyroscopic switch of bodies before a half step wrote to them.
#[derive(Debug, Default)]
pub(crate) struct Undo(Vec<WrittenBody>);

#[derive(Debug)]
struct WrittenBody {
    body: RigidBodyHandle,
    linvel: Vector,
    angvel: Vector,
    activation: RigidBodyActivation,
    gyroscopic: bool,
}

impl Undo {
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// The number of bodies recorded.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// The bodies, in the order in which they were recorded.
    pub(super) fn bodies(&self) -> impl Iterator<Item = RigidBodyHandle> {
        self.0.iter().map(|before| before.body)
    }

    /// Records a body that is about to be written to.
    #[inline]
    pub(super) fn note(&mut self, handle: RigidBodyHandle, body: &RigidBody) {
        self.0.push(WrittenBody {
            body: handle,
            linvel: body.linvel(),
            angvel: body.angvel(),
            activation: *body.activation(),
            gyroscopic: body.gyroscopic_forces_enabled(),
        });
    }

    /// Restores all recorded bodies.
    pub(crate) fn take_back(&self, bodies: &mut RigidBodySet) {
        for before in &self.0 {
            if let Some(body) = bodies.get_mut(before.body) {
                body.set_linvel(before.linvel, false);
                body.set_angvel(before.angvel, false);
                *body.activation_mut() = before.activation;
                body.enable_gyroscopic_forces(before.gyroscopic);
            }
        }
    }
}
