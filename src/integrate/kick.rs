//! The kick of one body, before or after Rapier's step.

use super::context::{MotionRules, StepContext};
use super::coupling::{ExternalTerms, LinearisedWrench};
use super::evaluation::Evaluation;
use super::free_motion::FreeMotion;
use super::implicit::implicit_change;
use super::jacobian::Jacobian;
use super::load::Before;
use super::method::Method;
use super::motion::{Completion, Faster, Load, Motions, VelocityUpdate, bearable, kicked};
use super::reaction::Loaded;
use crate::math::{DVec3, Real, Vector, from_dvec3, from_f64, to_dquat, to_dvec3, to_f64};
use crate::number::{constant, real};
use crate::rapier::na::Vector6;
use crate::rigid::{
    Body, Lookup, Mobility, Wrench, of_wrench, pair, rounded, six, stopped, velocities,
};

/// A force that a kick has changed by more than this share is evaluated again in the next step: for one that grows with
/// the square of the speed, the slope alone would be off by a quarter of the share's square, 2.5e-3.
const OUTDATED: f64 = 0.1;

/// New velocities of a body, and the angular impulse that is part of them.
pub(crate) type Kicked = (VelocityUpdate, DVec3);

/// A body that is kicked.
#[derive(Clone, Copy)]
pub(crate) struct Kick<'a> {
    pub rules: &'a MotionRules<'a>,
    pub dt: Real,
    /// True if bodies of unequal inertia are rotated by this crate in the step.
    pub turns: bool,
    pub body: &'a Body,
    /// True if Rapier's solver holds the body.
    pub held: bool,
    pub wrench: Wrench,
    /// The wrench linearised in the velocities, if fields that read them act on the body.
    pub coupling: Option<&'a LinearisedWrench>,
    /// The load of the last step, if the body is held and was loaded then.
    pub loaded: Option<&'a Loaded>,
    /// The derivatives of the wrench, if they are known; used by linearly implicit kicks only.
    pub jacobian: Option<&'a Jacobian>,
    /// Set in the second half.
    pub before: Option<Before>,
    pub wake: bool,
}

impl<'a> Kick<'a> {
    /// The first half of a kick of a sampled body.
    pub(super) fn new(
        context: &'a StepContext<'_, impl Lookup>,
        evaluation: &'a Evaluation,
        place: usize,
    ) -> Self {
        let body = &context.bodies[place];
        let held = context.is_held(body);
        let reactions = context.rules.reactions.filter(|_| held);
        Kick {
            rules: &context.rules,
            dt: context.dt,
            turns: context.turns(),
            body,
            held,
            wrench: evaluation.wrenches[place],
            coupling: evaluation.couplings.get(place).and_then(Option::as_ref),
            loaded: reactions.and_then(|known| known.of(body.handle)),
            jacobian: None,
            before: None,
            wake: false,
        }
    }

    /// This kick without fields.
    pub(super) fn unfelt(&self) -> Self {
        Kick {
            wrench: Wrench::ZERO,
            coupling: None,
            jacobian: None,
            before: self.before.map(|before| Before {
                correction: None,
                ..before
            }),
            ..*self
        }
    }

    /// Carries out the action; `None` if there is nothing more to write.
    pub(crate) fn done(
        &self,
        method: Method,
        motions: &mut Motions,
    ) -> Result<Option<Kicked>, Faster> {
        let kicked = match (&self.before, method) {
            (Some(before), method) => self.second(method, before, motions),
            (None, _) if matches!(method, Method::ByForce) || self.is_loaded() => {
                let wrench = self.load(method, motions);
                self.lend(wrench, motions)?;
                None
            }
            (None, method) => self.first(method, motions),
        };
        let Some((update, twist)) = kicked else {
            return Ok(None);
        };
        let (update, wake) = (bearable(update)?, self.wake);
        Ok(Some((VelocityUpdate { wake, ..update }, twist)))
    }

    fn free_motion(&self) -> FreeMotion {
        let MotionRules {
            gravity,
            iterations,
            ..
        } = *self.rules;
        FreeMotion::new(self.body, gravity, iterations, self.dt)
    }

    /// Adds a load, which Rapier applies as a force during its step.
    fn lend(&self, wrench: Wrench, motions: &mut Motions) -> Result<(), Faster> {
        if wrench == Wrench::ZERO && !self.wake {
            return Ok(());
        }
        let load = Load::new(self.body, wrench, self.wake, self.dt);
        if !load.is_bearable(self.body, self.rules.gravity) {
            return Err(Faster(load.speeds[0]));
        }
        motions.loads.push(load);
        Ok(())
    }

    /// The first half for a free body; `None` if there is nothing to write.
    fn first(&self, method: Method, motions: &mut Motions) -> Option<Kicked> {
        let body = self.body;
        let twice = self.rules.scheme.kicks_twice();
        let (duration, implicit) = method.kick()?;
        if implicit {
            motions.complete_by(body.handle, Completion::Completed);
        }
        // A single kick leaves damping to Rapier.
        let free = match self.free_motion() {
            free if twice => free,
            free => free.undamped(),
        };
        let solved = if implicit {
            self.implicit(&free.pull(body), duration)
        } else {
            self.solved(Some(&free), duration)
        };
        let felt = solved.is_some() || self.wrench != Wrench::ZERO;
        let spins = self.turns && body.angvel != Vector::ZERO;
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
            motions.complete_by(body.handle, Completion::Free);
        } else {
            motions.means.push(free.carried_out(body.handle, linvel));
        }
        Some((update, twist))
    }

    /// The second half; `None` if there is nothing to write. A body that is held then, or on which no field acts any
    /// more, gets the velocity that Rapier works with, any other body the true one.
    fn second(&self, method: Method, before: &Before, motions: &mut Motions) -> Option<Kicked> {
        let (body, held, load) = (self.body, self.held, before.load);
        let (duration, implicit) = method.kick()?;
        let motion = self.free_motion();
        let free = before.is_free().then_some(&motion);
        let solved = if implicit {
            let pull = free.map_or(ExternalTerms::default(), |free| free.pull(body));
            self.implicit(&pull, duration)
        } else {
            self.solved(free, duration)
        };
        let felt = motion.second(self.wrench, load, held);
        let felt = match before.correction {
            Some(correction) if load.is_none() => felt.plus(correction),
            _ => felt,
        };
        let taken_back = free
            .filter(|_| held)
            .map(|free| free.taken_back(body, before.given, self.wrench, duration));
        let true_after = !held && (solved.is_some() || self.wrench != Wrench::ZERO);
        let lag = motion.catches_up(free.is_some(), true_after);
        motions.outdated |= solved
            .as_ref()
            .is_some_and(|(update, _)| self.outdates(update));
        if true_after && !motion.is_none() {
            motions.complete_by(body.handle, Completion::TimeCentred);
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

    /// The second half for a body that was loaded with the mean of `was`, a force that reads velocities: the effect of
    /// the force's change over the step, like [`FreeMotion::second`] for forces that read none. The change is taken at
    /// the present velocities, and its effect on them is solved for, so it stays bounded.
    pub(crate) fn end_of_load(
        &self,
        was: &LinearisedWrench,
        loaded: bool,
    ) -> Option<VelocityUpdate> {
        let (coupling, now) = (self.coupling?, velocities(self.body));
        let change = coupling.at(&now) - was.at(&now);
        let (mobility, duration) = (Mobility::of(self.body), 0.5 * to_f64(self.dt));
        let mean = coupling.mean(&mobility, &change, &ExternalTerms::default(), duration)?;
        let (force, torque) = rounded(&mean);
        let felt = self
            .free_motion()
            .completes(Wrench { force, torque }, loaded);
        (felt != Wrench::ZERO).then(|| kicked(self.body, felt, from_f64(duration)))
    }

    /// Returns true if the body is held, and is to be pushed by a force during Rapier's step.
    fn is_loaded(&self) -> bool {
        self.held && (self.rules.scheme.loads() || self.coupling.is_some())
    }

    /// The load for a body that is held, or that is moved by Rapier's forces.
    fn load(&self, method: Method, motions: &mut Motions) -> Wrench {
        let (rules, body, dt) = (self.rules, self.body, self.dt);
        // Gravity acts besides the load, and so do the contacts and joints that hold the body.
        let external = match self.loaded.and_then(|known| known.on(body)) {
            _ if !self.held => self.free_motion().pull(body),
            known => known.unwrap_or_default(),
        };
        let all = match method {
            Method::Implicit(duration) => {
                let solved = self.implicit(&external, duration);
                solved.map(|(update, _)| Load::making(body, &update, dt))
            }
            _ => self.mean(&external, dt),
        };
        // Only a plain load is completed by a second half.
        if !matches!(method, Method::Kick(_)) {
            motions.complete_by(body.handle, Completion::Completed);
        } else if all.is_some() {
            let sloped = self.coupling.filter(|_| rules.scheme.kicks_twice());
            let completion = match sloped {
                Some(coupling) => motions.keep_slope(*coupling),
                None => Completion::Completed,
            };
            motions.complete_by(body.handle, completion);
        }
        let Some(all) = all else {
            return self.wrench;
        };
        let load = all.plus(external.as_wrench().times(-1.0));
        if self.held {
            motions.react(self.loaded, body, &load, dt);
        }
        load
    }

    fn plain(&self, wrench: Wrench, duration: Real) -> Kicked {
        let twist = to_dvec3(wrench.torque * duration);
        (kicked(self.body, wrench, duration), twist)
    }

    /// The mean over a kick of everything that changes the momentum, if the force reads velocities.
    fn mean(&self, external: &ExternalTerms, duration: Real) -> Option<Wrench> {
        let (coupling, mobility) = (self.coupling?, Mobility::of(self.body));
        let here = coupling.at(&velocities(self.body));
        let mean = coupling.mean(&mobility, &here, external, to_f64(duration))?;
        let (force, torque) = rounded(&mean);
        Some(Wrench { force, torque })
    }

    /// A kick that is solved for the velocities, if the force reads them.
    fn solved(&self, free: Option<&FreeMotion>, duration: Real) -> Option<Kicked> {
        let (coupling, mobility) = (self.coupling?, Mobility::of(self.body));
        let external = free.map_or(ExternalTerms::default(), |free| free.external(self.body));
        let now = velocities(self.body);
        let (here, duration) = (coupling.at(&now), to_f64(duration));
        let impulse = coupling.mean(&mobility, &here, &external, duration)? * duration;
        let change = mobility.apply(&impulse);
        let (now, change) = (pair(&now), pair(&change));
        let after = |was, more| real(stopped::<f64>(constant(was), constant(more)));
        let now = six(after(now.0, change.0), after(now.1, change.1));
        Some((self.updated(&now), pair(&impulse).1))
    }

    /// Returns true if the force has changed much with the velocities, so that its slope alone does not suffice for the
    /// next kick.
    fn outdates(&self, update: &VelocityUpdate) -> bool {
        let Some(coupling) = self.coupling else {
            return false;
        };
        let after = six(to_dvec3(update.linvel), to_dvec3(update.angvel));
        let here = coupling.at(&velocities(self.body));
        (coupling.at(&after) - here).norm() > OUTDATED * here.norm()
    }

    /// A linearly implicit kick, and the change of the angular momentum of a free top; `None` if
    /// there is no Jacobian for it.
    fn implicit(&self, external: &ExternalTerms, duration: Real) -> Option<Kicked> {
        let (body, jacobian) = (self.body, self.jacobian?);
        let now = velocities(body);
        let wrench = self
            .coupling
            .map_or(of_wrench(self.wrench), |it| it.at(&now));
        let change = implicit_change(
            &Mobility::of(body),
            jacobian,
            &(wrench + external.pull),
            &now,
            to_f64(duration),
        )?;
        // Where no field acts, gravity is left to Rapier.
        let idle = jacobian.is_zero() || change.iter().all(|x| *x == 0.0);
        if self.wrench == Wrench::ZERO && idle {
            return None;
        }
        let update = self.updated(&(now + change));
        let top = body.free_top(update.angvel, self.rules.exact_turns);
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
