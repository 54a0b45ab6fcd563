//! The inputs of the integration stage for a step.

use super::caps::Caps;
use super::fault::{DropNonFinite, FaultPolicy};
use super::plan::PlanRules;
use super::reaction::Reactions;
use super::scheme::Scheme;
use crate::compile::Compiled;
use crate::eval::SampledWorld;
use crate::field::{Anchor, Span};
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::rigid::{Body, BodySet, Lookup};
use crate::sample::{Moment, Samples};

/// The inputs of the integration stage: the compiled fields, the samples, copies of the bodies, and the rules of
/// motion.
pub(crate) struct StepContext<'a, W> {
    pub compiled: &'a Compiled,
    /// The world in which anchors are looked up.
    pub world: &'a W,
    pub samples: &'a Samples,
    /// In the order of the samples' bodies.
    pub bodies: &'a [Body],
    pub time: f64,
    pub dt: Real,
    /// The span of the step, or the moment alone.
    pub span: Span,
    pub rules: MotionRules<'a>,
}

/// The rules by which bodies move, apart from the fields.
#[derive(Clone, Copy)]
pub(crate) struct MotionRules<'a> {
    pub scheme: Scheme,
    /// The most substeps that the scheme may choose.
    pub max_substeps: u32,
    /// True if all bodies that rotate freely are rotated by this crate, even balls, and even if no field can turn them,
    /// because swept detection needs the rotation.
    pub exact_turns: bool,
    /// Solver iterations of Rapier's step, over which it integrates a rotation.
    pub iterations: u32,
    /// The gravity of Rapier's step.
    pub gravity: Vector,
    pub caps: Caps,
    /// Links of multibodies, in the order of their handles: they ignore impulses.
    pub links: &'a [RigidBodyHandle],
    /// Bodies that Rapier's solver holds, by contacts or joints.
    pub held: &'a BodySet,
    /// The accelerations of held bodies by gravity, contacts and joints, where forces read velocities.
    pub reactions: Option<&'a Reactions>,
    pub on_fault: FaultPolicy,
    /// Set if contributions that are not finite are to be left out.
    pub drop_non_finite: Option<DropNonFinite<'a>>,
}

impl<W: Lookup> StepContext<'_, W> {
    pub(super) fn moment(&self) -> Moment {
        Moment {
            time: self.time,
            // In a step of no length no force acts, but a change of velocity must give a finite force.
            dt: if self.dt == 0.0 { 1.0 } else { self.dt },
            span: self.span,
        }
    }

    /// The samples in a world of these frames.
    pub(super) fn sampled<'b, F>(&'b self, frames: &'b F) -> SampledWorld<'b, F> {
        SampledWorld::new(self.compiled, frames, self.samples, self.moment())
    }

    /// Returns true if bodies of unequal inertia are rotated by this crate in the step.
    pub(super) fn turns(&self) -> bool {
        (self.compiled.torque_possible || self.rules.exact_turns) && self.dt > 0.0
    }

    /// The rules by which the scheme chooses a plan for each body; `None` if it does not choose. Steps of
    /// fourth order are off if forces read velocities.
    pub(super) fn plan_rules(&self) -> Option<PlanRules> {
        let plan_rules = self.rules.scheme.plan_rules()?;
        let is_fourth = plan_rules.is_fourth && !self.compiled.reads_velocity;
        Some(PlanRules {
            is_fourth,
            most: plan_rules.most.min(self.rules.max_substeps),
            ..plan_rules
        })
    }

    /// Returns true if fields are anchored to dynamic bodies, so that bodies that act on each other must be moved
    /// together.
    pub(super) fn is_coupled(&self) -> bool {
        let mut moving = self.compiled.anchors.moving();
        moving.any(|(_, anchor)| self.is_on_dynamic(anchor))
    }

    /// Returns true if all fields are anchored to dynamic bodies.
    pub(super) fn is_closed(&self) -> bool {
        let anchors = &self.compiled.anchors;
        let on_dynamic = anchors.moving().filter(|it| self.is_on_dynamic(it.1));
        on_dynamic.count() == anchors.count()
    }

    fn is_on_dynamic(&self, anchor: &Anchor) -> bool {
        let carrier = anchor.carrier(|handle| self.world.collider(handle));
        let body = carrier.and_then(|carrier| self.world.body(carrier));
        body.is_some_and(|body| body.is_dynamic())
    }
}
