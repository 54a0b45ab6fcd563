//! The two halves of a step.

use super::evaluation::{Evaluation, find};
use super::fault::{Fault, FaultKind};
use super::implicit::implicit_change;
use super::motion::{FASTEST, Load, Motions, Start, SteadyTurn, VelocityUpdate, kicked};
use super::scheme::SUZUKI_STAGES;
use super::stiffness::{StepWarning, Treatment};
use super::{Integrator, Scheme, StepContext, Substeps};
use crate::math::{DVec3, Real, RigidBodyHandle, Vector, from_dvec3, from_f64, to_dvec3, to_f64};
use crate::rigid::{
    Body, Lookup, Mobility, Wrench, of_wrench, pair, rounded, to_dquat, velocities,
};

/// Which half of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Half {
    First,
    Second,
}

/// What is done with a body in one half of a step.
#[derive(Clone, Copy)]
enum Duty {
    Kick(Real),
    Implicit(Real),
    /// To be moved by the multirate integrator, with so many substeps.
    Inner(u32),
    /// To be pushed by Rapier's own forces.
    ByForce,
}

/// The bodies that something has put on another path within the step.
#[derive(Clone, Copy, Default)]
pub(crate) struct Redirected<'a> {
    /// The wrenches on all bodies when the step began.
    pub before: &'a [Wrench],
    /// Who, in the order of handles, and which share of the step was over.
    pub shares: &'a [(RigidBodyHandle, Real)],
}

impl Redirected<'_> {
    /// By how much the wrench of the second half of a kick is off: up to a hit the first wrench is to
    /// act, and the second from then on. The map of a step is the same backwards, so hits in a field
    /// that changes neither add nor take energy in the mean.
    fn correction(&self, place: usize, body: RigidBodyHandle, wrench: Wrench) -> Option<Wrench> {
        let index = |body: RigidBodyHandle| body.into_raw_parts().0;
        let found = self
            .shares
            .binary_search_by_key(&index(body), |(body, _)| index(*body));
        let (share, before) = (self.shares[found.ok()?].1, self.before.get(place)?);
        let later = 1.0 - 2.0 * share;
        Some(wrench.plus(before.times(-1.0)).times(later))
    }
}

/// Whether a wrench acts on a body, and whether it is to be woken, or kept from falling asleep.
pub(crate) type Acts<'a> = &'a dyn Fn(usize, &Body, Wrench) -> (bool, bool);

impl Integrator {
    /// Works out what is written before Rapier's step.
    pub(crate) fn first_half(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        acts: Acts<'_>,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        motions.clear();
        let all = (Half::First, None, Redirected::default());
        self.kick((context, evaluation), all, acts, motions)?;
        self.move_within(context, evaluation, motions)?;
        motions.sort_loads();
        Ok(())
    }

    /// Works out what is written after Rapier's step: the second half of a kick, for all bodies
    /// that were not settled in the `first` one.
    pub(crate) fn second_half(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        (first, redirected): (&Motions, Redirected<'_>),
        acts: Acts<'_>,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        motions.clear();
        let rest = (Half::Second, Some(first), redirected);
        self.kick((context, evaluation), rest, acts, motions)
    }

    /// Works out what is done with each body, and whom the multirate integrator is to move.
    fn kick(
        &self,
        (context, evaluation): (&StepContext<'_, impl Lookup>, &Evaluation),
        (half, first, redirected): (Half, Option<&Motions>, Redirected<'_>),
        acts: Acts<'_>,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        let turns = context.turns();
        let drifts = half == Half::First;
        let settled = first.map_or(&[][..], |first| &first.settled);
        for (place, body) in context.bodies.iter().enumerate() {
            let Some(duty) = duty(context, evaluation, (half, settled), place) else {
                continue;
            };
            let wrench = evaluation.wrenches[place];
            let (acts, wake) = acts(place, body, wrench);
            if !acts {
                continue;
            }
            // What reads velocities is solved for the whole kick, and nothing may be added to it.
            let reads_velocities = matches!(evaluation.couplings.get(place), Some(Some(_)));
            let loaded = drifts && context.is_held(body);
            if drifts && (!matches!(duty, Duty::Kick(_)) || loaded && reads_velocities) {
                motions.settled.push(body.handle);
            }
            let duration = match duty {
                Duty::ByForce if wrench == Wrench::ZERO => continue,
                Duty::ByForce => {
                    self.lend(context, place, (wrench, wake), motions)?;
                    continue;
                }
                Duty::Kick(_) if loaded => {
                    let wrench = midway(evaluation, place, body, context.dt);
                    self.lend(context, place, (wrench, wake), motions)?;
                    continue;
                }
                Duty::Inner(count) => {
                    motions.inner.push(Start { place, count, wake });
                    continue;
                }
                Duty::Implicit(duration) | Duty::Kick(duration) => duration,
            };
            let implicit = match duty {
                Duty::Implicit(_) => {
                    implicit_kick(evaluation, place, body, duration, context.rules.exact_turns)
                }
                _ => None,
            };
            if loaded && let Some((update, _)) = implicit {
                let wrench = Load::making(body, &update, context.dt);
                self.lend(context, place, (wrench, wake), motions)?;
                continue;
            }
            let felt = match first {
                Some(_) if reads_velocities => midway(evaluation, place, body, duration),
                Some(first) => {
                    let load = first.load(body.handle);
                    let correction = redirected.correction(place, body.handle, wrench);
                    let correction = correction.filter(|_| load.is_none());
                    let felt = context.second(body, wrench, load);
                    felt.plus(correction.unwrap_or(Wrench::ZERO))
                }
                None => midway(evaluation, place, body, duration),
            };
            // Bodies that feel nothing are left alone.
            let spins = turns && drifts && body.angvel != Vector::ZERO;
            if felt == Wrench::ZERO && implicit.is_none() && !wake && !spins {
                continue;
            }
            let (update, twist) = implicit.unwrap_or_else(|| {
                let twist = to_dvec3(felt.torque * duration);
                (kicked(body, felt, duration), twist)
            });
            let update = VelocityUpdate { wake, ..update };
            let speed = update.linvel.length();
            if !(speed <= FASTEST && update.angvel.length() <= FASTEST) {
                return Err(self.too_fast(context, place, speed));
            }
            let drift = (turns && drifts).then_some(context.dt);
            take(context, motions, body, update, (twist, drift));
        }
        Ok(())
    }

    /// Has a body pushed by Rapier's own forces.
    fn lend(
        &self,
        context: &StepContext<'_, impl Lookup>,
        place: usize,
        (wrench, wake): (Wrench, bool),
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        if wrench == Wrench::ZERO && !wake {
            return Ok(());
        }
        let load = Load::new(&context.bodies[place], wrench, wake, context.dt);
        let [speed, turn] = load.speeds;
        if !(speed <= FASTEST && turn <= FASTEST) {
            return Err(self.too_fast(context, place, speed));
        }
        motions.loads.push(load);
        Ok(())
    }

    pub(super) fn too_fast(
        &self,
        context: &StepContext<'_, impl Lookup>,
        place: usize,
        speed: Real,
    ) -> Fault {
        let frames = self.motions.frames(context, &[], 0.0);
        let kind = FaultKind::TooFast { speed };
        let (compiled, moment) = (context.compiled, context.moment());
        Fault::new(kind, compiled, &frames, (context.samples, place), moment)
    }
}

/// What is done with a body; `None` if it has been done.
fn duty(
    context: &StepContext<'_, impl Lookup>,
    evaluation: &Evaluation,
    (half, settled): (Half, &[RigidBodyHandle]),
    place: usize,
) -> Option<Duty> {
    let (dt, body) = (context.dt, context.bodies[place].handle);
    if half == Half::Second {
        if !settled.is_empty() && find(settled, body).is_some() {
            return None;
        }
        return Some(match evaluation.treatment(place) {
            Treatment::Implicit => Duty::Implicit(dt * 0.5),
            _ => Duty::Kick(dt * 0.5),
        });
    }
    if !context.rules.links.is_empty() && find(context.rules.links, body).is_some() {
        return Some(Duty::ByForce);
    }
    Some(match context.rules.scheme {
        Scheme::ExternalForce => Duty::ByForce,
        Scheme::Kick => Duty::Kick(dt),
        Scheme::LinearlyImplicit => Duty::Implicit(dt),
        Scheme::Substep(Substeps::Fixed(count)) => Duty::Inner(count),
        Scheme::Suzuki4 => Duty::Inner(SUZUKI_STAGES),
        Scheme::KickDriftKick | Scheme::Auto { .. } | Scheme::Substep(_) => {
            match evaluation.treatment(place) {
                Treatment::KickDriftKick => Duty::Kick(dt * 0.5),
                Treatment::Substep(count) => Duty::Inner(count),
                Treatment::Implicit => Duty::Implicit(dt),
            }
        }
    })
}

/// Takes up new velocities of a body; over a `drift`, with its free rotation, which begins with an
/// angular impulse `twist`.
fn take(
    context: &StepContext<'_, impl Lookup>,
    motions: &mut Motions,
    body: &Body,
    mut update: VelocityUpdate,
    (twist, drift): (DVec3, Option<Real>),
) {
    let balls_too = context.rules.exact_turns;
    let top = drift.and_then(|dt| Some((dt, body.free_top(update.angvel, balls_too)?)));
    if let Some((dt, inertia)) = top {
        let turn = SteadyTurn::new(body, &inertia, twist, dt, context.rules.iterations);
        update.angvel = turn.steady;
        update.spins = true;
        motions.turns.push(turn);
    }
    motions.updates.push(update);
}

/// The wrench in the middle of a kick; the one of its start unless it reads velocities.
fn midway(evaluation: &Evaluation, place: usize, body: &Body, duration: Real) -> Wrench {
    let wrench = evaluation.wrenches[place];
    let Some(Some(coupling)) = evaluation.couplings.get(place) else {
        return wrench;
    };
    let mobility = Mobility::of(body);
    let duration = to_f64(duration);
    let midway = coupling.midway(&mobility, &of_wrench(wrench), &velocities(body), duration);
    midway.map_or(wrench, |midway| {
        let (force, torque) = rounded(&midway);
        Wrench { force, torque }
    })
}

/// The velocities after a linearly implicit kick, and the change of the angular momentum of a free
/// top; `None` if there is no Jacobian for it.
fn implicit_kick(
    evaluation: &Evaluation,
    place: usize,
    body: &Body,
    duration: Real,
    balls_too: bool,
) -> Option<(VelocityUpdate, DVec3)> {
    let estimate = evaluation.estimate(place)?;
    let now = velocities(body);
    let wrench = evaluation.wrenches[place];
    let change = implicit_change(
        &Mobility::of(body),
        &estimate.jacobian,
        &of_wrench(wrench),
        &now,
        to_f64(duration),
    )?;
    if wrench == Wrench::ZERO && change.iter().all(|x| *x == 0.0) {
        return None;
    }
    let (linvel, angvel) = pair(&(now + change));
    let update = VelocityUpdate {
        body: body.handle,
        linvel: from_dvec3(linvel),
        angvel: from_dvec3(angvel),
        spins: false,
        wake: false,
    };
    let top = body.free_top(update.angvel, balls_too);
    let twist = top.map_or(DVec3::ZERO, |inertia| {
        inertia.angular_momentum(to_dquat(body.pose.rotation), pair(&change).1)
    });
    Some((update, twist))
}

/// Warns of the bodies that Rapier will slow down without a word.
pub(crate) fn warn_of_caps(
    context: &StepContext<'_, impl Lookup>,
    motions: &Motions,
    warnings: &mut Vec<StepWarning>,
) {
    let limit = context.rules.max_speed;
    let updates = motions.updates.iter();
    let updates = updates.map(|it| (it.body, [it.linvel, it.angvel].map(Vector::length)));
    let loads = motions.loads.iter().map(|load| (load.body, load.speeds));
    // Rapier's `MAX_ROTATION`, an eighth of a turn per step.
    let fastest_turn = from_f64(std::f64::consts::FRAC_PI_4) / context.dt;
    for (body, [speed, turn]) in updates.chain(loads) {
        if speed > limit {
            warnings.push(StepWarning::SpeedCapped { body, speed, limit });
        }
        let capped = || {
            let body = context.world.body(body);
            body.is_some_and(|body| !body.is_fast_rotation_allowed())
        };
        if turn > fastest_turn && capped() {
            warnings.push(StepWarning::RotationCapped {
                body,
                speed: turn,
                limit: fastest_turn,
            });
        }
    }
}
