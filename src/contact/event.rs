//! Contact events of detection fields, shaped like Rapier's `CollisionEvent`.

use std::sync::mpsc::Sender;

use super::FieldContact;
use crate::math::{ColliderHandle, Vector};

/// A contact of detection fields began or ended; like Rapier's `CollisionEvent`, with the impulse of the answer.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ContactEvent {
    /// Two colliders began to touch. With swept detection, also each further touch of the same pair.
    Started {
        /// The colliders, in the order of their handles.
        colliders: [ColliderHandle; 2],
        /// Simulated time: of the first touch if it is known, else of the end of the step.
        time: f64,
        /// The impulse that the second collider's body got in this contact; zero if the fields did not answer.
        impulse: Vector,
    },
    /// Two colliders no longer touch at the end of a step, or one of them was removed.
    Stopped {
        /// The colliders, in the order of their handles.
        colliders: [ColliderHandle; 2],
        /// Simulated time of the end of the step.
        time: f64,
    },
}

/// Compares the contacts of a step with the pairs that were `touching` before, sends the events, and updates
/// `touching`. `time` is the end of the step.
pub(crate) fn report(
    channel: &Sender<ContactEvent>,
    touching: &mut Vec<[ColliderHandle; 2]>,
    contacts: &[FieldContact],
    time: f64,
) {
    // A closed channel is no error: its listener has gone.
    let send = |event| {
        let _ = channel.send(event);
    };
    let key = |colliders: &[ColliderHandle; 2]| colliders.map(ColliderHandle::into_raw_parts);
    let mut now: Vec<[ColliderHandle; 2]> = Vec::with_capacity(contacts.len());
    for contact in contacts {
        let colliders = contact.colliders;
        let touched = touching.binary_search_by_key(&key(&colliders), key).is_ok();
        // A touch found by swept detection is a new touch of its pair.
        if contact.time_of_impact.is_some() || !touched {
            send(ContactEvent::Started {
                colliders,
                time: contact.time_of_impact.unwrap_or(time),
                impulse: contact.impulses[1],
            });
        }
        now.push(colliders);
    }
    now.sort_unstable_by_key(key);
    now.dedup();
    for colliders in std::mem::replace(touching, now) {
        if touching
            .binary_search_by_key(&key(&colliders), key)
            .is_err()
        {
            send(ContactEvent::Stopped { colliders, time });
        }
    }
}
