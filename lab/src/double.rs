//! In 64-bit precision, on top of `rapier3d-fields-f64`. The rivals are written for 32 bits only.

pub use rapier3d_fields_f64 as fields;

pub use crate::random;

use rapier3d_fields_scene::double as files;

#[path = "scenes/mod.rs"]
pub mod scenes;

#[path = "cases/mod.rs"]
pub mod cases;

#[allow(missing_docs, reason = "of this repository only, and the names say it")]
#[path = "stability/mod.rs"]
pub mod stability;

#[path = "watch.rs"]
pub mod watch;
