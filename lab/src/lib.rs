//! What the examples, tests and benchmarks of `rapier3d-fields` share: ready-made worlds, the
//! measurement of error against run time, hand-written rivals, and drawing.
//!
//! Whatever has to do with Rapier is here twice, from the same files: [`single`] on top of
//! `rapier3d-fields` and [`double`] on top of `rapier3d-fields-f64`, so that one program can run
//! both.

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

/// Whatever stops a program.
pub type AnyError = Box<dyn Error + Send + Sync>;

/// Makes the folder that a file is to be written in.
///
/// # Errors
/// The folder cannot be made.
pub fn make_folder_of(file: &Path) -> Result<(), AnyError> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)
            .map_err(|error| format!("cannot make the folder {}: {error}", folder.display()))?;
    }
    Ok(())
}
