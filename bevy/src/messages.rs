//! Messages about bodies that enter and leave zones, and about contacts.

use bevy::prelude::*;

/// The centre of mass of a body entered or left the region of a field.
///
/// Sent while [`zone_events`](crate::RapierFieldsSettings::zone_events) is on. See
/// [`Fields::set_zone_events`](rapier3d_fields::Fields::set_zone_events) for the fields that are zones, and the
/// accuracy of times. Entities may no longer exist when the message is read.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub enum FieldZoneEvent {
    /// A body entered the region, or was inside of it when the field began.
    Entered {
        /// The entity with the [`ForceField`](crate::ForceField).
        field: Entity,
        /// The entity with the `RigidBody`.
        body: Entity,
        /// Simulated time of the context in seconds, within a step.
        time: f64,
    },
    /// A body left the region, or the field ended; or one of the two was disabled or removed.
    Left {
        /// The entity with the [`ForceField`](crate::ForceField).
        field: Entity,
        /// The entity with the `RigidBody`.
        body: Entity,
        /// Simulated time of the context in seconds, within a step.
        time: f64,
    },
}

/// A contact found by a contact field began or ended.
///
/// Sent while [`contact_events`](crate::RapierFieldsSettings::contact_events) is on. Entities may no longer exist when
/// the message is read.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub enum FieldContactEvent {
    /// Two colliders began to touch. With swept detection, also each further touch of the same pair.
    Started {
        /// The entities with the `Collider`s.
        colliders: [Entity; 2],
        /// Simulated time of the context in seconds: of the first touch if it is known, else of the end of the step.
        time: f64,
        /// The impulse on the body of the second collider in this contact; zero if the fields did not answer it.
        impulse: Vec3,
    },
    /// Two colliders no longer touch at the end of a step, or one of them was removed.
    Stopped {
        /// The entities with the `Collider`s.
        colliders: [Entity; 2],
        /// Simulated time of the context in seconds, of the end of the step.
        time: f64,
    },
}
