//! Scene files in 32 bits, for [`rapier3d_fields`].

#![allow(
    clippy::duplicate_mod,
    reason = "the same source in two precisions: its types are those of two crates"
)]

use rapier3d_fields as fields;

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
