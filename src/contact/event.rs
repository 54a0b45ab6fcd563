//! Contacts of fields as events, in the shape of Rapier's.

use std::collections::BTreeMap;
use std::sync::mpsc::Sender;

use super::FieldContact;
use crate::math::{ColliderHandle, Vector};

/// A contact of detection fields that began or ended, as Rapier's `CollisionEvent`, with the
/// impulse of the answer.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ContactEvent {
    /// Two colliders have begun to touch, or, found by swept detection, have touched again.
    Started {
        /// The colliders, in the order of their handles.
        colliders: [ColliderHandle; 2],
        /// Simulated time of first touch if known, else of the end of the step.
        time: f64,
        /// The impulse that the second was given at once; zero if the fields did not answer.
        impulse: Vector,
    },
    /// Two colliders no longer touch at the end of a step, or were removed.
    Stopped {
        /// The colliders, in the order of their handles.
        colliders: [ColliderHandle; 2],
        /// Simulated time of the end of the step.
        time: f64,
    },
}

type Key = [(u32, u32); 2];

/// Sends events to whoever listens.
#[derive(Debug)]
pub(crate) struct Reporter {
    channel: Sender<ContactEvent>,
    touching: BTreeMap<Key, [ColliderHandle; 2]>,
}

impl Reporter {
    pub(crate) fn new(channel: Sender<ContactEvent>) -> Self {
        Reporter {
            channel,
            touching: BTreeMap::new(),
        }
    }

    /// Compares the contacts at the end of a step with those before; `time` is its end.
    pub(crate) fn report(&mut self, contacts: &[FieldContact], time: f64) {
        let mut now = BTreeMap::new();
        for contact in contacts {
            let (key, colliders) = (contact.key(), contact.colliders);
            let again = contact.time_of_impact.is_some();
            if again || !self.touching.contains_key(&key) {
                self.send(ContactEvent::Started {
                    colliders,
                    time: contact.time_of_impact.unwrap_or(time),
                    impulse: contact.impulses[1],
                });
            }
            now.insert(key, colliders);
        }
        let before = std::mem::replace(&mut self.touching, now);
        for (key, colliders) in before {
            if !self.touching.contains_key(&key) {
                self.send(ContactEvent::Stopped { colliders, time });
            }
        }
    }

    /// A channel whose other end is gone is no error: nobody listens any more.
    fn send(&self, event: ContactEvent) {
        let _ = self.channel.send(event);
    }
}
