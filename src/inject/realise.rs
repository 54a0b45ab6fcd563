//! From the motion in the fields alone to velocities before and after Rapier's step.

use super::error::StepError;
use super::motion::{FASTEST, Ride, Spin, Turned, Update, iterations};
use super::multirate::{Run, Setting};
use super::predicted::PredictedMotion;
use super::{Injector, OpenStep, Scheme, assign};
use crate::compile::Prepared;
use crate::math::{ColliderSet, DVec3, Real, RigidBodySet, from_dvec3, from_f64, to_dvec3, to_f64};
use crate::rapier::dynamics::RigidBody;
use crate::rigid::steady_angvel;
use crate::rigid::{RigidState, Turning};

/// A body that the inner integrator is to move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Among the sampled bodies.
    pub place: usize,
    /// How many substeps it needs.
    pub count: u32,
    pub wake: bool,
}

impl Injector {
    /// Runs the inner integrator, and adds what Rapier is to be given to `self.kicks`.
    pub(super) fn move_within(
        &mut self,
        compiled: Prepared<'_>,
        open: &OpenStep,
        (bodies, colliders): (&RigidBodySet, &ColliderSet),
    ) -> Result<(), StepError> {
        let starts = std::mem::take(&mut self.kicks.inner);
        if starts.is_empty() || open.dt == 0.0 {
            return Ok(());
        }
        let turns = compiled.torque_possible;
        let states = starts.iter().filter_map(|start| {
            let handle = self.samples.bodies[start.place];
            let body = bodies.get(handle)?;
            let mut state = RigidState::new(handle, body, turns);
            state.acceleration = self.own_acceleration(body);
            Some(state)
        });
        let states: Vec<RigidState> = states.collect();
        self.cast(&states);
        let stages = self.scheme.stages();
        let ticks = if stages.is_empty() {
            let most = starts.iter().map(|start| start.count).max().unwrap_or(1);
            vec![f64::from(most).recip(); most as usize]
        } else {
            stages
        };
        let setting = Setting {
            compiled,
            bodies,
            colliders,
            start_time: self.time,
            dt: open.dt,
            ticks: &ticks,
            roles: &self.roles,
            composed: self.scheme == Scheme::Suzuki4,
        };
        let places: Vec<(usize, u32)> = starts.iter().map(|s| (s.place, s.count)).collect();
        let mut run = Run::new(setting, states, &places, &self.samples, &self.wrenches);
        run.go(&mut self.inner)?;
        let states = run.states;
        for (state, start) in states.iter().zip(&starts) {
            if let Some(body) = bodies.get(state.body) {
                let speed = self.realise(state, body, start.wake, open.dt);
                if speed.is_nan() || speed > FASTEST {
                    return Err(self.too_fast(compiled, (bodies, colliders), start.place, speed));
                }
            }
        }
        self.kicks.inner = starts;
        self.kicks.inner.clear();
        Ok(())
    }

    /// What Rapier itself accelerates a body by, as far as it is known.
    fn own_acceleration(&self, body: &RigidBody) -> DVec3 {
        let inv_mass = body.mass_properties().effective_inv_mass;
        let gravity = self.gravity * body.gravity_scale() * body.mass();
        to_dvec3((body.user_force() + gravity) * inv_mass)
    }

    /// Says who does what while the inner integrator runs.
    fn cast(&mut self, states: &[RigidState]) {
        self.roles.clear();
        for update in &self.kicks.updates {
            let (linvel, angvel) = (update.linvel, update.angvel);
            let role = PredictedMotion::CoastsAt { linvel, angvel };
            assign(&mut self.roles, update.body, role);
        }
        for (number, state) in states.iter().enumerate() {
            assign(
                &mut self.roles,
                state.body,
                PredictedMotion::Moves(number as u32),
            );
        }
    }

    /// Gives a body the mean velocity of its way, such that Rapier's own acceleration, over its
    /// iterations, takes it to the end of it. Returns the largest velocity there is in this.
    fn realise(&mut self, state: &RigidState, body: &RigidBody, wake: bool, dt: Real) -> Real {
        let turns = matches!(state.turning, Turning::Free(..)) && state.angvel != DVec3::ZERO;
        if !state.pushed && !turns && !wake {
            return 0.0;
        }
        let mut update = Update {
            body: state.body,
            linvel: body.linvel(),
            angvel: body.angvel(),
            spins: false,
            wake,
        };
        let step = to_f64(dt);
        let iterations = iterations(body, self.substeps);
        if state.pushed {
            let count = f64::from(iterations.max(1));
            let ahead = state.acceleration * (step * (count + 1.0) / (2.0 * count));
            let mean = (state.position - state.start.0) / step;
            update.linvel = from_dvec3(mean - ahead);
            self.kicks.rides.push(Ride {
                body: state.body,
                expected: update.linvel + from_dvec3(state.acceleration) * from_f64(step),
                linvel: from_dvec3(state.linvel),
            });
        }
        let after = match state.turning {
            Turning::Free(_, momentum) => Some(Turned::Momentum(momentum)),
            Turning::Steady => Some(Turned::Velocity(state.angvel)),
            Turning::LeftAlone => None,
        };
        let still = state.attitude == state.start.1 && state.angvel == DVec3::ZERO;
        if let Some(after) = after.filter(|_| !still) {
            let turn = state.attitude * state.start.1.inverse();
            let turn = if turn.w < 0.0 { -turn } else { turn };
            update.angvel = steady_angvel(turn, dt, iterations);
            update.spins = true;
            self.kicks.spins.push(Spin {
                body: state.body,
                after,
                gyroscopic: body.gyroscopic_forces_enabled(),
                steady: update.angvel,
            });
        }
        let ends = from_f64(state.linvel.length().max(state.angvel.length()));
        let speed = update.linvel.length().max(update.angvel.length()).max(ends);
        let update_is_nan = update.linvel.is_nan() || update.angvel.is_nan();
        self.kicks.updates.push(update);
        // `max` passes over NaN.
        if update_is_nan { Real::NAN } else { speed }
    }
}
