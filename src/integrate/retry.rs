//! The repetition of a step that turned out too coarse.
//!
//! The stiffness of the fields that a body enters shows at the end of its step. A body that nothing else touched is
//! then moved again with a finer plan, and placed at the end of that path.

use super::evaluation::Evaluation;
use super::load::own_lag;
use super::motion::{Resolved, Start};
use super::plan::StepPlan;
use super::predicted::from_dquat;
use super::resolve::Begins;
use super::stiffness::{StepWarning, StiffMethod};
use super::{Integrator, StepContext};
use crate::math::{Pose, RigidBodyHandle, Vector, from_dvec3, to_dquat, to_f64};
use crate::rigid::{Body, Lookup, RigidState, Turning, Wrench};

/// The state of a body after its step was repeated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Retried {
    pub place: usize,
    pub body: RigidBodyHandle,
    /// The wrench on the body at `pose`.
    wrench: Wrench,
    pub pose: Pose,
    pub linvel: Vector,
    pub angvel: Vector,
}

impl Integrator {
    /// Moves the bodies that [`update`](Self::update) has listed again, from their state `before`, with the wrenches of
    /// the `last` evaluation. If bodies act on each other, all take the finest plan, or none is moved.
    pub(crate) fn retry(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        before: &[Body],
        last: &Evaluation,
        retried: &mut Vec<Retried>,
        warnings: &mut Vec<StepWarning>,
    ) {
        retried.clear();
        let Some(plan_rules) = context.plan_rules() else {
            return;
        };
        let mut places = std::mem::take(&mut evaluation.missed);
        if places.is_empty() {
            return;
        }
        let plan = |place: usize| match evaluation.stiff_method(place) {
            Some(StiffMethod::Resolve { path_rate, .. }) => {
                plan_rules.plan(path_rate, to_f64(context.dt))
            }
            _ => StepPlan::WHOLE,
        };
        let mut starts: Vec<Start> = places
            .iter()
            .map(|place| {
                let mut start = Start::new(*place, plan(*place), false);
                let was = &before[*place];
                start.rests = [was.linvel, was.angvel] == [Vector::ZERO; 2];
                start
            })
            .collect();
        if context.is_coupled() {
            let finest = starts.iter().map(|start| start.plan);
            let finest = finest.min_by(|a, b| a.length().total_cmp(&b.length()));
            let finest = finest.unwrap_or(StepPlan::WHOLE);
            starts.iter_mut().for_each(|start| start.plan = finest);
        }
        let begins = Begins {
            evaluation: last,
            updates: &[],
            before: Some(before),
        };
        let mut found: Vec<Resolved> = Vec::new();
        let mut faults = Vec::new();
        let coupled = context.is_coupled();
        let outcome = self.resolve(context, begins, &mut starts, &mut faults, |_, moved| {
            let place = moved.start.place;
            let body = &context.bodies[place];
            let shown = own_lag(context, body, moved.wrench).map(|lag| moved.state.behind(lag));
            let shown = shown.as_ref().unwrap_or(moved.state);
            retried.push(Retried::new(place, body, moved.wrench, shown));
            found.extend(moved.resolved);
            Ok(())
        });
        if outcome.is_err() || (coupled && !faults.is_empty()) {
            retried.clear();
            found.clear();
        }
        // The others stay at the poses after the step, with a warning.
        let mut left = places.clone();
        left.retain(|place| retried.iter().all(|now| now.place != *place));
        for place in &left {
            if let Some(StiffMethod::Resolve { path_rate, .. }) = evaluation.stiff_method(*place) {
                let error = plan_rules.error(path_rate, StepPlan::WHOLE, to_f64(context.dt));
                self.reached = self.reached.max(error);
                let body = evaluation.bodies[*place];
                warnings.push(StepWarning::missed(plan_rules, body, error));
            }
        }
        if retried.is_empty() {
            return;
        }
        places.retain(|place| left.binary_search(place).is_err());
        for resolved in &found {
            self.reached = self.reached.max(resolved.error);
            if resolved.error > plan_rules.tolerance {
                warnings.push(StepWarning::missed(
                    plan_rules,
                    resolved.body,
                    resolved.error,
                ));
            }
        }
        let dt = to_f64(context.dt);
        let stiff_methods = &mut evaluation.stiff_methods;
        stiff_methods.retain(|(place, _)| places.binary_search(place).is_err());
        for (now, resolved) in retried.iter().zip(&found) {
            evaluation.wrenches[now.place] = now.wrench;
            if !plan_rules.is_calm(resolved.path_rate, dt) {
                let (path_rate, balance) = (resolved.path_rate, resolved.balance);
                stiff_methods.push((now.place, StiffMethod::Resolve { path_rate, balance }));
            }
        }
        stiff_methods.sort_unstable_by_key(|(place, _)| *place);
        retried.sort_unstable_by_key(|now| now.place);
        evaluation.missed = places;
        evaluation.outdated = true;
    }
}

impl Retried {
    fn new(place: usize, body: &Body, wrench: Wrench, state: &RigidState) -> Self {
        let turned = !matches!(state.turning, Turning::LeftAlone);
        let rotation = if turned {
            from_dquat(state.attitude)
        } else {
            body.pose.rotation
        };
        let arm = to_dquat(rotation) * -state.local_com;
        Retried {
            place,
            body: body.handle,
            wrench,
            pose: Pose::from_parts(from_dvec3(state.position + arm), rotation),
            linvel: from_dvec3(state.linvel),
            angvel: if turned {
                from_dvec3(state.angvel)
            } else {
                body.angvel
            },
        }
    }
}
