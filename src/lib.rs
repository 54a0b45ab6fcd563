//! Force fields for the Rapier physics engine.
#![forbid(unsafe_code)]
#[cfg(feature = "f32")]
pub extern crate rapier3d as rapier;
#[cfg(feature = "f64")]
pub extern crate rapier3d_f64 as rapier;

pub mod math;
pub mod field;
pub mod reference;
pub mod compile;
pub mod eval;
pub mod prelude;

pub use field::{Anchor, Axis, ContactLaw, Coupling, Field, Operator, Reading, Region, Sample, Tree, TreeError};
