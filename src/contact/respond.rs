//! Answers to the contacts found at the end of a step.

use super::FieldContact;
use super::solve::{ContactBody, Meeting, resolve};
use crate::bridge::Push;
use crate::field::ContactLaw;
use crate::math::{DVec3, Real, RigidBodyHandle, from_dvec3, to_dvec3, to_f64};
use crate::rigid::Lookup;

/// Answers contacts by their laws, notes the impulses, and says how bodies go on.
pub(super) fn respond(
    contacts: &mut [FieldContact],
    world: &impl Lookup,
    dt: Real,
    answers: impl Fn(&FieldContact) -> bool,
    pushes: &mut Vec<Push>,
) {
    let mut handles: Vec<RigidBodyHandle> =
        contacts.iter().flat_map(|c| c.bodies).flatten().collect();
    handles.sort_unstable_by_key(|handle| handle.into_raw_parts());
    handles.dedup();
    handles.retain(|handle| world.body(*handle).is_some());
    let bodies = handles.iter().filter_map(|handle| world.body(*handle));
    let mut movers: Vec<ContactBody> = bodies.map(ContactBody::of).collect();
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
    for (body, mover) in handles.iter().zip(movers).filter(|(_, mover)| mover.pushed) {
        let (linvel, angvel) = (from_dvec3(mover.linvel), from_dvec3(mover.angvel));
        if mover.linvel.is_finite() && mover.angvel.is_finite() {
            pushes.push(Push {
                body: *body,
                pose: None,
                linvel,
                angvel,
            });
        }
    }
}
