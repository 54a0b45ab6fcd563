//! Small worlds of known outcome.

mod dimer;
mod impacts;
mod spring;

pub use dimer::{Dimer, DimerStart};
pub use impacts::{Impact, Impacts};
pub use spring::Spring;

use super::fields;
use super::{Effort, Method, Run, StudyError};

/// A small world of known outcome.
pub trait Case {
    /// The name in tables and files.
    fn name(&self) -> &'static str;

    /// The unit of simulated time.
    fn time_unit(&self) -> &'static str;

    /// The methods that can move it.
    fn methods(&self) -> &'static [Method];

    /// Time steps to study it at, each half of the one before.
    fn time_steps(&self) -> Vec<f64>;

    /// Runs it with one method at one time step, times it, and measures the errors.
    ///
    /// # Errors
    /// The method is none of [its own](Self::methods), or the step does not divide its time.
    fn run(&self, method: Method, dt: f64, effort: Effort) -> Result<Run, StudyError>;
}

/// `first`, and so on, each half of the one before.
fn halvings(first: f64, count: usize) -> Vec<f64> {
    let next = |dt: &f64| Some(0.5 * dt);
    std::iter::successors(Some(first), next)
        .take(count)
        .collect()
}

/// How many steps of `dt` the time of a case takes.
fn whole_steps(case: &'static str, simulated: f64, dt: f64) -> Result<u64, StudyError> {
    let steps = (simulated / dt).round();
    if dt > 0.0 && steps >= 1.0 && (steps * dt / simulated - 1.0).abs() < 1e-9 {
        Ok(steps as u64)
    } else {
        Err(StudyError::TimeStep {
            case,
            dt,
            simulated,
        })
    }
}

/// An error; infinite if it is not a number.
fn finite_or_infinite(error: f64) -> f64 {
    if error.is_nan() { f64::INFINITY } else { error }
}
