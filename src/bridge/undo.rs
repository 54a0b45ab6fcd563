//! The state of bodies before a half step wrote to them, to take the half step back.

use crate::math::{RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::dynamics::{RigidBody, RigidBodyActivation};

/// The state of bodies before a half step wrote to them.
#[derive(Debug, Default)]
pub(crate) struct Undo {
    /// Bodies of which only the linear velocity was written. Most are, and a short record is quick to write.
    kicked: Vec<KickedBody>,
    others: Vec<WrittenBody>,
}

#[derive(Debug)]
struct KickedBody {
    body: RigidBodyHandle,
    linvel: Vector,
}

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
        self.kicked.clear();
        self.others.clear();
    }

    /// The number of records.
    pub(crate) fn len(&self) -> usize {
        self.kicked.len() + self.others.len()
    }

    /// The body of a record, by its number.
    pub(super) fn body(&self, number: usize) -> RigidBodyHandle {
        match self.kicked.get(number) {
            Some(kicked) => kicked.body,
            None => self.others[number - self.kicked.len()].body,
        }
    }

    /// Records a body whose linear velocity is about to be written.
    #[inline]
    pub(super) fn note_linvel(&mut self, handle: RigidBodyHandle, body: &RigidBody) {
        self.kicked.push(KickedBody {
            body: handle,
            linvel: body.linvel(),
        });
    }

    /// Records a body that is about to be written to.
    pub(super) fn note(&mut self, handle: RigidBodyHandle, body: &RigidBody) {
        self.others.push(WrittenBody {
            body: handle,
            linvel: body.linvel(),
            angvel: body.angvel(),
            activation: *body.activation(),
            gyroscopic: body.gyroscopic_forces_enabled(),
        });
    }

    /// Restores all recorded bodies.
    pub(crate) fn take_back(&self, bodies: &mut RigidBodySet) {
        // Backwards, because a body may have been recorded twice.
        for before in self.others.iter().rev() {
            if let Some(body) = bodies.get_mut(before.body) {
                body.set_linvel(before.linvel, false);
                body.set_angvel(before.angvel, false);
                *body.activation_mut() = before.activation;
                body.enable_gyroscopic_forces(before.gyroscopic);
            }
        }
        for before in self.kicked.iter().rev() {
            if let Some(body) = bodies.get_mut(before.body) {
                body.set_linvel(before.linvel, false);
            }
        }
    }
}
