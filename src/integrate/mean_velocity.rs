//! From the motion in the fields alone to velocities before and after Rapier's step.

use super::evaluation::Evaluation;
use super::fault::Fault;
use super::motion::{
    FASTEST, Load, MeanVelocity, Motions, Start, SteadyTurn, TurnAfter, VelocityUpdate,
};
use super::multirate::Setting;
use super::predicted::PredictedMotion;
use super::{Integrator, Scheme, StepContext};
use crate::math::{DVec3, Real, from_dvec3, from_f64, to_dvec3, to_f64};
use crate::rigid::{Body, Lookup, Mobility, RigidState, Turning, Wrench, steady_angvel};

impl Integrator {
    /// Runs the multirate integrator, and adds what Rapier is to be given to `motions`.
    pub(super) fn move_within(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        if motions.inner.is_empty() || context.dt == 0.0 {
            return Ok(());
        }
        let starts = std::mem::take(&mut motions.inner);
        let mut multirate = std::mem::take(&mut self.multirate);
        let torque_possible = context.compiled.torque_possible;
        let state = |start: &Start| {
            let body = &context.bodies[start.place];
            let felt = evaluation.wrenches[start.place] != Wrench::ZERO;
            let turns = felt && body.free_top(body.angvel, false).is_some();
            let mut state = RigidState::new(body, torque_possible || turns);
            state.acceleration = own_acceleration(context, body);
            if let Some(lag) = lag(context, body) {
                // Rapier damps what it holds.
                state.damping = [0.0; 2];
                state.catch_up(evaluation.wrenches[start.place], lag);
            }
            state
        };
        multirate.states.clear();
        multirate.states.extend(starts.iter().map(state));
        self.predict_motions(motions, &multirate.states);
        let scheme = context.rules.scheme;
        let most = starts.iter().map(|start| start.count).max().unwrap_or(1);
        // A step back in time would undo what drag has stopped.
        let composed = scheme == Scheme::Suzuki4 && !slows_much(context, evaluation, &starts);
        Scheme::divide(most, composed, &mut multirate.ticks);
        let setting = Setting {
            context,
            motions: &self.motions,
            composed,
        };
        multirate.integrate(setting, &starts, &evaluation.wrenches)?;
        for (state, start) in multirate.states.iter().zip(&starts) {
            let body = &context.bodies[start.place];
            let speed = correct(context, motions, state, body, start.wake);
            if speed.is_nan() || speed > FASTEST {
                return Err(self.too_fast(context, start.place, speed));
            }
        }
        self.multirate = multirate;
        motions.inner = starts;
        motions.inner.clear();
        Ok(())
    }

    /// Says who does what while the multirate integrator runs.
    fn predict_motions(&mut self, motions: &Motions, states: &[RigidState]) {
        self.motions.clear();
        for update in &motions.updates {
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

/// Whether drag or damping stops any of some bodies within a step.
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

/// What Rapier itself accelerates a body by.
fn own_acceleration(context: &StepContext<'_, impl Lookup>, body: &Body) -> DVec3 {
    let gravity = context.rules.gravity * body.gravity_scale * body.mass;
    to_dvec3((body.user_force + gravity) * body.inv_mass)
}

/// Gives a body the mean velocity of its way, such that what Rapier adds over its iterations takes
/// it to the end of it: its own acceleration, and the load of a body that is held. Returns the
/// largest velocity there is in this.
fn correct(
    context: &StepContext<'_, impl Lookup>,
    motions: &mut Motions,
    state: &RigidState,
    body: &Body,
    wake: bool,
) -> Real {
    let turns = matches!(state.turning, Turning::Free(..)) && state.angvel != DVec3::ZERO;
    if !state.pushed && !turns && !wake {
        return 0.0;
    }
    let step = to_f64(context.dt);
    let mut update = VelocityUpdate {
        body: state.body,
        linvel: body.linvel,
        angvel: body.angvel,
        spins: false,
        wake,
    };
    let lag = lag(context, body);
    let load = lag.map(|_| state.mean_wrench(step));
    let shown = lag.map(|lag| state.behind(lag));
    let shown = shown.as_ref().unwrap_or(state);
    let (force, torque) = load.unwrap_or_default();
    let own = state.acceleration + force * to_dvec3(body.inv_mass);
    let count = f64::from(body.iterations(context.rules.iterations).max(1));
    // What a constant acceleration adds to the way over the iterations, as a velocity.
    let ahead = step * (count + 1.0) / (2.0 * count);
    if state.pushed {
        let mean = (state.position - state.start.0) / step;
        update.linvel = from_dvec3(mean - own * ahead);
        motions.means.push(MeanVelocity {
            body: state.body,
            expected: update.linvel + from_dvec3(own * step),
            linvel: from_dvec3(shown.linvel),
            damped: lag.is_none(),
        });
    }
    let (after, twist) = match &shown.turning {
        Turning::Free(inertia, momentum) => (
            Some(TurnAfter::Momentum(*momentum)),
            *momentum - body.angular_momentum(inertia),
        ),
        Turning::Steady => (Some(TurnAfter::Velocity(shown.angvel)), DVec3::ZERO),
        Turning::LeftAlone => (None, DVec3::ZERO),
    };
    let still = state.attitude == state.start.1 && state.angvel == DVec3::ZERO;
    if let Some(after) = after.filter(|_| !still) {
        let turn = state.attitude * state.start.1.inverse();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let twisted = body.inv_inertia * from_dvec3(torque);
        let iterations = body.iterations(context.rules.iterations);
        let steady = steady_angvel(turn, context.dt, iterations);
        update.angvel = steady - twisted * from_f64(ahead);
        update.spins = true;
        motions.turns.push(SteadyTurn {
            body: state.body,
            after,
            twist,
            gyroscopic: body.gyroscopic,
            damped: lag.is_none(),
            steady: update.angvel + twisted * context.dt,
        });
    }
    if load.is_some() {
        let (force, torque) = (from_dvec3(force), from_dvec3(torque));
        motions.loads.push(Load {
            body: state.body,
            wrench: Wrench { force, torque },
            wake,
            speeds: [0.0; 2],
        });
    }
    let ends = from_f64(state.linvel.length().max(state.angvel.length()));
    let speed = update.linvel.length().max(update.angvel.length()).max(ends);
    let update_is_nan = update.linvel.is_nan() || update.angvel.is_nan();
    motions.updates.push(update);
    // `max` passes over NaN.
    if update_is_nan { Real::NAN } else { speed }
}

/// By how long a time the velocity of a body is behind that is held, and loaded. Forces that read
/// velocities have no such lag.
fn lag(context: &StepContext<'_, impl Lookup>, body: &Body) -> Option<f64> {
    let half = 0.5 * to_f64(context.dt) * to_f64(context.free_motion(body).iteration());
    let reads = context.compiled.reads_velocity;
    context
        .is_held(body)
        .then_some(if reads { 0.0 } else { half })
}
