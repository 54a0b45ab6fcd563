//! Answers to the contacts found at the end of a step.

use super::FieldContact;
use super::solve::{ContactBody, Meeting, resolve};
use crate::field::ContactLaw;
use crate::math::{DVec3, Real, RigidBodyHandle, RigidBodySet, from_dvec3, to_dvec3, to_f64};

/// Answers contacts by their laws and notes the impulses; returns the bodies written.
pub(super) fn respond(
    contacts: &mut [FieldContact],
    bodies: &mut RigidBodySet,
    dt: Real,
    answers: impl Fn(&FieldContact) -> bool,
) -> usize {
    let mut handles: Vec<RigidBodyHandle> =
        contacts.iter().flat_map(|c| c.bodies).flatten().collect();
    handles.sort_unstable_by_key(|handle| handle.into_raw_parts());
    handles.dedup();
    handles.retain(|handle| bodies.contains(*handle));
    let mut movers: Vec<ContactBody> = handles
        .iter()
        .map(|h| ContactBody::of(&bodies[*h]))
        .collect();
    let place = |body: Option<RigidBodyHandle>| {
        let key = body?.into_raw_parts();
        handles
            .binary_search_by_key(&key, |handle| handle.into_raw_parts())
            .ok()
    };
    let mut meetings: Vec<Meeting> = contacts
        .iter()
        .map(|contact| Meeting {
            places: contact.bodies.map(place),
            point: to_dvec3(contact.world_point),
            normal: to_dvec3(contact.world_normal),
            depth: to_f64(contact.depth),
            law: if answers(contact) {
                contact.law
            } else {
                ContactLaw::Observe
            },
            has_field: contact.has_field,
            impulses: [DVec3::ZERO; 2],
        })
        .collect();
    resolve(&mut movers, &mut meetings, to_f64(dt));
    for (contact, meeting) in contacts.iter_mut().zip(&meetings) {
        contact.impulses = meeting.impulses.map(from_dvec3);
    }
    let mut written = 0;
    for (handle, mover) in handles.iter().zip(movers).filter(|(_, mover)| mover.pushed) {
        if !(mover.linvel.is_finite() && mover.angvel.is_finite()) {
            continue;
        }
        if let Some(body) = bodies.get_mut(*handle) {
            // A contact wakes whom it hits, as Rapier's do.
            body.set_linvel(from_dvec3(mover.linvel), true);
            body.set_angvel(from_dvec3(mover.angvel), true);
            written += 1;
        }
    }
    written
}
