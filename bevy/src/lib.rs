#![doc = include_str!("../README.md")]
#![deny(rustdoc::broken_intra_doc_links)]

mod carrier;
mod components;
mod context;
#[cfg(feature = "debug-render")]
mod debug_render;
mod force_field;
mod frame;
mod hooks;
mod messages;
mod place;
mod plugin;
mod predict;
mod reports;
mod settings;
mod step;
mod sync;

pub use components::{FieldProperties, FieldSampling, WithinCollider};
pub use context::RapierContextFields;
#[cfg(feature = "debug-render")]
pub use debug_render::{FieldGizmos, FieldsDebugRender, RapierFieldsDebugRenderPlugin};
pub use force_field::ForceField;
pub use messages::{FieldContactEvent, FieldZoneEvent};
pub use plugin::{FieldsSync, RapierFieldsPlugin};
pub use predict::PredictFields;
pub use rapier3d_fields as fields;
pub use settings::RapierFieldsSettings;

/// The items that most apps use. It can be imported beside the preludes of Bevy and `bevy_rapier3d`: no names clash.
pub mod prelude {
    pub use crate::{
        FieldContactEvent, FieldProperties, FieldSampling, FieldZoneEvent, FieldsSync, ForceField,
        PredictFields, RapierContextFields, RapierFieldsPlugin, RapierFieldsSettings,
        WithinCollider,
    };
    #[cfg(feature = "debug-render")]
    pub use crate::{FieldGizmos, FieldsDebugRender, RapierFieldsDebugRenderPlugin};
    pub use rapier3d_fields::cross_check::CrossCheck;
    pub use rapier3d_fields::pipeline::FieldSettings;
    pub use rapier3d_fields::{
        Anchor, ColliderProperties, ContactLaw, Coupling, Detection, FaultPolicy, Field, ForceMode,
        Layer, Operator, Region, Responder, Sample, Sampling, Scheme, Substeps, Tree, WakePolicy,
    };
}
