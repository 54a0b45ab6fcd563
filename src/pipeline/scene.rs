//! The inputs of both halves of a step: the fields as data, the moment, and the bodies with their samples.

use super::settings::FieldSettings;
use super::state::FieldState;
use crate::bridge::{WorldMut, WorldRef};
use crate::compile::Compiled;
use crate::contact::Detection;
use crate::field::{FieldSet, Span};
use crate::integrate::{Caps, MotionRules, StepContext};
use crate::math::{Real, RigidBodyHandle};
use crate::rapier::dynamics::IntegrationParameters;
use crate::rigid::{Body, BodySet};
use crate::sample::{Moment, Samples};

/// The fields of a step, as data.
#[derive(Clone, Copy)]
pub(crate) struct Definition<'a> {
    pub set: &'a FieldSet,
    pub settings: &'a FieldSettings,
}

impl Definition<'_> {
    /// Returns true if fields or properties were edited since the last step.
    pub(super) fn are_new(&self, state: &FieldState) -> bool {
        state.mark != Some(self.set.mark())
    }
}

/// A moment of a step.
#[derive(Clone, Copy)]
pub(super) struct Now {
    pub time: f64,
    pub dt: Real,
    /// The span of the whole step.
    pub span: Span,
}

impl Now {
    /// The start of a step.
    pub(super) fn first(time: f64, dt: Real) -> Self {
        let span = Span::step(time, dt);
        Now { time, dt, span }
    }

    /// The end of a step that began at a time.
    pub(super) fn last(began: f64, dt: Real) -> Self {
        let span = Span::step(began, dt);
        let time = span.end;
        Now { time, dt, span }
    }

    pub(super) fn moment(self) -> Moment {
        Moment {
            span: self.span,
            ..moment(self.time, self.dt)
        }
    }
}

/// The compiled fields and the bodies on which they act, in the present half of a step.
#[derive(Default)]
pub(super) struct StepScene {
    pub compiled: Compiled,
    /// The bodies that are sampled, as they are.
    pub bodies: Vec<Body>,
    pub samples: Samples,
    /// The links of multibodies, in the order of their handles.
    pub links: Vec<RigidBodyHandle>,
    /// Bodies that Rapier's solver holds.
    pub held: BodySet,
}

impl StepScene {
    /// The inputs of the integrator; `view` is of the same world.
    pub(super) fn context<'a>(
        &'a self,
        fields: &Definition<'_>,
        world: &WorldMut<'_>,
        view: &'a WorldRef<'a>,
        now: Now,
    ) -> StepContext<'a, WorldRef<'a>> {
        StepContext {
            compiled: &self.compiled,
            world: view,
            samples: &self.samples,
            bodies: &self.bodies,
            time: now.time,
            dt: now.dt,
            span: now.span,
            rules: self.rules(fields, world),
        }
    }

    /// The rules of motion, without those of the present half of a step.
    pub(super) fn rules(&self, fields: &Definition<'_>, world: &WorldMut<'_>) -> MotionRules<'_> {
        let parameters = world.integration_parameters;
        MotionRules {
            scheme: fields.settings.scheme,
            max_substeps: fields.settings.max_substeps,
            exact_turns: self.exact_turns(fields),
            iterations: iterations(parameters),
            gravity: world.gravity,
            caps: Caps::new(parameters),
            links: &self.links,
            held: &self.held,
            reactions: None,
            on_fault: fields.settings.on_fault,
            drop_non_finite: None,
        }
    }

    /// Returns true if swept detection needs the rotation of each body.
    pub(super) fn exact_turns(&self, fields: &Definition<'_>) -> bool {
        fields.settings.detection == Detection::Swept && !self.compiled.detectors.is_empty()
    }
}

/// A moment by itself, for a step of length `dt`. In a step of zero length no force acts, but a field that is a change
/// of velocity must give a finite force.
pub(super) fn moment(time: f64, dt: Real) -> Moment {
    Moment {
        time,
        dt: if dt == 0.0 { 1.0 } else { dt },
        span: Span::at(time),
    }
}

/// The number of solver iterations in Rapier's step.
pub(super) fn iterations(parameters: &IntegrationParameters) -> u32 {
    u32::try_from(parameters.num_solver_iterations).unwrap_or(u32::MAX)
}
