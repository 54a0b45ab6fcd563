//! The settings of the fields of all contexts.

use bevy::prelude::*;
use rapier3d_fields::pipeline::FieldSettings;

/// The settings of the fields of all contexts. A change takes effect in the next step.
///
/// For other settings in one context, change its [`RapierContextFields`](crate::RapierContextFields): they are
/// overwritten only when this resource changes.
#[derive(Resource, Clone, Debug, Default)]
pub struct RapierFieldsSettings {
    /// The settings of each context: scheme, waking, faults, detection, responders, cross-check.
    pub fields: FieldSettings,
    /// The axes of your own that fields may read, each with the value for colliders without one in their
    /// [`FieldProperties`](crate::FieldProperties).
    pub axes: Vec<(String, f32)>,
    /// True to send a [`FieldZoneEvent`](crate::FieldZoneEvent) when a body enters or leaves a zone. Costs a test of
    /// each body against each zone in each step.
    pub zone_events: bool,
    /// True to send a [`FieldContactEvent`](crate::FieldContactEvent) when a contact of a contact field begins or ends.
    pub contact_events: bool,
}
