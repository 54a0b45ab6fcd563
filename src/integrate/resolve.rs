//! Bodies that are moved within a step, as finely as their stiffness needs.

use super::balance::EnergyBalance;
use super::drift::Drifts;
use super::evaluation::Evaluation;
use super::fault::{DropNonFinite, Fault, FaultKind, FaultPolicy};
use super::load::{all_else, lag, own_lag};
use super::motion::{Resolved, Start, VelocityUpdate};
use super::plan::{Bisection, HOPELESS, PlanRules, SUZUKI_STAGES, StepPlan};
use super::predicted::PredictedMotion;
use super::rate_estimate::RateEstimate;
use super::substeps::{Setting, StepMap, SubstepIntegrator};
use super::warn::most_to_follow;
use super::{Integrator, StepContext};
use crate::math::{RigidBodyHandle, to_f64};
use crate::rigid::{Body, Lookup, Mobility, RigidState, Wrench};

/// The state of bodies at the start of the step in which they are moved.
#[derive(Clone, Copy)]
pub(super) struct Begins<'a> {
    /// The evaluation at the start of the step.
    pub evaluation: &'a Evaluation,
    /// The new velocities of the other bodies.
    pub updates: &'a [VelocityUpdate],
    /// The bodies at the start, if those of the context are already at the end of the step.
    pub before: Option<&'a [Body]>,
}

impl Begins<'_> {
    /// The time of the start, relative to that of the context.
    fn from(&self, context: &StepContext<'_, impl Lookup>) -> f64 {
        if self.before.is_some() {
            -to_f64(context.dt)
        } else {
            0.0
        }
    }
}

/// The result for a body that has been moved.
pub(super) struct Found<'a> {
    pub start: &'a Start,
    pub state: &'a RigidState,
    /// The wrench on the body at the end of its path.
    pub wrench: Wrench,
    /// Set under a scheme that chooses.
    pub resolved: Option<Resolved>,
}

impl Integrator {
    /// Moves bodies over a step, and passes the results to `take`. Bodies with the same plan are moved together. A
    /// scheme that chooses repeats the step with a finer plan for bodies that did not meet the tolerance. Bodies that
    /// cannot be moved are left out and listed in `faults`, unless such a fault refuses the step.
    pub(super) fn resolve<W: Lookup>(
        &mut self,
        context: &StepContext<'_, W>,
        begins: Begins<'_>,
        starts: &mut Vec<Start>,
        faults: &mut Vec<Fault>,
        mut take: impl FnMut(&Self, Found<'_>) -> Result<(), Fault>,
    ) -> Result<(), Fault> {
        let mut substeps = std::mem::take(&mut self.substeps);
        let mut alike = std::mem::take(&mut self.alike);
        let plan_rules = context.plan_rules();
        let coupled = plan_rules.is_some() && context.is_coupled();
        let dt = to_f64(context.dt);
        let uneven = !context.compiled.reads_velocity;
        if plan_rules.is_some() && !starts.is_empty() {
            let bodies = begins.before.unwrap_or(context.bodies);
            let drifts = self.drifts(context, bodies, begins.from(context));
            for start in starts.iter_mut() {
                start.drift = drifts.frame(&bodies[start.place]);
                start.is_linearised = drifts.are_given();
            }
            self.drifts = drifts;
        }
        while let Some(first) = starts.first() {
            let plan = first.plan;
            alike.clear();
            if plan == StepPlan::UNEVEN && !coupled {
                // One body at a time, because its parts depend on its own path.
                alike.push(starts.remove(0));
            } else {
                alike.extend(starts.extract_if(.., |start| start.plan == plan));
            }
            let mut outcome = self.run(context, begins, &alike, plan, None, &mut substeps);
            if let Err(fault) = &outcome {
                // A plan that is too coarse may lead to a point where a field is not finite.
                let may = plan_rules.is_some() && uneven && plan != StepPlan::UNEVEN;
                let bad = |it: &Start| coupled || fault.is_of(context.bodies[it.place].handle);
                if may && !alike.iter().any(|it| bad(it) && it.has_given_up()) {
                    let bad = alike.iter_mut().filter(|it| bad(it));
                    bad.for_each(|start| start.plan = StepPlan::UNEVEN);
                    starts.append(&mut alike);
                    continue;
                }
                let drop_non_finite = context
                    .rules
                    .drop_non_finite
                    .filter(|_| begins.before.is_none());
                if drop_non_finite.is_some() && fault.kind == FaultKind::NonFinite {
                    outcome = self.run(
                        context,
                        begins,
                        &alike,
                        plan,
                        drop_non_finite,
                        &mut substeps,
                    );
                }
            }
            if let Err(fault) = outcome {
                let refused = context.rules.on_fault == FaultPolicy::Refuse;
                if refused && begins.before.is_none() {
                    return Err(fault);
                }
                alike.retain(|it| !fault.is_of(context.bodies[it.place].handle));
                starts.append(&mut alike);
                faults.push(fault);
                continue;
            }
            faults.append(&mut substeps.faults);
            match plan_rules {
                Some(plan_rules) => {
                    weigh(plan_rules, begins.evaluation, &mut substeps, &mut alike);
                    refine(plan_rules, &substeps, &mut alike, plan, dt, coupled, uneven);
                }
                None => {
                    self.note_ways(context, &alike, &substeps.tracks);
                    self.note_passages(context, begins.evaluation, &alike, &substeps);
                }
            }
            for (number, start) in alike.iter().enumerate() {
                if start.plan != plan {
                    starts.push(*start);
                    continue;
                }
                let resolved = plan_rules.and_then(|plan_rules| {
                    let path_rate = substeps.tracks.get(number)?.path_rate;
                    let body = context.bodies[start.place].handle;
                    let bisection = substeps.bisection;
                    Some(resolved(plan_rules, bisection, start, path_rate, body, dt))
                });
                let found = Found {
                    start,
                    state: &substeps.states[number],
                    wrench: substeps.wrench(number),
                    resolved,
                };
                take(self, found)?;
            }
        }
        (self.substeps, self.alike) = (substeps, alike);
        Ok(())
    }

    /// The drifts `elapsed` into a step that `bodies` begin with these velocities. Their list is to be put back.
    pub(super) fn drifts(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        bodies: &[Body],
        elapsed: f64,
    ) -> Drifts {
        let mut drifts = std::mem::take(&mut self.drifts);
        drifts.read(context, &mut self.motions, bodies, elapsed);
        drifts
    }

    /// Moves bodies by one plan. With `drop_non_finite`, contributions that are not finite are left out
    /// instead of causing a fault.
    fn run<W: Lookup>(
        &mut self,
        context: &StepContext<'_, W>,
        begins: Begins<'_>,
        starts: &[Start],
        plan: StepPlan,
        drop_non_finite: Option<DropNonFinite<'_>>,
        substeps: &mut SubstepIntegrator,
    ) -> Result<(), Fault> {
        let wrenches = &begins.evaluation.wrenches;
        let torque_possible = context.compiled.torque_possible;
        let state = |body: &Body, place: usize| {
            let felt = wrenches[place] != Wrench::ZERO;
            let turns = felt && body.free_top(body.angvel, false).is_some();
            let mut state = RigidState::new(body, torque_possible || turns);
            state.acceleration = all_else(context, body);
            if let Some(lag) = lag(context, body).filter(|_| begins.before.is_none()) {
                // Rapier itself damps the bodies that it holds.
                state.damping = [0.0; 2];
                state.catch_up(wrenches[place], lag);
            } else if let Some(lag) = own_lag(context, body, wrenches[place]) {
                state.catch_up(wrenches[place], lag);
            }
            state
        };
        let bodies = begins.before.unwrap_or(context.bodies);
        let places = starts.iter().map(|start| start.place);
        substeps.states.clear();
        substeps
            .states
            .extend(places.map(|place| state(&bodies[place], place)));
        self.predict_motions(begins.updates, &substeps.states);
        let map = if !plan.forward {
            StepMap::KickDriftKick(plan.count)
        } else if !context.compiled.reads_velocity {
            StepMap::Forward(plan.count)
        } else if slows_much(context, begins.evaluation, starts) {
            // A step back in time would reverse drag.
            StepMap::KickDriftKick(plan.count * SUZUKI_STAGES)
        } else {
            StepMap::Suzuki
        };
        let coupled = context.plan_rules().is_some() && context.is_coupled();
        let setting = Setting {
            context,
            motions: &self.motions,
            map,
            uneven: context.plan_rules().filter(|_| plan == StepPlan::UNEVEN),
            tracked: context.compiled.varies(),
            most: most_to_follow(context),
            coupled,
            drop_non_finite,
            from: begins.from(context),
        };
        substeps.integrate(setting, starts, wrenches)
    }

    /// Sets the predicted motions of all bodies: `updates` coast, `states` are moved.
    fn predict_motions(&mut self, updates: &[VelocityUpdate], states: &[RigidState]) {
        self.motions.clear();
        for update in updates {
            let (linvel, angvel) = (update.linvel, update.angvel);
            let motion = PredictedMotion::CoastsAt { linvel, angvel };
            self.motions.assign(update.body, motion);
        }
        for (number, state) in states.iter().enumerate() {
            let motion = PredictedMotion::Moves(number as u32);
            self.motions.assign(state.body, motion);
        }
    }
}

/// Sets the balances of bodies before the step and over it.
fn weigh(
    plan_rules: PlanRules,
    evaluation: &Evaluation,
    substeps: &mut SubstepIntegrator,
    starts: &mut [Start],
) {
    let moved = substeps.states.iter().zip(&mut substeps.tracks);
    for (start, (state, track)) in starts.iter_mut().zip(moved) {
        start.balance = evaluation.balance(start.place);
        start.gained = EnergyBalance::of(
            state,
            &mut track.work,
            track.path_rate.omega2,
            plan_rules.tolerance,
        );
    }
}

/// Returns true if the balance of a body allows for its step.
fn bears(plan_rules: PlanRules, start: &Start) -> bool {
    let gained = start.gained.as_ref();
    gained.is_none_or(|gained| start.balance.bears(*gained, plan_rules.tolerance))
}

/// The result for one body.
fn resolved(
    plan_rules: PlanRules,
    bisection: Option<Bisection>,
    start: &Start,
    path_rate: RateEstimate,
    body: RigidBodyHandle,
    dt: f64,
) -> Resolved {
    let (path_rate, error) = match bisection {
        // The next step need not be as stiff.
        Some(Bisection { error, omega2 }) => (RateEstimate { omega2, jump: 0.0 }, error),
        // An edge does not predict stiffness.
        None if start.edge() => (RateEstimate::default(), 0.0),
        None => (path_rate, plan_rules.error(path_rate, start.plan, dt)),
    };
    let balance = start
        .gained
        .map_or(start.balance, |gained| start.balance.and(gained));
    Resolved {
        body,
        path_rate,
        balance,
        error: error.max(balance.error()),
    }
}

/// Gives finer plans to bodies that did not meet the tolerance, and to all if they are `coupled`. For `uneven` see
/// [`PlanRules::finer`].
fn refine(
    plan_rules: PlanRules,
    substeps: &SubstepIntegrator,
    starts: &mut [Start],
    plan: StepPlan,
    dt: f64,
    coupled: bool,
    uneven: bool,
) {
    let mut finest = plan;
    let mut hopeless = false;
    for (number, (start, track)) in starts.iter_mut().zip(&substeps.tracks).enumerate() {
        let path_rate = track.path_rate;
        if plan != StepPlan::UNEVEN {
            start.look(path_rate);
        }
        let error = match substeps.bisection {
            Some(bisection) => bisection.error,
            None => plan_rules.error(path_rate, plan, dt),
        };
        if start.has_given_up() {
            hopeless = true;
        } else if bears(plan_rules, start) && (start.edge() || error <= plan_rules.tolerance) {
            continue;
        } else if let Some(finer) = plan_rules.finer(path_rate, plan, dt, uneven && !start.rests) {
            start.plan = finer;
            if finer.length() < finest.length() {
                finest = finer;
            }
            continue;
        }
        // False for NaN.
        if error <= HOPELESS && !start.has_given_up() {
            continue;
        }
        hopeless = true;
        if !coupled {
            let speed = substeps.states[number].linvel - start.drift;
            start.give_up(speed.length_squared());
        }
    }
    if !coupled {
        return;
    }
    if finest != plan {
        starts.iter_mut().for_each(|start| start.plan = finest);
    } else if hopeless {
        let moved = substeps.states.iter().zip(starts.iter());
        let energy =
            moved.map(|(state, start)| state.mass * (state.linvel - start.drift).length_squared());
        let energy = energy.sum();
        starts.iter_mut().for_each(|start| start.give_up(energy));
    }
}

/// Returns true if drag or damping stops any of these bodies within a step.
fn slows_much(
    context: &StepContext<'_, impl Lookup>,
    evaluation: &Evaluation,
    starts: &[Start],
) -> bool {
    let dt = to_f64(context.dt);
    starts.iter().any(|start| {
        let body = &context.bodies[start.place];
        let coupling = evaluation.couplings.get(start.place);
        let drag = coupling.and_then(|it| Some(it.as_ref()?.slows(&Mobility::of(body))));
        let damping = to_f64(body.damping[0].max(body.damping[1]));
        (drag.unwrap_or(0.0) + damping) * dt > 1.0
    })
}
