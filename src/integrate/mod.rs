//! Integrate: wrenches become what each body is to do. Knows bodies as copies, and none of Rapier's
//! sets.

mod evaluation;
mod fault;
mod implicit;
mod jacobian;
mod kick;
mod mean_velocity;
mod monitor;
mod motion;
mod multirate;
mod predicted;
mod scheme;
mod stiffness;

pub use scheme::{Scheme, Substeps};
pub use stiffness::{StepWarning, Stiffness};

pub(crate) use evaluation::{Evaluation, find};
pub(crate) use fault::{Fault, FaultKind};
pub(crate) use kick::warn_of_caps;
pub(crate) use motion::{FASTEST, MeanVelocity, Motions, SteadyTurn, TurnAfter, VelocityUpdate};

use crate::compile::Compiled;
use crate::eval::{Evaluator, Lineariser};
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::rigid::{Body, Lookup};
use crate::sample::{Moment, Samples};

/// What a stage of a step is given.
pub(crate) struct StepContext<'a, W> {
    pub compiled: &'a Compiled,
    /// Where anchors are looked up.
    pub world: &'a W,
    pub samples: &'a Samples,
    /// As the samples have them.
    pub bodies: &'a [Body],
    pub time: f64,
    pub dt: Real,
    pub rules: MotionRules<'a>,
}

/// How bodies move, apart from fields.
#[derive(Clone, Copy)]
pub(crate) struct MotionRules<'a> {
    pub scheme: Scheme,
    /// Whether every body that turns freely is turned by this crate, even one like a ball and
    /// even where no field can turn it: swept detection must know how.
    pub exact_turns: bool,
    /// Solver iterations of Rapier's step, over which it integrates a rotation.
    pub iterations: u32,
    /// What Rapier adds of its own.
    pub gravity: Vector,
    /// The speed that Rapier cuts others down to.
    pub max_speed: Real,
    /// Links of multibodies, in the order of their handles: they ignore impulses.
    pub links: &'a [RigidBodyHandle],
}

impl<W: Lookup> StepContext<'_, W> {
    fn moment(&self) -> Moment {
        Moment {
            time: self.time,
            // In a step of no length no force acts; that of a change of velocity is to be finite.
            dt: if self.dt == 0.0 { 1.0 } else { self.dt },
        }
    }

    /// Whether bodies of unequal inertia are turned by this crate in the step.
    fn turns(&self) -> bool {
        (self.compiled.plan.torque_possible || self.rules.exact_turns) && self.dt > 0.0
    }
}

/// Buffers of the stage.
#[derive(Default)]
pub(crate) struct Integrator {
    pub(crate) evaluator: Evaluator,
    lineariser: Lineariser,
    /// Where bodies would be after a step.
    scout: Evaluator,
    scouted: Samples,
    /// One per group of bodies of the multirate integrator.
    multirate: Vec<multirate::Evaluators>,
    motions: predicted::PredictedMotions,
    candidates: Vec<usize>,
}
