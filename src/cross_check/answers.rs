//! The impulses by which the fields and Rapier answered contacts, counted for the cross-check.

use crate::contact::FieldContact;
use crate::math::{Real, RigidBodyHandle, Vector, to_f64};
use crate::rapier::geometry::ContactPair;
use crate::rigid::Lookup;

/// Answers to contacts, over all steps. With [`Responder::Both`](crate::Responder) each side answers a hit at its own
/// time: the fields at the end of a step or within it, Rapier in the next.
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Answers {
    /// By the fields.
    pub by_fields: Answered,
    /// By Rapier's solver, for pairs that the cross-check watches. A resting contact is answered in every step.
    pub by_rapier: Answered,
}

/// The answers of one side.
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Answered {
    /// Contacts with an impulse: each counts in every step in which it has one.
    pub contacts: u64,
    /// The sum over these contacts of impulse / reduced mass: the changes of velocity of the two centres of mass
    /// relative to each other.
    pub velocity_change: f64,
}

impl Answered {
    fn add(&mut self, impulse: Vector, bodies: [Option<RigidBodyHandle>; 2], world: &impl Lookup) {
        let size = impulse.length();
        if size == 0.0 {
            return;
        }
        let yields = |body: Option<RigidBodyHandle>| {
            let body = body.and_then(|body| world.body(body));
            body.map_or(0.0, |body| -> Real {
                body.mass_properties().effective_inv_mass.max_element()
            })
        };
        self.contacts += 1;
        self.velocity_change += to_f64(size * (yields(bodies[0]) + yields(bodies[1])));
    }
}

impl Answers {
    pub(super) fn add_field(&mut self, contact: &FieldContact, world: &impl Lookup) {
        self.by_fields
            .add(contact.impulses[0], contact.bodies, world);
    }

    pub(super) fn add_rapier(&mut self, pair: &ContactPair, world: &impl Lookup) {
        let colliders = [pair.collider1, pair.collider2];
        let parent = |collider| world.collider(collider).and_then(|it| it.parent());
        self.by_rapier
            .add(pair.total_impulse(), colliders.map(parent), world);
    }
}
