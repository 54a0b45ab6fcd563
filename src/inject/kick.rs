//! The two halves of a step.

use super::error::StepError;
use super::implicit::implicit_change;
use super::motion::{FASTEST, Loan, Spin, Update, free_top, kicked, write};
use super::realise::Start;
use super::scheme::SUZUKI_STAGES;
use super::stiffness::{StepWarning, Treatment};
use super::{Injector, OpenStep, Scheme, Substeps, WakePolicy, blame, find};
use crate::compile::Prepared;
use crate::math::{ColliderSet, DVec3, Real, RigidBodyHandle, RigidBodySet, Vector};
use crate::math::{from_dvec3, from_f64, to_dvec3, to_f64};
use crate::rapier::dynamics::RigidBody;
use crate::rigid::Wrench;
use crate::rigid::to_dquat;
use crate::rigid::{self as mobility, Mobility, pair, rounded, velocities};

/// What is done with a body in one half of a step.
#[derive(Clone, Copy)]
enum Duty {
    Kick(Real),
    Implicit(Real),
    /// To be moved by the inner integrator, with so many substeps.
    Inner(u32),
    /// To be pushed by Rapier's own forces.
    Lend,
}

/// Which half.
enum Half {
    First,
    Second,
}

impl Injector {
    /// Works out what is written before Rapier's step.
    pub(super) fn first_half(
        &mut self,
        compiled: Prepared<'_>,
        open: &mut OpenStep,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<(), StepError> {
        let world = (bodies, colliders);
        self.kick(compiled, Half::First, open, world)?;
        self.move_within(compiled, open, world)?;
        self.note_caps(open.dt, bodies);
        Ok(())
    }

    /// The second half of a kick, with the wrenches after Rapier's step.
    pub(super) fn second_half(
        &mut self,
        compiled: Prepared<'_>,
        open: &OpenStep,
        bodies: &mut RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<usize, StepError> {
        let dt = open.dt;
        // No second half is to come for these, so their velocities are to be taken as they are.
        for place in 0..self.samples.bodies.len() {
            if !open.settled.is_empty() && find(&open.settled, self.samples.bodies[place]).is_some()
            {
                self.wrenches[place] = Wrench::ZERO;
            }
        }
        self.evaluate(compiled, dt, bodies, colliders, Some(dt * 0.5))?;
        self.update(compiled, dt, bodies, colliders);
        let mut open = OpenStep {
            dt,
            settled: open.settled.clone(),
            ..OpenStep::default()
        };
        self.kick(compiled, Half::Second, &mut open, (bodies, colliders))?;
        let written = write(bodies, &self.kicks.updates);
        self.before.take(bodies);
        Ok(written)
    }

    /// What is done with a body; `None` if it has been done.
    fn duty(
        &self,
        half: &Half,
        place: usize,
        body: RigidBodyHandle,
        open: &OpenStep,
    ) -> Option<Duty> {
        let dt = open.dt;
        if matches!(half, Half::Second) {
            if !open.settled.is_empty() && find(&open.settled, body).is_some() {
                return None;
            }
            return Some(match self.watch.treatment(place) {
                Treatment::Implicit => Duty::Implicit(dt * 0.5),
                _ => Duty::Kick(dt * 0.5),
            });
        }
        if !self.links.is_empty() && find(&self.links, body).is_some() {
            return Some(Duty::Lend);
        }
        Some(match self.scheme {
            Scheme::ExternalForce => Duty::Lend,
            Scheme::Kick => Duty::Kick(dt),
            Scheme::LinearlyImplicit => Duty::Implicit(dt),
            Scheme::Substep(Substeps::Fixed(count)) => Duty::Inner(count),
            Scheme::Suzuki4 => Duty::Inner(SUZUKI_STAGES),
            Scheme::KickDriftKick | Scheme::Auto { .. } | Scheme::Substep(_) => {
                match self.watch.treatment(place) {
                    Treatment::KickDriftKick => Duty::Kick(dt * 0.5),
                    Treatment::Substep(count) => Duty::Inner(count),
                    Treatment::Implicit => Duty::Implicit(dt),
                }
            }
        })
    }

    /// Works out `self.kicks`, and whom the inner integrator is to move.
    fn kick(
        &mut self,
        compiled: Prepared<'_>,
        half: Half,
        open: &mut OpenStep,
        (bodies, colliders): (&RigidBodySet, &ColliderSet),
    ) -> Result<(), StepError> {
        let turns = (compiled.torque_possible || self.exact_turns) && open.dt > 0.0;
        let drifts = matches!(half, Half::First);
        self.kicks.clear();
        for place in 0..self.samples.bodies.len() {
            let handle = self.samples.bodies[place];
            let (Some(body), Some(duty)) =
                (bodies.get(handle), self.duty(&half, place, handle, open))
            else {
                continue;
            };
            let wrench = self.wrenches[place];
            if !self.sleepers.acts(handle, body, wrench, self.wake) {
                continue;
            }
            let wake = self.wakes(body, wrench);
            if drifts && !matches!(duty, Duty::Kick(_)) {
                open.settled.push(handle);
            }
            let duration = match duty {
                Duty::Lend if wrench == Wrench::ZERO => continue,
                Duty::Lend => {
                    self.kicks.lent.push((place, wake));
                    continue;
                }
                Duty::Inner(count) => {
                    self.kicks.inner.push(Start { place, count, wake });
                    continue;
                }
                Duty::Implicit(duration) | Duty::Kick(duration) => duration,
            };
            let implicit = match duty {
                Duty::Implicit(_) => self.implicit_kick(place, body, duration),
                _ => None,
            };
            // Bodies that feel nothing are left alone.
            let spins = turns && drifts && body.angvel() != Vector::ZERO;
            if wrench == Wrench::ZERO && implicit.is_none() && !wake && !spins {
                continue;
            }
            let (update, twist) = implicit.unwrap_or_else(|| {
                let felt = self.midway(place, body, wrench, duration);
                let twist = to_dvec3(felt.torque * duration);
                (kicked(handle, body, felt, duration), twist)
            });
            let update = Update { wake, ..update };
            let speed = update.linvel.length();
            if !(speed <= FASTEST && update.angvel.length() <= FASTEST) {
                return Err(self.too_fast(compiled, (bodies, colliders), place, speed));
            }
            let drift = (turns && drifts).then_some(open.dt);
            self.take(body, update, twist, drift);
        }
        Ok(())
    }

    /// Takes up new velocities of a body; over a `drift`, with its free rotation, which begins
    /// with an angular impulse `twist`.
    fn take(&mut self, body: &RigidBody, mut update: Update, twist: DVec3, drift: Option<Real>) {
        let top = drift.and_then(|dt| Some((dt, free_top(body, update.angvel, self.exact_turns)?)));
        if let Some((dt, inertia)) = top {
            let spin = Spin::new(update.body, body, &inertia, twist, dt, self.substeps);
            update.angvel = spin.steady;
            update.spins = true;
            self.kicks.spins.push(spin);
        }
        self.kicks.updates.push(update);
    }

    /// The wrench in the middle of a kick; the one of its start unless it reads velocities.
    fn midway(&self, place: usize, body: &RigidBody, wrench: Wrench, duration: Real) -> Wrench {
        let Some(Some(coupling)) = self.watch.couplings.get(place) else {
            return wrench;
        };
        let start = mobility::of_wrench(wrench);
        let mobility = Mobility::of(body);
        let midway = coupling.midway(&mobility, &start, &velocities(body), to_f64(duration));
        midway.map_or(wrench, |midway| {
            let (force, torque) = rounded(&midway);
            Wrench { force, torque }
        })
    }

    /// The velocities after a linearly implicit kick, and the change of the angular momentum of a
    /// free top; `None` if there is no Jacobian for it.
    fn implicit_kick(
        &self,
        place: usize,
        body: &RigidBody,
        duration: Real,
    ) -> Option<(Update, DVec3)> {
        let verdict = self.watch.verdict(place)?;
        let now = velocities(body);
        let wrench = mobility::of_wrench(self.wrenches[place]);
        let change = implicit_change(
            &Mobility::of(body),
            &verdict.jacobian,
            &wrench,
            &now,
            to_f64(duration),
        )?;
        if self.wrenches[place] == Wrench::ZERO && change.iter().all(|x| *x == 0.0) {
            return None;
        }
        let (linvel, angvel) = pair(&(now + change));
        let update = Update {
            body: self.samples.bodies[place],
            linvel: from_dvec3(linvel),
            angvel: from_dvec3(angvel),
            spins: false,
            wake: false,
        };
        let attitude = to_dquat(*body.rotation());
        let top = free_top(body, update.angvel, self.exact_turns);
        let twist = top.map_or(DVec3::ZERO, |inertia| {
            inertia.angular_momentum(attitude, pair(&change).1)
        });
        Some((update, twist))
    }

    pub(super) fn too_fast(
        &self,
        compiled: Prepared<'_>,
        world: (&RigidBodySet, &ColliderSet),
        place: usize,
        speed: Real,
    ) -> StepError {
        let moment = self.moment(self.evaluated_dt);
        StepError::TooFast {
            field: blame::strongest(compiled, &world, &self.samples, moment, place),
            body: self.samples.bodies[place],
            speed,
            limit: FASTEST,
        }
    }

    /// Whether a body that the fields act on is to be woken, or kept from falling asleep.
    fn wakes(&self, body: &RigidBody, wrench: Wrench) -> bool {
        let always = self.wake == WakePolicy::Always && wrench != Wrench::ZERO;
        always || body.is_sleeping()
    }

    /// Puts wrenches in place of the users' forces, on top of them.
    pub(super) fn lend(&mut self, bodies: &mut RigidBodySet, open: &mut OpenStep) -> usize {
        for (place, wake) in &self.kicks.lent {
            let handle = self.samples.bodies[*place];
            let wrench = self.wrenches[*place];
            let Some(body) = bodies.get_mut(handle) else {
                continue;
            };
            open.loans.push(Loan {
                body: handle,
                force: body.user_force(),
                torque: body.user_torque(),
            });
            body.add_force(wrench.force, *wake);
            body.add_torque(wrench.torque, *wake);
        }
        open.loans.len()
    }

    /// Notes the bodies that Rapier will slow down without a word.
    fn note_caps(&mut self, dt: Real, bodies: &RigidBodySet) {
        let fastest = self.max_speed.unwrap_or(Real::MAX);
        // Rapier's `MAX_ROTATION`, an eighth of a turn per step.
        let fastest_turn = from_f64(std::f64::consts::FRAC_PI_4) / dt;
        for update in &self.kicks.updates {
            let (speed, turn) = (update.linvel.length(), update.angvel.length());
            if speed > fastest {
                self.warnings.push(StepWarning::SpeedCapped {
                    body: update.body,
                    speed,
                    limit: fastest,
                });
            }
            if turn > fastest_turn
                && bodies
                    .get(update.body)
                    .is_some_and(|body| !body.is_fast_rotation_allowed())
            {
                self.warnings.push(StepWarning::RotationCapped {
                    body: update.body,
                    speed: turn,
                    limit: fastest_turn,
                });
            }
        }
    }
}
