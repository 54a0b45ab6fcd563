//! The action on each body in one half of a step.

use super::begun::BegunBody;
use super::evaluation::Evaluation;
use super::motion::Completion;
use super::plan::StepPlan;
use super::stiffness::StiffMethod;
use super::{Scheme, StepContext, Substeps};
use crate::math::{Real, Vector, to_f64};
use crate::rigid::{Lookup, Wrench, find};

/// The action on a body in one half of a step; kicks have their duration.
#[derive(Clone, Copy)]
pub(crate) enum Method {
    Kick(Real),
    Implicit(Real),
    /// To be moved within the step.
    Inner(StepPlan),
    /// To be pushed by Rapier's own forces.
    ByForce,
}

impl Method {
    /// The duration of a kick, and whether it is a linearly implicit one; `None` for any other action.
    pub(super) fn kick(self) -> Option<(Real, bool)> {
        match self {
            Method::Kick(duration) => Some((duration, false)),
            Method::Implicit(duration) => Some((duration, true)),
            Method::Inner(_) | Method::ByForce => None,
        }
    }
}

/// The action on a body; `None` if there is nothing more to do.
pub(super) fn method_of(
    context: &StepContext<'_, impl Lookup>,
    evaluation: &Evaluation,
    begun: Option<BegunBody<'_>>,
    place: usize,
) -> Option<Method> {
    let (dt, body) = (context.dt, context.bodies[place].handle);
    if let Some(begun) = begun {
        if begun.completion == Some(Completion::Bounced) {
            return Some(Method::Kick(dt * 0.5));
        }
        let late = find(begun.step.late, body).is_some();
        let completed = begun.completion.is_some_and(Completion::is_completed);
        let retried = || evaluation.missed.binary_search(&place).is_ok();
        if !(context.rules.scheme.kicks_twice() || late) || completed || retried() {
            return None;
        }
        let duration = if late { dt } else { dt * 0.5 };
        return Some(match evaluation.stiff_method(place) {
            Some(StiffMethod::Damp) => Method::Implicit(duration),
            _ => Method::Kick(duration),
        });
    }
    if !context.rules.links.is_empty() && find(context.rules.links, body).is_some() {
        return Some(Method::ByForce);
    }
    Some(match context.rules.scheme {
        Scheme::ExternalForce => Method::ByForce,
        Scheme::Kick => Method::Kick(dt),
        Scheme::LinearlyImplicit => Method::Implicit(dt),
        Scheme::Substep(Substeps::Fixed(count)) => Method::Inner(StepPlan {
            count,
            forward: false,
        }),
        Scheme::Forward4 => Method::Inner(StepPlan::FORWARD),
        Scheme::KickDriftKick | Scheme::Auto { .. } | Scheme::Substep(_) => {
            match (evaluation.stiff_method(place), context.plan_rules()) {
                (Some(StiffMethod::Damp), _) => Method::Implicit(dt),
                (Some(StiffMethod::Resolve { path_rate, .. }), Some(plan_rules))
                    if !stands(context, evaluation, place) =>
                {
                    Method::Inner(plan_rules.first(
                        path_rate,
                        to_f64(dt),
                        context.compiled.reads_velocity,
                    ))
                }
                _ => Method::Kick(dt * 0.5),
            }
        }
    })
}

/// Returns true if a body is at rest and nothing accelerates it.
fn stands(context: &StepContext<'_, impl Lookup>, evaluation: &Evaluation, place: usize) -> bool {
    let body = &context.bodies[place];
    evaluation.wrenches[place] == Wrench::ZERO
        && body.linvel == Vector::ZERO
        && body.angvel == Vector::ZERO
        && context.free_motion(body).is_none()
}

/// The plan for all bodies, if one of them has to be moved within the step and bodies act on each other: momentum is
/// kept only if all are moved alike.
pub(super) fn together(
    context: &StepContext<'_, impl Lookup>,
    evaluation: &Evaluation,
) -> Option<StepPlan> {
    let plan_rules = context.plan_rules()?;
    let path_rates = evaluation.stiff_methods.iter();
    let path_rates = path_rates.filter_map(|(place, stiff_method)| match stiff_method {
        StiffMethod::Resolve { path_rate, .. } if !stands(context, evaluation, *place) => {
            Some(*path_rate)
        }
        _ => None,
    });
    let plans = path_rates.map(|path_rate| {
        plan_rules.first(
            path_rate,
            to_f64(context.dt),
            context.compiled.reads_velocity,
        )
    });
    let finest = plans.min_by(|a, b| a.length().total_cmp(&b.length()))?;
    context.is_coupled().then_some(finest)
}
