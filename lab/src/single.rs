//! In 32-bit precision, on top of `rapier3d-fields`.

pub use rapier3d_fields as fields;

pub use crate::random;

use rapier3d_fields_scene::single as files;

#[path = "scenes/mod.rs"]
pub mod scenes;

#[path = "cases/mod.rs"]
pub mod cases;

#[allow(missing_docs, reason = "of this repository only, and the names say it")]
#[path = "stability/mod.rs"]
pub mod stability;

#[path = "watch.rs"]
pub mod watch;

#[allow(missing_docs, reason = "of this repository only, and the names say it")]
#[path = "rivals/mod.rs"]
pub mod rivals;
