//! Error against run time: what accuracy a method gives for the time it takes.
//!
//! A [`Case`] is a small world of known outcome; a [`Method`] moves it in steps of some length; a
//! [`Run`] says how far off it ended and how long it took. [`compare()`] sets the runs of
//! different methods side by side, at equal error: speed at unequal errors says nothing. Runs
//! that came to nothing are kept, and [say so](Run::diverged).
//!
//! ```
//! use rapier3d_fields_lab::single::study::{Case, Effort, Method, Metric, Spring};
//! let effort = Effort { warm_ups: 0, repeats: 1, seconds: 0.0 };
//! let error = |method| {
//!     let run = Spring.run(method, 1.0 / 64.0, effort)?;
//!     Ok::<_, rapier3d_fields_lab::single::study::StudyError>(run.error(Metric::FinalState).unwrap())
//! };
//! assert!(error(Method::KickDriftKick)? < 0.1 * error(Method::AddForceLoop)?);
//! # Ok::<(), rapier3d_fields_lab::single::study::StudyError>(())
//! ```

mod cases;
mod compare;
mod measure;
mod report;
mod table;

pub use cases::{Case, Dimer, DimerStart, Impact, Impacts, Spring};
pub use compare::{OrderFit, Verdict, compare, fit_order, time_at_error};
pub use measure::{Effort, Timing};
pub use report::{from_csv, to_csv, to_table};
pub use table::{Row, Table};

use super::fields;
use fields::math::Real;
use fields::{BuildError, Scheme, StepError};

/// Bits of the numbers that worlds of this build compute with: 32 or 64.
pub const PRECISION: u32 = 8 * size_of::<Real>() as u32;

/// A way to move a world with forces or contacts in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Method {
    /// [`Scheme::KickDriftKick`].
    KickDriftKick,
    /// [`Scheme::Kick`].
    Kick,
    /// [`Scheme::ExternalForce`].
    ExternalForce,
    /// What one writes without this crate: `reset_forces`, `add_force` and `add_torque` once per
    /// step, with a force worked out by hand, all else at Rapier's defaults.
    AddForceLoop,
    /// Detection fields that answer by [`ContactLaw::Impulse`](fields::ContactLaw::Impulse).
    ImpulseLaw,
    /// Detection fields that answer by [`ContactLaw::Paper`](fields::ContactLaw::Paper).
    PaperLaw,
    /// Rapier's own contact solver.
    RapierContacts,
}

impl Method {
    /// All methods.
    pub const ALL: [Method; 7] = [
        Method::KickDriftKick,
        Method::Kick,
        Method::ExternalForce,
        Method::AddForceLoop,
        Method::ImpulseLaw,
        Method::PaperLaw,
        Method::RapierContacts,
    ];

    /// The methods that carry forces.
    pub const FORCES: [Method; 4] = [
        Method::KickDriftKick,
        Method::Kick,
        Method::ExternalForce,
        Method::AddForceLoop,
    ];

    /// The methods that answer contacts.
    pub const CONTACTS: [Method; 3] =
        [Method::ImpulseLaw, Method::PaperLaw, Method::RapierContacts];

    /// The name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Method::KickDriftKick => "KickDriftKick",
            Method::Kick => "Kick",
            Method::ExternalForce => "ExternalForce",
            Method::AddForceLoop => "AddForceLoop",
            Method::ImpulseLaw => "ImpulseLaw",
            Method::PaperLaw => "PaperLaw",
            Method::RapierContacts => "RapierContacts",
        }
    }

    /// The scheme of this crate that the method is, if it is one.
    pub fn scheme(self) -> Option<Scheme> {
        match self {
            Method::KickDriftKick => Some(Scheme::KickDriftKick),
            Method::Kick => Some(Scheme::Kick),
            Method::ExternalForce => Some(Scheme::ExternalForce),
            _ => None,
        }
    }
}

/// What an error is an error of, and in which unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Metric {
    /// Of the state at the end, against the closed form.
    FinalState,
    /// Of the energy, at its worst.
    Energy,
    /// Of the positions of atoms at the end, against the converged trajectory.
    AtomPosition,
    /// Of the velocities after an impact: half of the pairs are better.
    Velocity,
    /// Of the velocities after an impact: 95 % of the pairs are better.
    Velocity95,
    /// Of the velocities after an impact: the worst pair.
    VelocityWorst,
    /// Of the time of an impact: half of the pairs are better.
    ContactTime,
    /// Share of impacts that were not answered.
    Missed,
}

impl Metric {
    /// All metrics.
    pub const ALL: [Metric; 8] = [
        Metric::FinalState,
        Metric::Energy,
        Metric::AtomPosition,
        Metric::Velocity,
        Metric::Velocity95,
        Metric::VelocityWorst,
        Metric::ContactTime,
        Metric::Missed,
    ];

    /// The name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Metric::FinalState => "final state",
            Metric::Energy => "energy",
            Metric::AtomPosition => "atom position",
            Metric::Velocity => "velocity median",
            Metric::Velocity95 => "velocity 95 %",
            Metric::VelocityWorst => "velocity worst",
            Metric::ContactTime => "contact time",
            Metric::Missed => "missed",
        }
    }

    /// How the error is worked out and what it is divided by.
    pub fn definition(self) -> &'static str {
        match self {
            Metric::FinalState => {
                "|(dx / amplitude, dv / (amplitude omega))| at the end, against the closed form"
            }
            Metric::Energy => "largest |E / E(0) - 1| over all steps",
            Metric::AtomPosition => {
                "root mean square distance of the atoms at the end from the reference trajectory, Å"
            }
            Metric::Velocity => {
                "largest |dv| of the two spheres / largest speed before or after, median over pairs"
            }
            Metric::Velocity95 => {
                "largest |dv| of the two spheres / largest speed before or after, 95 % of pairs"
            }
            Metric::VelocityWorst => {
                "largest |dv| of the two spheres / largest speed before or after, worst pair"
            }
            Metric::ContactTime => {
                "|time of the answer - exact time of contact| / flight time, median over pairs; \
                 infinite for a pair that was not answered"
            }
            Metric::Missed => "share of pairs whose velocities never changed",
        }
    }
}

/// An error that was measured; infinite if the run ended in what is not a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// What it is an error of.
    pub metric: Metric,
    /// How large it is, as the metric [defines](Metric::definition) it.
    pub value: f64,
}

/// One case, moved by one method at one time step: how wrong and how slow it was.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// [Name](Case::name) of the case.
    pub case: String,
    /// How it was moved.
    pub method: Method,
    /// [Bits](PRECISION) of the numbers of the world.
    pub precision: u32,
    /// Time step, in the [unit](Case::time_unit) of the case.
    pub dt: f64,
    /// Steps made, summed over all worlds of the case; fewer than planned if a step failed.
    pub steps: u64,
    /// Simulated time, summed over all worlds of the case.
    pub simulated: f64,
    /// Evaluations of the fields on all bodies, counted in a run of its own.
    pub evaluations: u64,
    /// The errors; the first is the one to compare by.
    pub errors: Vec<Measured>,
    /// Time on the clock for all steps, without setting up.
    pub timing: Timing,
}

impl Run {
    /// The error by a metric, if the case has it.
    pub fn error(&self, metric: Metric) -> Option<f64> {
        let measured = self.errors.iter().find(|error| error.metric == metric);
        measured.map(|error| error.value)
    }

    /// Median time on the clock per unit of simulated time, µs.
    pub fn cost(&self) -> f64 {
        1e6 * self.timing.median / self.simulated
    }

    /// Whether the run came to nothing: its first error is as large as the motion itself (the
    /// amplitude, an ångström, the largest speed) or not a number.
    pub fn diverged(&self) -> bool {
        !self.errors.first().is_some_and(|error| error.value < 1.0)
    }
}

/// Why a study could not be made. A step that fails is no such reason: it makes a run that
/// [diverged](Run::diverged).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A case cannot be moved by that method.
    #[error("case `{case}` cannot be moved by {method}")]
    Method {
        /// The case.
        case: &'static str,
        /// Name of the method.
        method: &'static str,
    },
    /// A time step that does not fit into the case.
    #[error("dt is {dt}, must divide the {simulated} of case `{case}`")]
    TimeStep {
        /// The case.
        case: &'static str,
        /// The step.
        dt: f64,
        /// The time to be simulated.
        simulated: f64,
    },
    /// A table lacks a line or a column.
    #[error("the table has no {what}")]
    Missing {
        /// What is not there.
        what: String,
    },
    /// A cell that cannot be read.
    #[error("line {line}, column `{column}`: `{cell}` is no {expected}")]
    Cell {
        /// The line, counted from 1.
        line: usize,
        /// The name of the column.
        column: String,
        /// What it says.
        cell: String,
        /// What it should be.
        expected: &'static str,
    },
    /// The fields of a case were not accepted.
    #[error(transparent)]
    Tree(#[from] BuildError),
    /// The bodies of a case were not accepted.
    #[error(transparent)]
    Step(#[from] StepError),
    /// A property of a collider was refused.
    #[error(transparent)]
    Property(#[from] fields::PropertyError),
}
