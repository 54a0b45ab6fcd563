//! Scene files in 64 bits, for [`rapier3d_fields_f64`].

#![allow(
    clippy::duplicate_mod,
    reason = "the same source in two precisions: its types are those of two crates"
)]

use rapier3d_fields_f64 as fields;

#[path = "files/mod.rs"]
mod files;
#[cfg(feature = "replay")]
#[path = "recorder/mod.rs"]
mod recorder;
#[cfg(feature = "simulate")]
#[path = "run/mod.rs"]
pub(crate) mod run;

pub use files::*;
#[cfg(feature = "replay")]
pub use recorder::{Pace, Recorder};
