//! The fields where bodies would be after a step.

use super::context::StepContext;
use super::predicted::{PredictedMotion, PredictedMotions};
use crate::eval::Evaluator;
use crate::math::{DQuat, Vector, to_dvec3, to_f64};
use crate::rapier::na::Vector6;
use crate::rigid::{Lookup, Mobility, Wrench, of_wrench, rounded};
use crate::sample::Samples;

/// What was found where bodies would be after a step; kept for its buffers.
#[derive(Default)]
pub(super) struct Scout {
    evaluator: Evaluator,
    samples: Samples,
    pub ways: Vec<Way>,
    pub wrenches: Vec<Wrench>,
}

/// How a body would get there.
#[derive(Default)]
pub(super) struct Way {
    /// Of its velocities.
    pub change: Vector6<f64>,
    linvel: Vector,
    angvel: Vector,
}

impl Scout {
    /// Looks where the wrenches `here` would take the bodies.
    pub(super) fn look(
        &mut self,
        motions: &mut PredictedMotions,
        context: &StepContext<'_, impl Lookup>,
        here: &[Wrench],
    ) {
        let dt = context.dt;
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
            self.ways.push(Way {
                change,
                linvel,
                angvel,
            });
            motions.assign(body.handle, PredictedMotion::CoastsAt { linvel, angvel });
        }
        let samples = &mut self.samples;
        samples.clone_from(context.samples);
        samples.solids.clear();
        for sample in &mut samples.list {
            let way = &self.ways[sample.body as usize];
            let turned = sample.arm + way.angvel.cross(sample.arm) * dt;
            sample.world_point += way.linvel * dt + turned - sample.arm;
            sample.arm = turned;
        }
        for (attitude, way) in samples.attitudes.iter_mut().zip(&self.ways) {
            let turned = DQuat::from_scaled_axis(to_dvec3(way.angvel) * to_f64(dt));
            attitude.rotation = turned * attitude.rotation;
        }
        for (centre, way) in samples.centres.iter_mut().zip(&self.ways) {
            centre.world_point += way.linvel * dt;
        }
        let frames = motions.frames(context, &[], to_f64(dt));
        let (compiled, moment) = (context.compiled, context.moment());
        self.evaluator
            .wrenches(compiled, &frames, samples, moment, &mut self.wrenches);
    }
}
