//! In 32-bit precision, on top of `rapier3d-fields`.

pub use rapier3d_fields as fields;

pub use crate::random;

#[path = "scenes/mod.rs"]
pub mod scenes;

#[path = "study/mod.rs"]
pub mod study;

#[path = "watch.rs"]
pub mod watch;

#[allow(missing_docs, reason = "of this repository only, and the names say it")]
#[path = "rivals/mod.rs"]
pub mod rivals;
