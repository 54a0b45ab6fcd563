//! The settings of the fields of all contexts.

use bevy::prelude::*;
use rapier3d_fields::pipeline::FieldSettings;

/// The settings of the fields of all contexts. A change counts from the next step on.
///
/// A context with other settings is one whose [`RapierContextFields`](crate::RapierContextFields) you change yourself:
/// they are overwritten when this resource changes, and nothing else.
#[derive(Resource, Clone, Debug, Default)]
pub struct RapierFieldsSettings {
    /// How fields act: scheme, waking, faults, detection, responders, cross-check.
    pub fields: FieldSettings,
    /// The axes of your own that fields may read, with the value of all colliders that have none of their own.
    pub axes: Vec<(String, f32)>,
    /// True to send a [`FieldZoneEvent`](crate::FieldZoneEvent) when a body enters or leaves a zone, which costs a test of
    /// each body against each zone in each step.
    pub zone_events: bool,
    /// True to send a [`FieldContactEvent`](crate::FieldContactEvent) when a contact of a contact field begins or ends.
    pub contact_events: bool,
}
