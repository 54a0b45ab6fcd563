//! The way of a body in a step, and the work of the fields along it.

use super::SubstepIntegrator;
use crate::eval::SampledWorld;
use crate::integrate::context::StepContext;
use crate::integrate::edges::ForceChange;
use crate::integrate::predicted::PredictedMotions;
use crate::math::DVec3;
use crate::rigid::{Lookup, RigidState, Wrench, of_wrench, pair};
use crate::sample::Moment;

/// The way of a body in a step, from the start to the present pose of its state.
#[derive(Clone)]
pub(in crate::integrate) struct Passage {
    pub place: usize,
    pub state: RigidState,
    /// At the start and at the end.
    pub wrenches: [Wrench; 2],
    /// True if the wrenches act as kicks at both ends, and the body drifts in between.
    pub is_kicked: bool,
    /// The time of the start, relative to the world of the context.
    pub from: f64,
    /// The length of the step.
    pub dt: f64,
}

impl Passage {
    /// The displacement, and the angle by which the body turned, as a vector.
    fn way(&self) -> (DVec3, DVec3) {
        let (from, attitude) = self.state.start;
        let turn = self.state.attitude * attitude.inverse();
        (self.state.position - from, turn.to_scaled_axis())
    }

    /// The change of the wrench.
    pub(in crate::integrate) fn change(&self) -> ForceChange {
        let (way, angle) = self.way();
        let [was, is] = self.wrenches.map(|it| pair(&of_wrench(it)));
        let [before, after] = self.state.kinetic_energies(DVec3::ZERO);
        let turning = (is.1 - was.1).length() * angle.length();
        ForceChange {
            body: self.state.body,
            swing: (is.0 - was.0).length() * way.length() + turning,
            kinetic: before.max(after),
            force2: was.0.length_squared().max(is.0.length_squared()),
            mass: self.state.mass,
            dt: self.dt,
        }
    }

    /// The kinetic energy that the step has given to the body.
    pub(in crate::integrate) fn given(&self) -> f64 {
        let (way, angle) = self.way();
        if !self.is_kicked {
            let [before, after] = self.state.kinetic_energies(DVec3::ZERO);
            return after - before - self.state.acceleration.dot(way) * self.state.mass;
        }
        // Apart from a share that the next steps give back as long as their lengths are equal.
        let [was, is] = self.wrenches.map(|it| pair(&of_wrench(it)));
        0.5 * ((was.0 + is.0).dot(way) + (was.1 + is.1).dot(angle))
    }
}

impl SubstepIntegrator {
    /// The work of the fields on a body that moves and turns steadily over its way, by the wrenches at this number of
    /// points.
    pub(in crate::integrate) fn work_along(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        motions: &PredictedMotions,
        passage: &Passage,
        points: u32,
    ) -> f64 {
        let group = &mut self.group;
        group.begin(context.samples);
        group.take(passage.state.body, passage.place, context.samples);
        group.samples.number();
        let (way, angle) = passage.way();
        let ((position, attitude), end) = (passage.state.start, passage.state.attitude);
        let mut state = [passage.state.clone()];
        let mut done = 0.0;
        for point in 0..points {
            let share = (f64::from(point) + 0.5) / f64::from(points);
            state[0].position = position + way * share;
            state[0].attitude = attitude.slerp(end, share);
            group.place(&state, false);
            let elapsed = passage.from + share * passage.dt;
            let frames = motions.frames(context, &[], elapsed);
            let moment = Moment {
                time: context.time + elapsed,
                dt: context.dt,
                span: context.span,
            };
            let scene = SampledWorld::new(context.compiled, &frames, &group.samples, moment);
            group.evaluator.wrenches(&scene, &mut group.wrenches, None);
            let (force, torque) = pair(&of_wrench(group.wrenches[0]));
            done += (force.dot(way) + torque.dot(angle)) / f64::from(points);
        }
        done
    }
}
