//! In 64-bit precision, on top of `rapier3d-fields-f64`. The rivals are written for 32 bits, and
//! not here.

pub use rapier3d_fields_f64 as fields;

pub use crate::random;

#[path = "scenes/mod.rs"]
pub mod scenes;

#[path = "study/mod.rs"]
pub mod study;

#[path = "watch.rs"]
pub mod watch;
