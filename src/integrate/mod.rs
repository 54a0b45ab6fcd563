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
mod multirate;
mod predicted;
mod scheme;
mod scout;
mod stiffness;

pub use scheme::{Scheme, Substeps};
pub use stiffness::{StepWarning, Stiffness};

pub(crate) use context::{MotionRules, StepContext};
pub(crate) use evaluation::{Evaluation, find};
pub(crate) use fault::{Fault, FaultKind};
pub(crate) use free_motion::FreeMotion;
pub(crate) use kick::Redirected;
pub(crate) use kick::warn_of_caps;
pub(crate) use load::{Before, complete};
pub(crate) use motion::{
    FASTEST, Load, MeanVelocity, Motions, SteadyTurn, TurnAfter, VelocityUpdate, kicked,
};

use crate::eval::{Evaluator, Lineariser};

/// Buffers of the stage.
#[derive(Default)]
pub(crate) struct Integrator {
    pub(crate) evaluator: Evaluator,
    lineariser: Lineariser,
    scout: scout::Scout,
    multirate: multirate::Multirate,
    motions: predicted::PredictedMotions,
    candidates: Vec<usize>,
}
