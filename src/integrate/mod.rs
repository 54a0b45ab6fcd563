//! Integration: turns the wrenches on bodies into new velocities and loads, by the scheme. It works on copies of bodies
//! and on none of Rapier's sets.

mod balance;
mod begun;
mod caps;
mod context;
mod couple;
mod coupling;
mod drift;
mod edges;
mod evaluation;
mod exponential;
mod fault;
mod follow;
mod free_motion;
mod halves;
mod implicit;
mod jacobian;
mod kick;
mod load;
mod lookahead;
mod mean_velocity;
mod method;
mod monitor;
mod motion;
mod particles;
mod plan;
mod predicted;
mod rate_estimate;
mod reaction;
mod resolve;
mod retry;
mod scheme;
mod secant;
mod spins;
mod stability;
mod stiffness;
mod substeps;
mod warn;

pub use fault::FaultPolicy;
pub(crate) use scheme::MOST_AUTO;
pub use scheme::{Scheme, Substeps};
pub use stiffness::{StepWarning, Stiffness};

pub(crate) use begun::BegunStep;
pub(crate) use caps::Caps;
pub(crate) use context::{MotionRules, StepContext};
pub(crate) use coupling::LinearisedWrench;
pub(crate) use edges::{Edges, ForceChange};
pub(crate) use evaluation::{Evaluation, first_unsound};
pub(crate) use fault::{DropNonFinite, Fault, FaultKind};
pub(crate) use free_motion::{FreeMotion, FreeMotions};
pub(crate) use kick::Kick;
pub(crate) use load::Before;
pub(crate) use method::Method;
pub(crate) use motion::{
    Arrived, Completion, FASTEST, Load, Motions, TurnAfter, VelocityUpdate, kicked,
};
pub(crate) use particles::{Durations, ParticleMotion, ParticleState, Particles};
pub(crate) use reaction::{Loaded, Reactions};
pub(crate) use retry::Retried;
pub(crate) use spins::{SpinRules, Spins};
pub(crate) use warn::{stiff_from, warn_of_caps, warn_of_springs};

use crate::eval::{BodySlowings, Evaluator, Lineariser};
use crate::math::RigidBodyHandle;

/// The evaluators and buffers of the stage.
#[derive(Default)]
pub(crate) struct Integrator {
    pub(crate) evaluator: Evaluator,
    pub(crate) spins: Spins,
    lineariser: Lineariser,
    /// The slopes of drag and wind on the bodies, from the last evaluation.
    slowings: BodySlowings,
    lookahead: lookahead::Lookahead,
    drifts: drift::Drifts,
    substeps: substeps::SubstepIntegrator,
    /// A buffer: bodies of the same plan, which are moved together.
    alike: Vec<motion::Start>,
    /// A buffer: the new velocities of the other bodies.
    others: Vec<VelocityUpdate>,
    motions: predicted::PredictedMotions,
    candidates: Vec<usize>,
    /// Bodies that were moved in the step, whose force has changed much.
    passages: Vec<substeps::Passage>,
    /// The body with the highest frequency along its path within the step, and the square of this frequency, if it is
    /// too high for a scheme that does not choose.
    fastest: Option<(RigidBodyHandle, f64)>,
    /// The largest error with which a scheme that chooses has moved bodies in the step.
    pub(crate) reached: f64,
}
