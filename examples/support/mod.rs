//! Shared by the examples: arguments, errors and a progress bar. All else is in `lab/`.

#![allow(dead_code, reason = "each example uses a part")]

pub mod args;

use std::fmt;
use std::process::ExitCode;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
#[allow(unused_imports, reason = "each example uses a part")]
pub use rapier3d_fields_lab::{AnyError, make_folder_of};

/// The exit code of `main`. An error is printed by `Display`, not by `Debug`.
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
        // An error here is no reason to stop.
        let _ = write!(out, "{:.0}/s", state.per_sec());
    });
    let bar = ProgressBar::new(steps as u64);
    bar.set_style(style);
    bar
}
