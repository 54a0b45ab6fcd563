//! What the examples share: arguments, bookkeeping, trajectory and pictures.

#![allow(dead_code, reason = "each example uses a part")]

pub mod args;
pub mod arrows;
pub mod picture;
pub mod plot;
pub mod projection;
pub mod record;
pub mod xyz;

use std::error::Error;
use std::fmt;
use std::path::Path;
use std::process::ExitCode;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

/// Whatever stops an example.
pub type AnyError = Box<dyn Error + Send + Sync>;

/// The end of `main`: an error is printed as a sentence, not as `Debug` would have it.
pub fn exit(result: Result<(), AnyError>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// A bar over `steps` with rate and time to go; invisible when the output is not a terminal.
pub fn progress_bar(steps: usize) -> ProgressBar {
    let style = ProgressStyle::with_template(
        "{bar:40.cyan/blue} {pos}/{len} steps, {rate}, {eta} to go  {msg}",
    )
    .expect("the template is well-formed")
    .with_key("rate", |state: &ProgressState, out: &mut dyn fmt::Write| {
        // A rate that cannot be written is not worth stopping for.
        let _ = write!(out, "{:.0}/s", state.per_sec());
    });
    let bar = ProgressBar::new(steps as u64);
    bar.set_style(style);
    bar
}

/// Makes the folder that a file is to be written in.
pub fn make_folder_of(file: &Path) -> Result<(), AnyError> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)
            .map_err(|error| format!("cannot make the folder {}: {error}", folder.display()))?;
    }
    Ok(())
}
