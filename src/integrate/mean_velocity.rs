//! Motion within a step: the velocities before and after Rapier's step that carry out the motion in the fields.

use super::evaluation::Evaluation;
use super::fault::{Fault, FaultPolicy};
use super::load::{lag, own_lag};
use super::motion::{FASTEST, Load, MeanVelocity, Motions, SteadyTurn, TurnAfter, VelocityUpdate};
use super::resolve::{Begins, Found};
use super::{Integrator, StepContext};
use crate::math::{DVec3, Real, Vector, from_dvec3, from_f64, to_dvec3, to_f64};
use crate::rigid::{Body, Lookup, RigidState, Turning, Wrench, steady_angvel};

impl Integrator {
    /// Moves bodies within the step, and adds the velocities for Rapier to `motions`.
    pub(super) fn move_within(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        if motions.inner.is_empty() || context.dt == 0.0 {
            return Ok(());
        }
        let mut starts = std::mem::take(&mut motions.inner);
        let mut updates = std::mem::take(&mut self.others);
        updates.clone_from(&motions.updates);
        let begins = Begins {
            evaluation,
            updates: &updates,
            before: None,
        };
        let mut faults = std::mem::take(&mut motions.faults);
        let take = |integrator: &Self, found: Found<'_>| {
            let place = found.start.place;
            motions.resolved.extend(found.resolved);
            let (body, wake) = (&context.bodies[place], found.start.wake);
            let speed = correct(context, motions, found.state, found.wrench, body, wake);
            if speed <= FASTEST {
                return Ok(());
            }
            let fault = integrator.too_fast(context, vec![place], speed);
            if context.rules.on_fault == FaultPolicy::Refuse {
                return Err(fault);
            }
            motions.drop_last(body.handle);
            motions.faults.push(fault);
            Ok(())
        };
        let outcome = self.resolve(context, begins, &mut starts, &mut faults, take);
        motions.faults.append(&mut faults);
        motions.inner = starts;
        self.others = updates;
        outcome
    }
}

/// Gives a body the mean velocity of its path, such that with the accelerations that Rapier adds over its iterations
/// (its own, and the load of a held body) it arrives at the path's end. Returns the largest speed among these
/// velocities; NaN if they cannot be given to Rapier.
fn correct(
    context: &StepContext<'_, impl Lookup>,
    motions: &mut Motions,
    state: &RigidState,
    wrench: Wrench,
    body: &Body,
    wake: bool,
) -> Real {
    let turns = matches!(state.turning, Turning::Free(..)) && state.angvel != DVec3::ZERO;
    if !state.pushed && !turns && !wake {
        return 0.0;
    }
    let step = to_f64(context.dt);
    if context.compiled.reads_velocity && context.is_held(body) {
        let (force, torque) = state.mean_wrench(step);
        let (force, torque) = (from_dvec3(force), from_dvec3(torque));
        let load = Load::new(body, Wrench { force, torque }, wake, context.dt);
        let adds_up = load.adds_up(body, context.rules.gravity);
        let speed = load.speeds[0].max(load.speeds[1]);
        if let Some(known) = context.rules.reactions {
            motions.react(known.of(body.handle), body, &load.wrench, context.dt);
        }
        motions.loads.push(load);
        return if adds_up { speed } else { Real::NAN };
    }
    let mut update = VelocityUpdate {
        body: state.body,
        linvel: body.linvel,
        angvel: body.angvel,
        spins: false,
        wake,
    };
    let lag = lag(context, body);
    let load = lag.map(|_| state.mean_wrench(step));
    let own_lag = || own_lag(context, body, wrench);
    let shown = lag.or_else(own_lag).map(|lag| state.behind(lag));
    let shown = shown.as_ref().unwrap_or(state);
    let (force, torque) = load.unwrap_or_default();
    let own = state.acceleration + force * to_dvec3(body.inv_mass);
    let count = f64::from(body.iterations(context.rules.iterations).max(1));
    // The share of a constant acceleration that adds to the path over the iterations, as a time.
    let ahead = step * (count + 1.0) / (2.0 * count);
    if state.pushed {
        let mean = (state.position - state.start.0) / step;
        update.linvel = from_dvec3(mean - own * ahead);
        motions.means.push(MeanVelocity {
            body: state.body,
            expected: update.linvel + from_dvec3(own * step),
            linvel: from_dvec3(shown.linvel),
            damped: lag.is_none(),
            given: Some(update.linvel),
            behind: match lag {
                Some(_) => from_dvec3(state.linvel - shown.linvel),
                None => Vector::ZERO,
            },
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
            inertia: body.principal_inertia,
            twist,
            gyroscopic: body.gyroscopic,
            damped: lag.is_none(),
            steady: update.angvel + twisted * context.dt,
        });
    }
    let mut adds_up = true;
    if load.is_some() {
        let (force, torque) = (from_dvec3(force), from_dvec3(torque));
        let arrives = (update.linvel + from_dvec3(own * step)).length();
        // If Rapier caps the given velocity already, the warning comes from the update.
        let capped = update.linvel.length() > context.rules.caps.speed;
        let load = Load {
            body: state.body,
            wrench: Wrench { force, torque },
            wake,
            speeds: [if capped { 0.0 } else { arrives }, 0.0],
        };
        adds_up = load.adds_up(body, context.rules.gravity);
        motions.loads.push(load);
    }
    let ends = from_f64(state.linvel.length().max(state.angvel.length()));
    let speed = update.linvel.length().max(update.angvel.length()).max(ends);
    let update_is_nan = update.linvel.is_nan() || update.angvel.is_nan();
    motions.updates.push(update);
    // `max` ignores NaN.
    if update_is_nan || !adds_up {
        Real::NAN
    } else {
        speed
    }
}
