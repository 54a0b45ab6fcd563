//! Force fields for the Rapier physics engine.
#![forbid(unsafe_code)]
#[cfg(feature = "f32")]
pub extern crate rapier3d as rapier;
#[cfg(feature = "f64")]
pub extern crate rapier3d_f64 as rapier;

pub mod math;

pub mod field;

pub mod reference;

mod compile;

mod eval;

mod inject;

mod detect;

mod check;

mod fields;

#[cfg(feature = "scenes")]
pub mod scenes;

pub mod prelude;

pub use check::{CrossCheckReport, Disagreement};
pub use compile::{IndexKind, Plan, PlanEntry};
pub use detect::{FieldContact, Responder};
pub use eval::{PotentialEnergy, Wrench};
pub use field::{
    Anchor, Axis, ContactLaw, Coupling, Field, Operator, Reading, Region, Sample, Tree, TreeError,
};
pub use fields::{Fields, FieldsBuilder, StepOutcome};
pub use inject::{ProbeProperties, Scheme, StepError, WakePolicy};
