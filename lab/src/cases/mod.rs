//! Small worlds of known outcome, to be moved by any [`Method`].

mod about;
mod answer;
mod billiard;
mod digits;
mod file;
mod heap;
mod impacts;
mod leave_out;
mod motion;
mod real_time;
mod rest;
mod simulation;

pub use about::About;
pub use billiard::{HardSpheres, LongGas};
pub use digits::Galperin;
pub use file::Filed;
pub use heap::Heap;
pub use impacts::{Impact, Impacts};
pub use leave_out::leave_out;
pub use motion::*;
pub use real_time::{SCENES, ceiling};
pub use rest::{Bounce, Slope, Stack};
pub use simulation::Simulation;

use super::{fields, files};
use crate::study::{Measured, Method, Run, StudyError, Timing};

/// Bits of the floating-point numbers of this build: 32 or 64.
pub const PRECISION: u32 = 8 * size_of::<fields::math::Real>() as u32;

/// A small world of known outcome.
pub trait Case {
    /// Its description, and how it is measured.
    fn about(&self) -> About;

    /// The methods that can move it.
    fn methods(&self) -> &'static [Method];

    /// Whether it is cheap enough for a quick study.
    fn is_quick(&self) -> bool {
        true
    }

    /// The worlds at their start. Each is to make [`steps`](Self::steps) steps.
    ///
    /// # Errors
    /// The method is not one of [`methods`](Self::methods), or `dt` does not divide the duration.
    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError>;

    /// Runs the case and measures its errors. The run is not timed: [`study`] does that.
    ///
    /// # Errors
    /// As for [`set_up`](Self::set_up).
    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError>;

    /// Number of steps of `dt` in the duration.
    ///
    /// # Errors
    /// `dt` does not divide the duration.
    fn steps(&self, dt: f64) -> Result<u64, StudyError> {
        let about = self.about();
        let (case, simulated) = (about.name, about.duration);
        let steps = (simulated / dt).round();
        if dt > 0.0 && steps >= 1.0 && (steps * dt / simulated - 1.0).abs() < 1e-9 {
            return Ok(steps as u64);
        }
        Err(StudyError::TimeStep {
            case,
            dt,
            simulated,
        })
    }
}

/// All cases.
pub fn all() -> Vec<Box<dyn Case>> {
    let mut cases: Vec<Box<dyn Case>> = Vec::new();
    for motion in Motion::all() {
        cases.push(Box::new(motion));
    }
    cases.push(Box::new(Impacts::reference()));
    for gas in HardSpheres::all() {
        cases.push(Box::new(gas));
    }
    cases.push(Box::new(Bounce::ELASTIC));
    cases.push(Box::new(Bounce::LOSSY));
    cases.push(Box::new(Stack));
    cases.push(Box::new(Slope));
    cases.push(Box::new(Galperin));
    cases.push(Box::new(Heap));
    cases.push(Box::new(LongGas::dense()));
    for scene in Filed::all() {
        cases.push(Box::new(scene));
    }
    for crowd in Crowd::all() {
        cases.push(Box::new(crowd));
    }
    cases
}

/// The effort of timing a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Minimum number of rounds. A round times every run of the plan once.
    pub rounds: usize,
    /// Seconds for all rounds of a case: more rounds are made until they have passed.
    pub seconds: f64,
    /// Maximum number of rounds.
    pub most: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Effort {
            rounds: 5,
            seconds: 2.0,
            most: 50,
        }
    }
}

/// Runs a case with each method and time step of `plan`, and times all of them in rounds, so that other load of the
/// machine affects all methods alike. Calls `tick` after each measured run.
///
/// # Errors
/// The first error of a run of the plan.
pub fn study(
    case: &dyn Case,
    plan: &[(Method, f64)],
    effort: Effort,
    mut tick: impl FnMut(),
) -> Result<Vec<Run>, StudyError> {
    let mut runs = Vec::new();
    for (method, dt) in plan {
        runs.push(case.run(*method, *dt)?);
        tick();
    }
    let mut times = vec![Vec::new(); plan.len()];
    let mut total = 0.0;
    for round in 0..effort.most {
        if round >= effort.rounds && total >= effort.seconds {
            break;
        }
        for turn in 0..plan.len() {
            let which = (turn + round) % plan.len();
            let (method, dt) = plan[which];
            let taken = simulation::seconds(case.set_up(method, dt)?, case.steps(dt)?);
            times[which].push(taken);
            total += taken;
        }
    }
    for (run, times) in runs.iter_mut().zip(times) {
        run.timing = Timing::of(times);
    }
    Ok(runs)
}

/// A measured run without timing.
fn run(
    about: &About,
    (method, dt): (Method, f64),
    (steps, warned): (u64, u64),
    evaluations: u64,
    errors: Vec<Measured>,
) -> Run {
    Run {
        case: about.name.clone(),
        method,
        precision: PRECISION,
        dt,
        steps,
        simulated: steps as f64 * dt,
        evaluations,
        warned,
        errors,
        timing: Timing::default(),
    }
}

impl From<fields::BuildError> for StudyError {
    fn from(error: fields::BuildError) -> Self {
        StudyError::Fields(error.to_string())
    }
}

impl From<files::FileError> for StudyError {
    fn from(error: files::FileError) -> Self {
        StudyError::Fields(error.to_string())
    }
}

impl From<fields::PropertyError> for StudyError {
    fn from(error: fields::PropertyError) -> Self {
        StudyError::Fields(error.to_string())
    }
}

/// The scheme of a method; `None` for methods without fields or for contacts.
fn scheme(method: Method) -> Option<fields::Scheme> {
    use fields::Scheme;
    Some(match method {
        Method::KickDriftKick | Method::KickDriftKickOnce => Scheme::KickDriftKick,
        Method::Kick => Scheme::Kick,
        Method::ExternalForce => Scheme::ExternalForce,
        Method::Substep4 => Scheme::substeps(4),
        Method::Forward4 => Scheme::Forward4,
        Method::LinearlyImplicit => Scheme::LinearlyImplicit,
        Method::Auto => Scheme::auto(1e-2),
        Method::AutoTight => Scheme::auto(1e-4),
        _ => return None,
    })
}
