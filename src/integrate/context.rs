//! What the stage is given for a step.

use super::fault::{FaultPolicy, Sift};
use super::plan::Choice;
use super::reaction::Reactions;
use super::scheme::Scheme;
use crate::compile::Compiled;
use crate::field::{Anchor, Span};
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::rigid::{Body, BodySet, Lookup};
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
    /// The step that is worked out, or the moment alone.
    pub span: Span,
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
    /// Bodies that Rapier's solver holds, by contacts or joints.
    pub held: &'a BodySet,
    /// What else moves those of them whose forces read velocities.
    pub reactions: Option<&'a Reactions>,
    pub on_fault: FaultPolicy,
    /// To be given if what is not finite is left out.
    pub sift: Option<Sift<'a>>,
}

impl<W: Lookup> StepContext<'_, W> {
    pub(super) fn moment(&self) -> Moment {
        Moment {
            time: self.time,
            // In a step of no length no force acts; that of a change of velocity is to be finite.
            dt: if self.dt == 0.0 { 1.0 } else { self.dt },
            span: self.span,
        }
    }

    /// Whether bodies of unequal inertia are turned by this crate in the step.
    pub(super) fn turns(&self) -> bool {
        (self.compiled.torque_possible || self.rules.exact_turns) && self.dt > 0.0
    }

    /// How the scheme chooses, if it does. Where forces read velocities, drag would undo a step back in
    /// time.
    pub(super) fn choice(&self) -> Option<Choice> {
        let choice = self.rules.scheme.choice()?;
        let composes = choice.composes && !self.compiled.reads_velocity;
        Some(Choice { composes, ..choice })
    }

    /// Whether bodies move fields that other bodies feel: those are to be moved together.
    pub(super) fn is_coupled(&self) -> bool {
        let mut moving = self.compiled.anchors.moving();
        moving.any(|(_, anchor)| {
            let carrier = match anchor {
                Anchor::World { .. } => None,
                Anchor::Body { handle, .. } => Some(*handle),
                Anchor::Collider { handle, .. } => self
                    .world
                    .collider(*handle)
                    .and_then(|collider| collider.parent()),
            };
            let body = carrier.and_then(|carrier| self.world.body(carrier));
            body.is_some_and(|body| body.is_dynamic())
        })
    }
}
