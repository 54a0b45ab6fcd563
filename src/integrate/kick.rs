//! The kicks before and after Rapier's step.

use super::coupling::{Besides, Coupling};
use super::evaluation::Evaluation;
use super::fault::{Fault, FaultKind, FaultPolicy};
use super::free_motion::FreeMotion;
use super::implicit::implicit_change;
use super::motion::{FASTEST, Load, MeanVelocity, Motions, Start, VelocityUpdate, kicked};
use super::plan::StepPlan;
use super::stiffness::Treatment;
use super::{Integrator, Scheme, StepContext, Substeps};
use crate::math::{DVec3, Real, RigidBodyHandle, Vector, from_dvec3, from_f64, to_dvec3, to_f64};
use crate::rapier::na::Vector6;
use crate::rigid::{
    Body, Lookup, Mobility, Wrench, find, find_by, of_wrench, pair, rounded, six, stopped,
    to_dquat, velocities,
};

/// A force that a kick has changed by more than this share is evaluated again in the next step: for one that grows with
/// the square of the speed, the slope alone would be off by a quarter of the share's square, 2.5e-3.
const OUTDATED: f64 = 0.1;

/// A half of a step: before or after Rapier's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Half {
    First,
    Second,
}

/// The error of a speed after a hit within a step from which on schemes without a tolerance warn.
const HIT: f64 = 0.01;

/// The action on a body in one half of a step; kicks have their duration.
#[derive(Clone, Copy)]
enum Duty {
    Kick(Real),
    Implicit(Real),
    /// To be moved within the step.
    Inner(StepPlan),
    /// To be pushed by Rapier's own forces.
    ByForce,
}

/// A body that was put on another path within the step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deflection {
    pub body: RigidBodyHandle,
    /// The share of the step before that.
    pub share: Real,
    /// The acceleration and torque by fields with which it goes on, if it is moved within the step.
    pub presumed: Option<[Vector; 2]>,
}

/// The bodies that were put on another path within the step.
#[derive(Clone, Copy, Default)]
pub(crate) struct Redirected<'a> {
    /// The wrenches on all bodies when the step began, and the couplings of those that read velocities.
    pub before: &'a [Wrench],
    pub coupled: &'a [Option<Coupling>],
    /// Those bodies, in the order of their handles.
    pub hits: &'a [Deflection],
    /// True if there are no detection fields, so that no contact depends on paths and these may still be changed.
    pub may_redo: bool,
}

impl Redirected<'_> {
    pub(super) fn has(&self, body: RigidBodyHandle) -> bool {
        self.hit(body).is_some()
    }

    fn hit(&self, body: RigidBodyHandle) -> Option<&Deflection> {
        let place = find_by(self.hits, body, |hit| hit.body)?;
        Some(&self.hits[place])
    }

    /// The correction of the wrench for the second half of a kick: up to a hit the first wrench should act, and the
    /// second from then on. The map of a step is the same backwards, so hits in a field that does not change neither
    /// add nor take energy on average.
    fn correction(&self, place: usize, body: RigidBodyHandle, wrench: Wrench) -> Option<Wrench> {
        let (hit, before) = (self.hit(body)?, self.before.get(place)?);
        let later = 1.0 - 2.0 * hit.share;
        Some(wrench.plus(before.times(-1.0)).times(later))
    }

    /// The correction for a body that was moved within the step and hit: after the hit it moved under the presumed
    /// acceleration and torque, and should have moved under the mean of these and of those at its end. The second value
    /// is the relative error of its speed that remains.
    fn rest(&self, body: &Body, wrench: Wrench, dt: Real) -> Option<(VelocityUpdate, f64)> {
        let hit = self.hit(body.handle)?;
        let [acceleration, torque] = hit.presumed?;
        let duration = 0.5 * (1.0 - hit.share) * dt;
        let change = Wrench {
            force: wrench.force,
            torque: wrench.torque - torque,
        };
        let mut update = kicked(body, change, duration);
        update.linvel -= acceleration * duration;
        Some((update, error_of_rest(body, &update)))
    }
}

/// The relative error of a body's speed after a correction of its velocities for a force that changes along its path.
/// On a spring the trapezoidal rule is off by (ω t)³/12 of the speed over a time t, and the correction itself is (ω
/// t)²/2 of the speed.
fn error_of_rest(body: &Body, update: &VelocityUpdate) -> f64 {
    let inertia = body.inertia();
    let energy = |linvel: Vector, angvel: Vector| {
        let (attitude, angvel) = (to_dquat(body.pose.rotation), to_dvec3(angvel));
        let momentum = inertia.map_or(DVec3::ZERO, |it| it.angular_momentum(attitude, angvel));
        to_f64(body.mass) * to_dvec3(linvel).length_squared() + angvel.dot(momentum)
    };
    let whole = energy(update.linvel, update.angvel);
    let change = energy(update.linvel - body.linvel, update.angvel - body.angvel);
    if change == 0.0 {
        return 0.0;
    }
    (2.0 * (change / whole).sqrt()).powf(1.5) / 12.0
}

/// Returns whether a wrench acts on a body, and whether the body is to be woken or kept from falling asleep.
pub(crate) type Acts<'a> = &'a dyn Fn(usize, &Body, Wrench) -> (bool, bool);

impl Integrator {
    /// Computes the motions to write before Rapier's step.
    pub(crate) fn first_half(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        acts: Acts<'_>,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        motions.clear();
        self.fastest = None;
        let all = (Half::First, None, Redirected::default());
        self.kick((context, evaluation), all, acts, motions)?;
        self.move_within(context, evaluation, motions)?;
        motions.sort();
        Ok(())
    }

    /// Computes the motions to write after Rapier's step: the second half of a kick, for all bodies that were not
    /// settled in the `first` one.
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
        self.kick((context, evaluation), rest, acts, motions)?;
        let told = context.choice().map_or(HIT, |choice| choice.tolerance);
        if let Some((_, error)) = motions.worst_hit {
            self.reached = self.reached.max(error);
            motions.worst_hit = motions.worst_hit.filter(|_| error > told || error.is_nan());
        }
        Ok(())
    }

    /// Computes the action on each body, and collects the bodies to be moved within the step.
    fn kick(
        &self,
        (context, evaluation): (&StepContext<'_, impl Lookup>, &Evaluation),
        (half, first, redirected): (Half, Option<&Motions>, Redirected<'_>),
        acts: Acts<'_>,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        let done = first.map_or((&[][..], &[][..]), |it| (&it.settled, &it.bounced));
        let together = match half {
            Half::First => together(context, evaluation),
            Half::Second => None,
        };
        let policy = context.rules.on_fault;
        let mut too_fast = TooFast::default();
        for (place, body) in context.bodies.iter().enumerate() {
            let Some(duty) = duty(context, evaluation, half, done, place) else {
                if let Some(first) = first.filter(|first| first.has_slope(body.handle)) {
                    let update = end_of_load(context, evaluation, (place, redirected), first);
                    motions.updates.extend(update);
                } else {
                    let wrench = evaluation.wrenches[place];
                    if let Some((update, error)) = redirected.rest(body, wrench, context.dt) {
                        motions.updates.push(update);
                        motions.note_hit(body.handle, error);
                    }
                }
                continue;
            };
            let duty = match (together, duty) {
                (Some(plan), Duty::Kick(_)) | (Some(plan), Duty::Inner(_)) => Duty::Inner(plan),
                _ => duty,
            };
            let wrench = evaluation.wrenches[place];
            let (acts, wake) = acts(place, body, wrench);
            if !acts {
                continue;
            }
            let kick = Kick {
                context,
                evaluation,
                place,
                body,
                wrench,
                wake,
                felt: true,
            };
            let (mark, whole) = (motions.mark(), (first, redirected));
            let mut done = kick.done(duty, whole, motions);
            if let Err(Faster(speed)) = done {
                motions.back_to(mark);
                too_fast.note(place, speed);
                match policy {
                    FaultPolicy::Refuse => break,
                    FaultPolicy::Quarantine => continue,
                    FaultPolicy::LeaveOut => done = kick.unfelt().done(duty, whole, motions),
                }
            }
            let Ok(Some((update, twist))) = done else {
                // Without fields it is too fast as well: nothing of it is kept.
                if done.is_err() {
                    motions.back_to(mark);
                }
                continue;
            };
            let (iterations, exact) = (context.rules.iterations, context.rules.exact_turns);
            let update = match half {
                Half::First => motions.turned(body, update, twist, context.dt, iterations, exact),
                Half::Second => update,
            };
            motions.updates.push(update);
        }
        let Some((places, speed)) = too_fast.0 else {
            return Ok(());
        };
        let fault = self.too_fast(context, places, speed);
        match policy {
            FaultPolicy::Refuse => Err(fault),
            _ => {
                motions.faults.push(fault);
                Ok(())
            }
        }
    }

    pub(super) fn too_fast(
        &self,
        context: &StepContext<'_, impl Lookup>,
        places: Vec<usize>,
        speed: Real,
    ) -> Fault {
        let frames = self.motions.frames(context, &[], 0.0);
        let kind = FaultKind::TooFast { speed };
        Fault::new(kind, &context.sampled(&frames), places)
    }
}

/// The error of a body whose speed, given here, would be beyond the limit.
struct Faster(Real);

/// The places of bodies that are too fast, and the speed of the first; it allocates only if there is one.
#[derive(Default)]
struct TooFast(Option<(Vec<usize>, Real)>);

impl TooFast {
    fn note(&mut self, place: usize, speed: Real) {
        let known = self.0.get_or_insert_with(|| (Vec::new(), speed));
        known.0.push(place);
    }
}

/// The action on a body; `None` if there is nothing more to do.
fn duty(
    context: &StepContext<'_, impl Lookup>,
    evaluation: &Evaluation,
    half: Half,
    (settled, bounced): (&[RigidBodyHandle], &[RigidBodyHandle]),
    place: usize,
) -> Option<Duty> {
    let (dt, body) = (context.dt, context.bodies[place].handle);
    if half == Half::Second {
        if find(bounced, body).is_some() {
            return Some(Duty::Kick(dt * 0.5));
        }
        let redone = || evaluation.missed.binary_search(&place).is_ok();
        let once = !context.rules.scheme.kicks_twice();
        if once || (!settled.is_empty() && find(settled, body).is_some()) || redone() {
            return None;
        }
        return Some(match evaluation.treatment(place) {
            Some(Treatment::Damp) => Duty::Implicit(dt * 0.5),
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
        Scheme::Substep(Substeps::Fixed(count)) => Duty::Inner(StepPlan {
            count,
            composed: false,
        }),
        Scheme::Suzuki4 => Duty::Inner(StepPlan::COMPOSED),
        Scheme::KickDriftKick | Scheme::Auto { .. } | Scheme::Substep(_) => {
            match (evaluation.treatment(place), context.choice()) {
                (Some(Treatment::Damp), _) => Duty::Implicit(dt),
                (Some(Treatment::Resolve(pace)), Some(choice))
                    if !stands(context, evaluation, place) =>
                {
                    Duty::Inner(choice.first(pace, to_f64(dt), context.compiled.reads_velocity))
                }
                _ => Duty::Kick(dt * 0.5),
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
fn together(context: &StepContext<'_, impl Lookup>, evaluation: &Evaluation) -> Option<StepPlan> {
    let choice = context.choice()?;
    let paces = evaluation.treatments.iter();
    let paces = paces.filter_map(|(place, treatment)| match treatment {
        Treatment::Resolve(pace) if !stands(context, evaluation, *place) => Some(*pace),
        _ => None,
    });
    let plans =
        paces.map(|pace| choice.first(pace, to_f64(context.dt), context.compiled.reads_velocity));
    let finest = plans.min_by(|a, b| a.length().total_cmp(&b.length()))?;
    context.is_coupled().then_some(finest)
}

/// The second half for a body that was loaded with the mean of a force that reads velocities: the effect of the force's
/// change over the step, as [`FreeMotion::second`] for one that reads none. The change is taken at one velocity, and
/// its own effect on the velocity is solved for, so it stays bounded.
fn end_of_load(
    context: &StepContext<'_, impl Lookup>,
    evaluation: &Evaluation,
    (place, redirected): (usize, Redirected<'_>),
    first: &Motions,
) -> Option<VelocityUpdate> {
    let body = &context.bodies[place];
    if evaluation.missed.binary_search(&place).is_ok() {
        return None;
    }
    let now = velocities(body);
    let at = |coupling: &Option<Coupling>| coupling.as_ref().map(|it| it.at(&now));
    let is = evaluation.couplings.get(place)?;
    let was = at(redirected.coupled.get(place)?)?;
    let (change, coupling) = (at(is)? - was, is.as_ref()?);
    let duration = 0.5 * to_f64(context.dt);
    let mobility = Mobility::of(body);
    let mean = coupling.mean(&mobility, &change, &Besides::default(), duration)?;
    let motion = context.free_motion(body);
    let (force, torque) = rounded(&mean);
    let felt = motion.completes(Wrench { force, torque }, first.load(body.handle).is_some());
    (felt != Wrench::ZERO).then(|| kicked(body, felt, from_f64(duration)))
}

/// New velocities of a body, and the angular impulse that is part of them.
type Kicked = (VelocityUpdate, DVec3);

/// A body that is kicked.
struct Kick<'a, W> {
    context: &'a StepContext<'a, W>,
    evaluation: &'a Evaluation,
    place: usize,
    body: &'a Body,
    wrench: Wrench,
    wake: bool,
    /// False if fields are left out.
    felt: bool,
}

impl<W: Lookup> Kick<'_, W> {
    /// The same without fields.
    fn unfelt(&self) -> Self {
        Kick {
            wrench: Wrench::ZERO,
            felt: false,
            ..*self
        }
    }

    /// Carries out the action; `None` if there is nothing more to write.
    fn done(
        &self,
        duty: Duty,
        (first, redirected): (Option<&Motions>, Redirected<'_>),
        motions: &mut Motions,
    ) -> Result<Option<Kicked>, Faster> {
        let kicked = match (first, duty) {
            (Some(first), duty) => self.second(duty, (first, redirected), motions),
            (None, Duty::Inner(plan)) => {
                motions.settled.push(self.body.handle);
                motions.inner.push(Start::new(self.place, plan, self.wake));
                None
            }
            (None, _) if matches!(duty, Duty::ByForce) || self.is_loaded() => {
                let wrench = self.load(duty, motions);
                self.lend(wrench, motions)?;
                None
            }
            (None, duty) => self.first(duty, motions),
        };
        let Some((update, twist)) = kicked else {
            return Ok(None);
        };
        let speed = update.linvel.length();
        if !(speed <= FASTEST && update.angvel.length() <= FASTEST) {
            return Err(Faster(speed));
        }
        let wake = self.wake;
        Ok(Some((VelocityUpdate { wake, ..update }, twist)))
    }

    /// Adds a load, which Rapier applies as a force during its step.
    fn lend(&self, wrench: Wrench, motions: &mut Motions) -> Result<(), Faster> {
        let (context, body) = (self.context, self.body);
        if wrench == Wrench::ZERO && !self.wake {
            return Ok(());
        }
        let load = Load::new(body, wrench, self.wake, context.dt);
        if !load.is_bearable(body, context.rules.gravity) {
            return Err(Faster(load.speeds[0]));
        }
        motions.loads.push(load);
        Ok(())
    }

    /// The first half for a free body; `None` if there is nothing to write.
    fn first(&self, duty: Duty, motions: &mut Motions) -> Option<Kicked> {
        let (context, body) = (self.context, self.body);
        let twice = context.rules.scheme.kicks_twice();
        let (duration, implicit) = match duty {
            Duty::Implicit(duration) => (duration, true),
            Duty::Kick(duration) => (duration, false),
            _ => return None,
        };
        if implicit {
            motions.settled.push(body.handle);
        }
        let free = context.free_motion(body);
        let solved = match implicit {
            true => self.implicit(&free.pull(body), duration),
            false => self.solved(Some(&free), duration),
        };
        let felt = solved.is_some() || self.wrench != Wrench::ZERO;
        let spins = context.turns() && body.angvel != Vector::ZERO;
        if !felt && !self.wake && !spins {
            return None;
        }
        // Symplectic Euler is kept plain, as a reference for comparisons.
        let compared = !twice && solved.is_none();
        if !felt || compared || free.is_none() {
            return Some(solved.unwrap_or_else(|| self.plain(self.wrench, duration)));
        }
        let (mut update, twist) = solved.unwrap_or_else(|| free.along(body, self.wrench, duration));
        let linvel = update.linvel;
        update.linvel = free.given(linvel);
        if twice && !implicit {
            motions.free.push(body.handle);
        } else {
            motions.means.push(MeanVelocity {
                body: body.handle,
                expected: free.arrives(update.linvel),
                linvel,
                damped: false,
                given: None,
                behind: Vector::ZERO,
            });
        }
        Some((update, twist))
    }

    /// The second half; `None` if there is nothing to write.
    fn second(
        &self,
        duty: Duty,
        (first, redirected): (&Motions, Redirected<'_>),
        motions: &mut Motions,
    ) -> Option<Kicked> {
        let (context, body) = (self.context, self.body);
        let load = first.load(body.handle);
        let (duration, implicit) = match duty {
            Duty::Implicit(duration) => (duration, true),
            Duty::Kick(duration) => (duration, false),
            _ => return None,
        };
        let motion = context.free_motion(body);
        let free = find(&first.free, body.handle).map(|_| &motion);
        let solved = match implicit {
            true => {
                let pull = free.map_or(Besides::default(), |free| free.pull(body));
                self.implicit(&pull, duration)
            }
            false => self.solved(free, duration),
        };
        let held = context.is_held(body);
        let felt = motion.second(self.wrench, load, held);
        let correction = redirected.correction(self.place, body.handle, self.wrench);
        let correction = correction.filter(|_| self.felt);
        let felt = match correction {
            Some(correction) if load.is_none() => felt.plus(correction),
            _ => felt,
        };
        let given = first.given(body.handle);
        let taken_back = free
            .filter(|_| held)
            .map(|free| free.taken_back(body, given, self.wrench, duration));
        let true_after = !held && (solved.is_some() || self.wrench != Wrench::ZERO);
        let lag = motion.catches_up(free.is_some(), true_after);
        motions.outdated |= solved
            .as_ref()
            .is_some_and(|(update, _)| self.outdates(update));
        if true_after && !motion.is_none() {
            motions.ahead.push(body.handle);
        }
        let still = felt == Wrench::ZERO && lag == Vector::ZERO && free.is_none();
        if still && solved.is_none() && !self.wake {
            return None;
        }
        let (mut update, twist) = solved.unwrap_or_else(|| match free {
            Some(free) => free.along(body, felt, duration),
            None => self.plain(felt, duration),
        });
        update.linvel += lag;
        update.linvel -= taken_back.unwrap_or_default();
        Some((update, twist))
    }

    /// Returns true if the body is held, and is to be pushed by a force during Rapier's step.
    fn is_loaded(&self) -> bool {
        let loads = self.context.rules.scheme.loads() || self.coupling().is_some();
        loads && self.context.is_held(self.body)
    }

    /// The load for a body that is held, or that is pushed by forces.
    fn load(&self, duty: Duty, motions: &mut Motions) -> Wrench {
        let (context, body, dt) = (self.context, self.body, self.context.dt);
        // Gravity acts besides the load, and so do the contacts and joints that hold the body.
        let free = !context.is_held(body);
        let reactions = context.rules.reactions;
        let besides = match reactions.and_then(|known| known.on(body)) {
            _ if free => context.free_motion(body).pull(body),
            known => known.unwrap_or_default(),
        };
        let solved = match duty {
            Duty::Implicit(duration) => self.implicit(&besides, duration),
            _ => self.solved(None, dt),
        };
        // Only a plain load is completed by a second half.
        if solved.is_some() || !matches!(duty, Duty::Kick(_)) {
            motions.settled.push(body.handle);
        }
        if solved.is_some() && context.rules.scheme.kicks_twice() && matches!(duty, Duty::Kick(_)) {
            motions.sloped.push(body.handle);
        }
        let all = match solved {
            Some((update, _)) if matches!(duty, Duty::Implicit(_)) => {
                Some(Load::making(body, &update, dt))
            }
            Some(_) => self.mean(&besides, dt),
            None => None,
        };
        let Some(all) = all else {
            return self.wrench;
        };
        let load = all.plus(besides.as_wrench().times(-1.0));
        if !free {
            motions.react(context, body, &load);
        }
        load
    }

    fn plain(&self, wrench: Wrench, duration: Real) -> Kicked {
        let twist = to_dvec3(wrench.torque * duration);
        (kicked(self.body, wrench, duration), twist)
    }

    /// The derivative of its force by its velocities, if fields that read them act on it.
    fn coupling(&self) -> Option<&Coupling> {
        let coupling = self.evaluation.couplings.get(self.place)?.as_ref();
        coupling.filter(|_| self.felt)
    }

    /// The mean over a kick of everything that changes the momentum, if the force reads velocities.
    fn mean(&self, besides: &Besides, duration: Real) -> Option<Wrench> {
        let (coupling, mobility) = (self.coupling()?, Mobility::of(self.body));
        let here = coupling.at(&velocities(self.body));
        let mean = coupling.mean(&mobility, &here, besides, to_f64(duration))?;
        let (force, torque) = rounded(&mean);
        Some(Wrench { force, torque })
    }

    /// A kick that is solved for the velocities, if the force reads them.
    fn solved(&self, free: Option<&FreeMotion>, duration: Real) -> Option<Kicked> {
        let (coupling, mobility) = (self.coupling()?, Mobility::of(self.body));
        let besides = free.map_or(Besides::default(), |free| free.besides(self.body));
        let now = velocities(self.body);
        let (here, duration) = (coupling.at(&now), to_f64(duration));
        let impulse = coupling.mean(&mobility, &here, &besides, duration)? * duration;
        let change = mobility.apply(&impulse);
        let (now, change) = (pair(&now), pair(&change));
        let now = six(stopped(now.0, change.0), stopped(now.1, change.1));
        Some((self.updated(&now), pair(&impulse).1))
    }

    /// Returns true if the force has changed much with the velocities, so that its slope alone does not suffice for the
    /// next kick.
    fn outdates(&self, update: &VelocityUpdate) -> bool {
        let Some(coupling) = self.coupling() else {
            return false;
        };
        let after = six(to_dvec3(update.linvel), to_dvec3(update.angvel));
        let here = coupling.at(&velocities(self.body));
        (coupling.at(&after) - here).norm() > OUTDATED * here.norm()
    }

    /// A linearly implicit kick, and the change of the angular momentum of a free top; `None` if
    /// there is no Jacobian for it.
    fn implicit(&self, besides: &Besides, duration: Real) -> Option<Kicked> {
        let (context, body) = (self.context, self.body);
        let estimate = self.evaluation.estimate(self.place);
        let estimate = estimate.filter(|_| self.felt)?;
        let now = velocities(body);
        let wrench = self
            .coupling()
            .map_or(of_wrench(self.wrench), |it| it.at(&now));
        let change = implicit_change(
            &Mobility::of(body),
            &estimate.jacobian,
            &(wrench + besides.pull),
            &now,
            to_f64(duration),
        )?;
        // Where no field acts, gravity is left to Rapier.
        let idle = estimate.jacobian.is_zero() || change.iter().all(|x| *x == 0.0);
        if self.wrench == Wrench::ZERO && idle {
            return None;
        }
        let update = self.updated(&(now + change));
        let top = body.free_top(update.angvel, context.rules.exact_turns);
        let twist = top.map_or(DVec3::ZERO, |inertia| {
            inertia.angular_momentum(to_dquat(body.pose.rotation), pair(&change).1)
        });
        Some((update, twist))
    }

    fn updated(&self, velocities: &Vector6<f64>) -> VelocityUpdate {
        let (linvel, angvel) = pair(velocities);
        VelocityUpdate {
            body: self.body.handle,
            linvel: from_dvec3(linvel),
            angvel: from_dvec3(angvel),
            spins: false,
            wake: false,
        }
    }
}
