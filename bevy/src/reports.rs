//! The reports of steps: messages to the app, and warnings and errors to its log.

use std::collections::HashMap;
use std::mem::{Discriminant, discriminant};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, PoisonError};

use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy_rapier3d::prelude::{RapierContextColliders, RapierRigidBodySet};
use rapier3d_fields::contact::ContactEvent;
use rapier3d_fields::diagnose::ZoneEvent;
use rapier3d_fields::rapier::prelude::{ColliderHandle, RigidBodyHandle};
use rapier3d_fields::{FieldHandle, Fields, StepError, StepWarning};

use crate::messages::{FieldContactEvent, FieldZoneEvent};

/// The simulated time in seconds for which a kind of warning is not logged again.
const QUIET: f64 = 1.0;

/// Writers of all messages.
#[derive(SystemParam)]
pub(crate) struct FieldMessages<'w> {
    zones: MessageWriter<'w, FieldZoneEvent>,
    contacts: MessageWriter<'w, FieldContactEvent>,
}

/// Finds the entities of the handles in events.
pub(crate) struct Entities<'a> {
    /// The entity of the context, to which fields that belong to no other entity are attributed.
    pub context: Entity,
    pub owners: &'a HashMap<FieldHandle, Entity>,
    pub bodies: &'a RapierRigidBodySet,
    pub colliders: &'a RapierContextColliders,
}

/// The channels of a context, and what has been reported.
#[derive(Default)]
pub(crate) struct Reports {
    zones: Option<Mutex<Receiver<ZoneEvent>>>,
    contacts: Option<Mutex<Receiver<ContactEvent>>>,
    /// The entities of each field and a body inside of it: they may no longer exist when `Left` is sent.
    inside: HashMap<(FieldHandle, RigidBodyHandle), [Entity; 2]>,
    touching: HashMap<[ColliderHandle; 2], [Entity; 2]>,
    error: Option<String>,
    /// The simulated time when each kind of warning was logged last.
    warned: HashMap<Discriminant<StepWarning>, f64>,
}

impl Reports {
    /// Opens and closes channels.
    pub fn listen(&mut self, fields: &mut Fields, zones: bool, contacts: bool) {
        if self.zones.is_some() != zones {
            let (sender, receiver) = channel();
            fields.set_zone_events(zones.then_some(sender));
            self.zones = zones.then(|| receiver.into());
        }
        if self.contacts.is_some() != contacts {
            let (sender, receiver) = channel();
            fields.set_events(contacts.then_some(sender));
            self.contacts = contacts.then(|| receiver.into());
        }
    }

    /// Reports with channels of their own, for a copy of the fields.
    pub fn for_copy(&self, copy: &mut Fields) -> Self {
        let mut reports = Reports {
            inside: self.inside.clone(),
            touching: self.touching.clone(),
            error: self.error.clone(),
            warned: self.warned.clone(),
            ..Reports::default()
        };
        reports.listen(copy, self.zones.is_some(), self.contacts.is_some());
        reports
    }

    /// Sends the events of the last steps to the app.
    pub fn send(&mut self, entities: &Entities<'_>, messages: &mut FieldMessages<'_>) {
        for event in received(&mut self.zones) {
            messages.zones.write_batch(self.zone_event(event, entities));
        }
        for event in received(&mut self.contacts) {
            messages
                .contacts
                .write_batch(self.contact_event(event, entities));
        }
    }

    fn zone_event(&mut self, event: ZoneEvent, entities: &Entities<'_>) -> Option<FieldZoneEvent> {
        match event {
            ZoneEvent::Entered { field, body, time } => {
                let owner = entities.owners.get(&field).copied();
                let pair = [owner.unwrap_or(entities.context), entities.body(body)?];
                self.inside.insert((field, body), pair);
                let [field, body] = pair;
                Some(FieldZoneEvent::Entered { field, body, time })
            }
            ZoneEvent::Left { field, body, time } => {
                let [field, body] = self.inside.remove(&(field, body))?;
                Some(FieldZoneEvent::Left { field, body, time })
            }
            _ => None,
        }
    }

    fn contact_event(
        &mut self,
        event: ContactEvent,
        entities: &Entities<'_>,
    ) -> Option<FieldContactEvent> {
        match event {
            ContactEvent::Started {
                colliders: pair,
                time,
                impulse,
            } => {
                let colliders = [entities.collider(pair[0])?, entities.collider(pair[1])?];
                self.touching.insert(pair, colliders);
                Some(FieldContactEvent::Started {
                    colliders,
                    time,
                    impulse,
                })
            }
            ContactEvent::Stopped {
                colliders: pair,
                time,
            } => {
                let colliders = self.touching.remove(&pair)?;
                Some(FieldContactEvent::Stopped { colliders, time })
            }
            _ => None,
        }
    }

    /// Logs an error, unless it is the same as in the last step.
    pub fn log_error(&mut self, context: Entity, error: &StepError) {
        let text = error.to_string();
        if self.error.as_ref() != Some(&text) {
            log::error!("context {context} stands still, since its fields cannot act: {text}");
            self.error = Some(text);
        }
    }

    /// Logs the warnings of a step, each kind at most once in a second of simulated time.
    pub fn log_warnings(&mut self, fields: &Fields) {
        self.error = None;
        for warning in fields.warnings() {
            let last = self
                .warned
                .entry(discriminant(warning))
                .or_insert(f64::NEG_INFINITY);
            if (fields.time() - *last).abs() >= QUIET {
                *last = fields.time();
                log::warn!("{warning}");
            }
        }
    }
}

impl Entities<'_> {
    fn body(&self, body: RigidBodyHandle) -> Option<Entity> {
        self.bodies.rigid_body_entity(body)
    }

    fn collider(&self, collider: ColliderHandle) -> Option<Entity> {
        self.colliders.collider_entity(collider)
    }
}

/// All that has arrived on a channel.
fn received<T>(channel: &mut Option<Mutex<Receiver<T>>>) -> Vec<T> {
    let Some(receiver) = channel else {
        return Vec::new();
    };
    let receiver = receiver.get_mut().unwrap_or_else(PoisonError::into_inner);
    receiver.try_iter().collect()
}
