//! Answers to the overlaps found at the end of a step.

use std::collections::HashMap;

use super::FieldContact;
use super::contact_body::ContactBody;
use super::detector::{Detector, is_masked};
use super::field_mask::DetectionFields;
use super::paper_push::PaperPushes;
use super::solve::{ContactConstraint, ContactPoint, resolve};
use crate::bridge::Push;
use crate::compile::Compiled;
use crate::field::ContactLaw;
use crate::math::{DVec3, Real, RigidBodyHandle, from_dvec3, to_dvec3, to_f64};
use crate::rigid::Lookup;
use crate::sample::Moment;

impl Detector {
    /// Answers the contacts by their laws, adds up their impulses, and appends the new velocities to `pushes`. Returns
    /// the body between the stiffest springs, with an upper bound of the square of its angular frequency.
    pub(super) fn answer(
        &mut self,
        world: &impl Lookup,
        compiled: &Compiled,
        moment: Moment,
        dt: Real,
        answers: impl Fn(&FieldContact) -> bool,
        pushes: &mut Vec<Push>,
    ) -> Option<(RigidBodyHandle, f64)> {
        let (starts, found, contacts) = (&self.starts, &self.found, &mut self.contacts);
        let mut paper = PaperPushes {
            masks: is_masked(compiled).then_some(&mut self.masks),
            fields: DetectionFields::new(&self.touch, compiled, moment),
            known: HashMap::new(),
        };
        let mut handles: Vec<RigidBodyHandle> =
            contacts.iter().flat_map(|c| c.bodies).flatten().collect();
        handles.sort_unstable_by_key(|handle| handle.into_raw_parts());
        handles.dedup();
        handles.retain(|handle| world.body(*handle).is_some());
        let bodies = handles.iter().filter_map(|handle| world.body(*handle));
        let contact_bodies = bodies.zip(&handles).map(|(body, handle)| {
            let start = starts.of(*handle, body);
            ContactBody::pressed(body, &start, starts.pivot_velocity(*handle, body))
        });
        let mut contact_bodies: Vec<ContactBody> = contact_bodies.collect();
        let place = |body: Option<RigidBodyHandle>| {
            let key = body?.into_raw_parts();
            let place = handles.binary_search_by_key(&key, |handle| handle.into_raw_parts());
            place.ok()
        };
        let mut constraints = Vec::new();
        let mut owners = Vec::new();
        for (number, contact) in contacts.iter().enumerate() {
            let law = if answers(contact) {
                contact.law
            } else {
                ContactLaw::Observe
            };
            let places = contact.bodies.map(place);
            let resting_speed = to_f64(starts.resting_speed(contact.law, contact.bodies));
            // A spring pushes at the deepest point only, and the paper's law acts once.
            let points = &found.points[found.contacts[number].1.clone()];
            let deepest = contact.deepest();
            let points = match law {
                ContactLaw::Impulse { .. } => points,
                _ => std::slice::from_ref(&deepest),
            };
            for point in points {
                owners.push(number);
                let spot = ContactPoint {
                    point: to_dvec3(point.world_point),
                    normal: to_dvec3(point.world_normal),
                    depth: to_f64(point.depth),
                };
                constraints.push(ContactConstraint::new(law, resting_speed, places, spot));
            }
            if let Some(last) = constraints.last_mut() {
                paper.note(last, contact, &contact_bodies, [None; 2]);
            }
        }
        let stiffest = resolve(&mut contact_bodies, &mut constraints, to_f64(dt));
        let stiffest = stiffest.map(|it| (handles[it.place], it.omega2));
        for (number, constraint) in owners.into_iter().zip(&constraints) {
            if constraint.failed {
                self.not_finite.push(contacts[number].colliders);
            }
            contacts[number].add_impulses(constraint.impulses);
        }
        for (body, contact_body) in handles
            .iter()
            .zip(contact_bodies)
            .filter(|(_, contact_body)| contact_body.pushed)
        {
            let Some(found) = world.body(*body) else {
                continue;
            };
            let start = starts.of(*body, found);
            let behind = start.turn.map_or(DVec3::ZERO, |turn| turn.behind);
            let behind = contact_body
                .resistance
                .rotor
                .angvel(contact_body.attitude, behind);
            let linvel = from_dvec3(contact_body.linvel) - start.behind;
            let angvel = from_dvec3(contact_body.angvel - behind);
            pushes.push(Push {
                body: *body,
                pose: None,
                linvel,
                angvel,
                hit: None,
            });
        }
        stiffest
    }
}
