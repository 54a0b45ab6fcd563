//! Shared by the examples, tests and benchmarks of `rapier3d-fields`: ready-made worlds, the measurement of error
//! against run time, hand-written code to compare with (`rivals`), and drawing.
//!
//! Code that depends on Rapier is compiled twice from the same files: as [`single`] with `rapier3d-fields` and as
//! [`double`] with `rapier3d-fields-f64`, so that one program can run both.

#![forbid(unsafe_code)]
#![deny(rustdoc::broken_intra_doc_links)]

use std::error::Error;
use std::path::Path;

pub mod random;

#[allow(missing_docs, reason = "of this repository only, and the names say it")]
pub mod record;

pub mod replay;

pub mod study;

pub mod xyz;

#[allow(missing_docs, reason = "of this repository only, and the names say it")]
pub mod drawing;

pub mod single;

#[allow(
    clippy::duplicate_mod,
    reason = "the same files as in `single`, on top of the other crate"
)]
pub mod double;

/// Any error that ends a program.
pub type AnyError = Box<dyn Error + Send + Sync>;

/// Creates the folder of `file`, with its parents, if it does not exist.
///
/// # Errors
/// The folder cannot be created.
pub fn make_folder_of(file: &Path) -> Result<(), AnyError> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)
            .map_err(|error| format!("cannot make the folder {}: {error}", folder.display()))?;
    }
    Ok(())
}
