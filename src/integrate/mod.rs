//! Integrate: wrenches become what each body is to do. Knows bodies as copies, and none of Rapier's
//! sets.

mod context;
mod evaluation;
mod exponential;
mod fault;
mod free_motion;
mod implicit;
mod jacobian;
mod kick;
mod load;
mod mean_velocity;
mod monitor;
mod motion;
mod pace;
mod plan;
mod predicted;
mod redo;
mod resolve;
mod scheme;
mod scout;
mod stiffness;
mod substeps;

pub use fault::FaultPolicy;
pub use scheme::{Scheme, Substeps};
pub use stiffness::{StepWarning, Stiffness};

pub(crate) use context::{MotionRules, StepContext};
pub(crate) use evaluation::{Evaluation, find};
pub(crate) use fault::{Fault, FaultKind, Sift};
pub(crate) use free_motion::FreeMotion;
pub(crate) use kick::Redirected;
pub(crate) use kick::warn_of_caps;
pub(crate) use load::{Before, complete};
pub(crate) use motion::{
    FASTEST, Load, MeanVelocity, Motions, SteadyTurn, TurnAfter, VelocityUpdate, kicked,
};
pub(crate) use redo::Redone;

use crate::eval::{Evaluator, Lineariser};

/// Buffers of the stage.
#[derive(Default)]
pub(crate) struct Integrator {
    pub(crate) evaluator: Evaluator,
    lineariser: Lineariser,
    scout: scout::Scout,
    substeps: substeps::SubstepIntegrator,
    /// Bodies that are moved together.
    alike: Vec<motion::Start>,
    /// What others are given meanwhile.
    others: Vec<VelocityUpdate>,
    motions: predicted::PredictedMotions,
    candidates: Vec<usize>,
}
