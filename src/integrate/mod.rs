//! Integrate: wrenches become what each body is to do. Knows bodies as copies, and none of Rapier's
//! sets.

mod context;
mod coupling;
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
mod particles;
mod plan;
mod predicted;
mod reaction;
mod redo;
mod resolve;
mod scheme;
mod scout;
mod secant;
mod stability;
mod stiffness;
mod substeps;
mod watch;

pub use fault::FaultPolicy;
pub use scheme::{Scheme, Substeps};
pub use stiffness::{StepWarning, Stiffness};

pub(crate) use context::{MotionRules, StepContext};
pub(crate) use coupling::Coupling;
pub(crate) use evaluation::Evaluation;
pub(crate) use fault::{Fault, FaultKind, Sift};
pub(crate) use free_motion::FreeMotion;
pub(crate) use kick::{Deflection, Redirected};
pub(crate) use load::{Before, complete, complete_slowed};
pub(crate) use motion::{Arrived, FASTEST, Load, Motions, TurnAfter, VelocityUpdate, kicked};
pub(crate) use particles::{Durations, ParticleMotion, ParticleState, Particles};
pub(crate) use reaction::Reactions;
pub(crate) use redo::Redone;
pub(crate) use watch::{Caps, stiff_from, warn_of_caps, warn_of_springs};

use crate::eval::{BodySlowings, Evaluator, Lineariser};
use crate::math::RigidBodyHandle;

/// Buffers of the stage.
#[derive(Default)]
pub(crate) struct Integrator {
    pub(crate) evaluator: Evaluator,
    lineariser: Lineariser,
    /// How drag and wind slow the bodies, as they were last evaluated.
    slowings: BodySlowings,
    scout: scout::Scout,
    substeps: substeps::SubstepIntegrator,
    /// Bodies that are moved together.
    alike: Vec<motion::Start>,
    /// What others are given meanwhile.
    others: Vec<VelocityUpdate>,
    motions: predicted::PredictedMotions,
    candidates: Vec<usize>,
    /// Who swings the fastest along its way within the step, and the square of the frequency, if that is
    /// too fast for a scheme that does not choose.
    fastest: Option<(RigidBodyHandle, f64)>,
    /// The largest error that bodies were moved with in the step, by a scheme that chooses.
    pub(crate) reached: f64,
}
