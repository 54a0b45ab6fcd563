//! The motions of bodies in one half of a step, which the bridge writes.

use super::balance::EnergyBalance;
use super::coupling::LinearisedWrench;
use super::fault::Fault;
use super::plan::StepPlan;
use super::rate_estimate::RateEstimate;
use super::reaction::{Loaded, Reactions};
use crate::math::{DVec3, Real, RigidBodyHandle, Vector, from_dvec3, to_dquat, to_dvec3};
use crate::rigid::{Body, PrincipalInertia, Wrench, find_by, find_next, sort_by_body};

/// The largest speed whose square is finite.
#[cfg(feature = "f32")]
pub(crate) const FASTEST: Real = 1.8e19;
/// The largest speed whose square is finite.
#[cfg(feature = "f64")]
pub(crate) const FASTEST: Real = 1.3e154;

/// The error that the speed of a body, given here, would be beyond the limit.
pub(crate) struct Faster(pub(super) Real);

/// Returns an error if new velocities are not finite, or beyond the limit.
pub(super) fn bearable(update: VelocityUpdate) -> Result<VelocityUpdate, Faster> {
    let speed = update.linvel.length();
    let bears = speed <= FASTEST && update.angvel.length() <= FASTEST;
    bears.then_some(update).ok_or(Faster(speed))
}

/// New velocities and loads of bodies, not yet written, and the rotations and paths that Rapier carries out with them.
#[derive(Debug, Default)]
pub(crate) struct Motions {
    // These four are in the order of the handles of their bodies.
    pub updates: Vec<VelocityUpdate>,
    pub turns: Vec<SteadyTurn>,
    pub means: Vec<MeanVelocity>,
    pub loads: Vec<Load>,
    /// Bodies whose motion is not completed by a plain kick, in the order of their handles.
    pub completions: Vec<BodyCompletion>,
    /// The forces on loaded bodies, where they read velocities.
    slopes: Vec<LinearisedWrench>,
    /// True if any of them bounced.
    pub bounced: bool,
    /// The record of loaded bodies whose forces read velocities, for the next step.
    pub reactions: Reactions,
    /// True if a force that reads velocities has changed much by the kicks.
    pub outdated: bool,
    /// Of the bodies that were moved within the step and hit in it, the one with the largest relative error of its
    /// speed, and that error.
    pub worst_hit: Option<(RigidBodyHandle, f64)>,
    /// Motions that cannot be given to Rapier; they are in none of the other lists.
    pub faults: Vec<Fault>,
    /// Bodies that are to be moved within the step.
    pub(super) inner: Vec<Start>,
    /// In the order of the handles of their bodies.
    pub(super) resolved: Vec<Resolved>,
}

/// The part of a body's motion that is left after a half of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyCompletion {
    pub body: RigidBodyHandle,
    pub completion: Completion,
}

/// See [`BodyCompletion`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Completion {
    /// It gets no second half of a kick.
    Completed,
    /// It is loaded with the mean of a force that reads velocities, with this number in [`Motions::slopes`], and gets
    /// only the effect of that force's change.
    Sloped(usize),
    /// Its second half is completed with [`FreeMotion`](super::FreeMotion).
    Free,
    /// It was moved within the step, and Rapier changed its velocity in the meantime. It has the velocity of the middle
    /// of the step, and gets the second half of a kick at its present place, as a free body.
    Bounced,
    /// It ends the second half with its true velocity, where Rapier's lags.
    TimeCentred,
}

impl Completion {
    /// Returns true if the body is completed with [`FreeMotion`](super::FreeMotion).
    pub(crate) fn is_free(self) -> bool {
        matches!(self, Completion::Free | Completion::Bounced)
    }

    /// Returns true if the body gets no second half of a kick.
    pub(crate) fn is_completed(self) -> bool {
        matches!(self, Completion::Completed | Completion::Sloped(_))
    }
}

/// A body that is to be moved within the step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// The place among the sampled bodies.
    pub place: usize,
    pub plan: StepPlan,
    pub wake: bool,
    /// True if it is at rest: its path does not show the stiffness of a field that comes to it.
    pub rests: bool,
    /// The velocity of the frame in which its path is looked at.
    pub drift: DVec3,
    /// True if its path does not show all of its stiffness, and Jacobians do.
    pub is_linearised: bool,
    /// The square of the highest frequency that the last plan has shown, and its [length](StepPlan::length).
    shown: Option<(f64, f64)>,
    /// The number of refinements in a row in which that square has grown as the inverse of the length.
    grew: u32,
    /// The finest plan, if it did not meet the tolerance, and the square of the speed with which it ended.
    fallback: Option<(StepPlan, f64)>,
    /// The balance before this step.
    pub balance: EnergyBalance,
    /// The balance over this step, by its plan; `None` if it is not known.
    pub gained: Option<EnergyBalance>,
}

/// The number of refinements that distinguish the secant of a force that jumps from that of a steep one.
const GREW: u32 = 2;

impl Start {
    pub fn new(place: usize, plan: StepPlan, wake: bool) -> Self {
        Start {
            place,
            plan,
            wake,
            rests: false,
            drift: DVec3::ZERO,
            is_linearised: false,
            shown: None,
            grew: 0,
            fallback: None,
            balance: EnergyBalance::default(),
            gained: None,
        }
    }

    /// If no plan meets the tolerance: tries the whole step, the plain scheme, and then takes it or the finest plan,
    /// whichever ends with the smaller `speed2`, the square of a speed.
    pub fn give_up(&mut self, speed2: f64) {
        match self.fallback {
            None => {
                self.fallback = Some((self.plan, speed2));
                self.plan = StepPlan::WHOLE;
            }
            Some((plan, less)) if less < speed2 && self.plan == StepPlan::WHOLE => self.plan = plan,
            Some(_) => {}
        }
    }

    pub fn has_given_up(&self) -> bool {
        self.fallback.is_some()
    }

    /// Records the stiffness that the plan has shown.
    pub fn look(&mut self, path_rate: RateEstimate) {
        let now = (path_rate.omega2, self.plan.length());
        if let Some((was, drift)) = self.shown.replace(now) {
            let growth = now.0 / was / (drift / now.1);
            // The secant of a singular force grows faster; that of a steep one stays.
            let jumps = (0.7..1.5).contains(&growth);
            self.grew = if jumps { self.grew + 1 } else { 0 };
        }
    }

    /// Returns true if the stiffness is that of an edge: for a force that jumps the secant grows with each refinement,
    /// and no plan is fine enough.
    pub fn edge(&self) -> bool {
        self.grew >= GREW
    }
}

/// The result for a body that was moved within a step by a scheme that chooses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Resolved {
    pub body: RigidBodyHandle,
    pub(super) path_rate: RateEstimate,
    /// Over this step and those before.
    pub(super) balance: EnergyBalance,
    /// The relative error with which it was moved.
    pub(super) error: f64,
}

/// New velocities of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VelocityUpdate {
    pub body: RigidBodyHandle,
    pub linvel: Vector,
    pub angvel: Vector,
    /// True if Rapier's gyroscopic term is to stay off during the step.
    pub spins: bool,
    pub wake: bool,
}

/// A wrench that Rapier spreads over its step, on top of the user's own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Load {
    pub body: RigidBodyHandle,
    pub wrench: Wrench,
    pub wake: bool,
    /// The speed and the angular speed after the step if nothing holds the body.
    pub speeds: [Real; 2],
}

/// A rotation that Rapier carries out at constant angular velocity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SteadyTurn {
    pub body: RigidBodyHandle,
    pub after: TurnAfter,
    /// The inertia with which the rotation was computed: if the mass or a shape of the body was changed before, Rapier
    /// recomputes it within its step.
    pub inertia: PrincipalInertia,
    /// The angular impulse of fields with which it begins.
    pub twist: DVec3,
    /// True if Rapier's gyroscopic term was on, and is to be turned on again.
    pub gyroscopic: bool,
    /// True if Rapier's damping is included.
    pub damped: bool,
    /// The angular velocity that Rapier was given; it differs after the step if something pushed the body.
    pub steady: Vector,
}

/// The rotation of a body at the end of a step without interference.
#[derive(Clone, Copy, Debug)]
pub(crate) enum TurnAfter {
    /// As a free top of this angular momentum, in the world.
    Momentum(DVec3),
    /// With this angular velocity.
    Velocity(DVec3),
}

/// A path that Rapier carries out at its mean velocity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeanVelocity {
    pub body: RigidBodyHandle,
    /// The velocity at the end of Rapier's step without interference, before damping.
    pub expected: Vector,
    /// The true velocity that the body then has.
    pub linvel: Vector,
    /// True if Rapier's damping is included.
    pub damped: bool,
    /// The velocity that Rapier was given, if the body was moved within the step.
    pub given: Option<Vector>,
    /// The lag of the shown velocity of a loaded body behind the true one.
    pub behind: Vector,
}

/// The velocities of a body after Rapier's step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrived {
    pub linvel: Vector,
    pub angvel: Vector,
    /// The factors by which Rapier's damping scales the linear and the angular velocity.
    pub kept: [Real; 2],
    /// True if the user's torque, which Rapier applies, changes the angular velocity.
    pub is_twisted: bool,
}

/// Relative changes of a velocity below this are Rapier's rounding over its iterations.
const ROUNDING: Real = 64.0 * Real::EPSILON;

impl MeanVelocity {
    /// Returns true if the body was moved within the step, and Rapier has changed its velocity apart from damping,
    /// which scales it by `kept`.
    fn is_changed(&self, arrived: Vector, kept: Real) -> bool {
        let fastest = self
            .given
            .map(|given| given.length().max(self.expected.length()));
        let off = (arrived - self.expected * kept).length();
        fastest.is_some_and(|fastest| off > ROUNDING * fastest)
    }
}

impl SteadyTurn {
    /// As [`MeanVelocity::is_changed`].
    fn is_changed(&self, arrived: Vector, kept: Real) -> bool {
        (arrived - self.steady * kept).length() > ROUNDING * self.steady.length()
    }
}

impl Motions {
    pub(crate) fn clear(&mut self) {
        self.updates.clear();
        self.turns.clear();
        self.means.clear();
        self.loads.clear();
        self.completions.clear();
        self.slopes.clear();
        self.bounced = false;
        self.reactions.clear();
        self.outdated = false;
        self.worst_hit = None;
        self.faults.clear();
        self.inner.clear();
        self.resolved.clear();
    }

    /// Records the part of a body's motion that is left; bodies come in the order of their handles.
    pub(crate) fn complete_by(&mut self, body: RigidBodyHandle, completion: Completion) {
        self.completions.push(BodyCompletion { body, completion });
    }

    /// Records the force with whose mean a body is loaded.
    pub(super) fn keep_slope(&mut self, force: LinearisedWrench) -> Completion {
        self.slopes.push(force);
        Completion::Sloped(self.slopes.len() - 1)
    }

    /// The force with whose mean a body was loaded, if its completion says so.
    pub(crate) fn slope(&self, completion: Option<Completion>) -> Option<&LinearisedWrench> {
        match completion? {
            Completion::Sloped(number) => self.slopes.get(number),
            _ => None,
        }
    }

    /// The part of a body's motion that is left, if it is recorded.
    pub(crate) fn completion(&self, body: RigidBodyHandle) -> Option<Completion> {
        let place = find_by(&self.completions, body, |it| it.body)?;
        Some(self.completions[place].completion)
    }

    /// [`Self::completion`] for calls in the order of handles; `at` is the position in the list, zero at first.
    pub(crate) fn next_completion(
        &self,
        at: &mut usize,
        body: RigidBodyHandle,
    ) -> Option<Completion> {
        find_next(&self.completions, at, body, |it| it.body).map(|it| it.completion)
    }

    /// Removes the motion of `body` if it is the last one added, but not its completion.
    pub(super) fn drop_last(&mut self, body: RigidBodyHandle) {
        self.updates.pop_if(|it| it.body == body);
        self.turns.pop_if(|it| it.body == body);
        self.means.pop_if(|it| it.body == body);
        self.loads.pop_if(|it| it.body == body);
        self.resolved.pop_if(|it| it.body == body);
    }

    /// The velocity that Rapier was given for a body.
    pub(crate) fn given(&self, body: RigidBodyHandle) -> Option<Vector> {
        let place = find_by(&self.updates, body, |update| update.body)?;
        Some(self.updates[place].linvel)
    }

    /// The load on a body in the first half of the step.
    pub(crate) fn load(&self, body: RigidBodyHandle) -> Option<Wrench> {
        let place = find_by(&self.loads, body, |load| load.body)?;
        Some(self.loads[place].wrench)
    }

    /// Records the error of a body's speed after a hit, if it is the largest.
    pub(super) fn note_hit(&mut self, body: RigidBodyHandle, error: f64) {
        let worse = |(_, worst): (_, f64)| error.is_nan() || error > worst;
        if self.worst_hit.is_none_or(worse) {
            self.worst_hit = Some((body, error));
        }
    }

    /// Records a load on a held body, where forces read velocities; `known` is the record of the last step.
    pub(super) fn react(&mut self, known: Option<&Loaded>, body: &Body, load: &Wrench, dt: Real) {
        if dt > 0.0 {
            let then = kicked(body, *load, dt);
            let loaded = [then.linvel, then.angvel];
            self.reactions.add(known, body, loaded, dt);
        }
    }

    /// Sorts the lists that are searched by handle.
    pub(super) fn sort(&mut self) {
        self.reactions.sort();
        sort_by_body(&mut self.loads, |load| load.body);
        sort_by_body(&mut self.updates, |update| update.body);
        sort_by_body(&mut self.turns, |turn| turn.body);
        sort_by_body(&mut self.means, |mean| mean.body);
        sort_by_body(&mut self.resolved, |known| known.body);
    }

    /// Finds the free bodies that were moved within the step and whose velocities Rapier changed. `arrives` returns the
    /// velocities of those that are awake.
    ///
    /// Rapier moved such a body at the mean velocity of its path, so after a contact it has the velocity of the middle
    /// of the step, as in kick-drift-kick. Adding the change to the velocity at the end instead takes energy in or out
    /// at each bounce, by the work of half a step.
    pub(crate) fn note_bounces(&mut self, arrives: impl Fn(RigidBodyHandle) -> Option<Arrived>) {
        for mean in self.means.iter().filter(|mean| mean.given.is_some()) {
            if self.load(mean.body).is_none()
                && let Some(now) = arrives(mean.body)
                && self.is_changed(mean, &now)
                && let Some(place) = find_by(&self.completions, mean.body, |it| it.body)
            {
                self.completions[place].completion = Completion::Bounced;
                self.bounced = true;
            }
        }
    }

    /// Returns true if Rapier has changed the velocities of a body apart from damping.
    fn is_changed(&self, mean: &MeanVelocity, now: &Arrived) -> bool {
        let turn = find_by(&self.turns, mean.body, |turn| turn.body);
        let turn = turn.map(|place| &self.turns[place]);
        let turn = turn.filter(|_| !now.is_twisted);
        mean.is_changed(now.linvel, now.kept[0])
            || turn.is_some_and(|turn| turn.is_changed(now.angvel, now.kept[1]))
    }

    /// Returns true if Rapier has changed the velocity of a body that was moved within the step.
    pub(crate) fn has_bounced(&self, body: RigidBodyHandle) -> bool {
        self.bounced && self.completion(body) == Some(Completion::Bounced)
    }

    /// The result for a body that was moved within the step.
    pub(super) fn resolved(&self, body: RigidBodyHandle) -> Option<&Resolved> {
        let place = find_by(&self.resolved, body, |known| known.body)?;
        Some(&self.resolved[place])
    }

    /// The velocity with which a body arrives that moves at its mean velocity.
    pub(crate) fn arrival(&self, body: RigidBodyHandle) -> Option<Vector> {
        let place = find_by(&self.means, body, |mean| mean.body)?;
        Some(self.means[place].linvel)
    }
}

impl Load {
    pub(crate) fn new(body: &Body, wrench: Wrench, wake: bool, dt: Real) -> Self {
        let then = kicked(body, wrench, dt);
        Load {
            body: body.handle,
            wrench,
            wake,
            speeds: [then.linvel.length(), then.angvel.length()],
        }
    }

    /// Returns true if the load is finite together with the user's force and gravity, to which Rapier adds it before
    /// applying the sum.
    pub(super) fn adds_up(&self, body: &Body, gravity: Vector) -> bool {
        let weight = gravity * (body.gravity_scale * body.mass);
        let force = self.wrench.force + body.user_force + weight;
        let torque = self.wrench.torque + body.user_torque;
        force.is_finite() && torque.is_finite()
    }

    /// Returns true if Rapier can apply the load without an overflow.
    pub(crate) fn is_bearable(&self, body: &Body, gravity: Vector) -> bool {
        let slow = |speed: Real| speed <= FASTEST;
        self.speeds.into_iter().all(slow) && self.adds_up(body, gravity)
    }

    /// The wrench that changes a body's velocities to those of `update` within a step.
    pub(super) fn making(body: &Body, update: &VelocityUpdate, dt: Real) -> Wrench {
        let attitude = to_dquat(body.pose.rotation);
        let turn = to_dvec3(update.angvel - body.angvel);
        let inertia = body.inertia();
        let twist = inertia.map_or(DVec3::ZERO, |it| it.angular_momentum(attitude, turn));
        Wrench {
            force: (update.linvel - body.linvel) * (body.mass / dt),
            torque: from_dvec3(twist) / dt,
        }
    }
}

/// The velocities of a body after a wrench has acted for `duration`.
pub(crate) fn kicked(body: &Body, wrench: Wrench, duration: Real) -> VelocityUpdate {
    let twist = body.inv_inertia * (wrench.torque * duration);
    VelocityUpdate {
        body: body.handle,
        linvel: body.linvel + wrench.force * duration * body.inv_mass,
        angvel: body.angvel + twist,
        spins: false,
        wake: false,
    }
}
