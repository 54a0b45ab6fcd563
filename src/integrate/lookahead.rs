//! The evaluation of the fields at the poses that bodies would have after a step, to find stiffness.

use super::context::StepContext;
use super::predicted::{PredictedMotion, PredictedMotions};
use super::secant::secant;
use crate::eval::{Evaluator, SampledWorld};
use crate::math::{DQuat, Real, Vector, to_dvec3, to_f64};
use crate::rigid::{Lookup, Mobility, Wrench, of_wrench, rounded};
use crate::sample::Samples;

/// A share of a step over which fields are nearly linear, apart from edges.
pub(super) const NEAR: Real = 0.015625;

/// Changes of less than this many rounding errors do not count.
const CERTAIN: Real = 64.0;

/// The wrenches at the predicted poses of bodies; its buffers are reused.
#[derive(Default)]
pub(super) struct Lookahead {
    share: Real,
    evaluator: Evaluator,
    samples: Samples,
    ways: Vec<Way>,
    wrenches: Vec<Wrench>,
}

/// The velocities with which a body would move to its predicted pose.
#[derive(Default)]
struct Way {
    linvel: Vector,
    angvel: Vector,
}

impl Lookahead {
    /// Evaluates the fields at the poses to which bodies would move in a share of the step, with the velocities that
    /// the wrenches `here` would give them over the whole step.
    pub(super) fn look(
        &mut self,
        motions: &mut PredictedMotions,
        context: &StepContext<'_, impl Lookup>,
        here: &[Wrench],
        share: Real,
    ) {
        let dt = context.dt;
        let part = share * dt;
        self.share = share;
        motions.clear();
        self.ways.clear();
        for (body, wrench) in context.bodies.iter().zip(here) {
            if body.sleeping {
                self.ways.push(Way::default());
                continue;
            }
            let change = Mobility::of(body).apply(&of_wrench(*wrench)) * to_f64(dt);
            let (linear, angular) = rounded(&change);
            let (linvel, angvel) = (body.linvel + linear, body.angvel + angular);
            self.ways.push(Way { linvel, angvel });
            motions.assign(body.handle, PredictedMotion::CoastsAt { linvel, angvel });
        }
        let samples = &mut self.samples;
        samples.clone_from(context.samples);
        for sample in &mut samples.sites {
            let way = &self.ways[sample.body as usize];
            let turned = sample.arm + way.angvel.cross(sample.arm) * part;
            sample.world_point += way.linvel * part + turned - sample.arm;
            sample.arm = turned;
        }
        for (attitude, way) in samples.attitudes.iter_mut().zip(&self.ways) {
            let turned = DQuat::from_scaled_axis(to_dvec3(way.angvel) * to_f64(part));
            attitude.rotation = turned * attitude.rotation;
        }
        for (centre, way) in samples.centres.iter_mut().zip(&self.ways) {
            centre.world_point += way.linvel * part;
        }
        let frames = motions.frames(context, &[], to_f64(part));
        let scene = SampledWorld::new(context.compiled, &frames, samples, context.moment());
        self.evaluator.wrenches(&scene, &mut self.wrenches, None);
    }

    /// (dt·ω)² of a body by the change of its wrench, which is `here` at the start; zero if the change may be rounding.
    pub(super) fn shown(
        &self,
        context: &StepContext<'_, impl Lookup>,
        place: usize,
        here: Wrench,
    ) -> Real {
        let (there, way) = (self.wrenches[place], &self.ways[place]);
        let (body, part) = (&context.bodies[place], self.share * context.dt);
        let rounding = CERTAIN * Real::EPSILON;
        let grew = |one: Vector, other: Vector| {
            (one - other).length() > rounding * (one.length() + other.length())
        };
        let went = |speed: Vector, from: Vector| speed.length() * part > rounding * from.length();
        let moved = went(way.linvel, body.world_com()) || way.angvel.length() * part > rounding;
        let changed = grew(here.force, there.force) || grew(here.torque, there.torque);
        if !(moved && changed) {
            return 0.0;
        }
        secant(body, here, there, way.linvel, way.angvel, context.dt) / self.share
    }
}
