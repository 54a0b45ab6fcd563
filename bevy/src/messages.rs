//! Messages: who enters and leaves zones, and what touches.

use bevy::prelude::*;

/// A body entered or left the region of a field, with its centre of mass.
///
/// Sent while [`zone_events`](crate::RapierFieldsSettings::zone_events) is on; see
/// [`Fields::set_zone_events`](rapier3d_fields::Fields::set_zone_events) for what counts as a zone, and how exact times are.
/// Entities may be gone by the time that the message is read.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub enum FieldZoneEvent {
    /// A body entered the region, or the field began around it.
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

/// A contact that a contact field found began or ended.
///
/// Sent while [`contact_events`](crate::RapierFieldsSettings::contact_events) is on. Entities may be gone by the time that
/// the message is read.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub enum FieldContactEvent {
    /// Two colliders began to touch. With swept detection, also each further touch of the same pair.
    Started {
        /// The entities with the `Collider`s.
        colliders: [Entity; 2],
        /// Simulated time of the context in seconds: of the first touch if it is known, else of the end of the step.
        time: f64,
        /// The impulse that the second one's body got in this contact; zero if the fields did not answer.
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
