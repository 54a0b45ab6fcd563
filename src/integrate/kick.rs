//! The kick of one body, before or after Rapier's step.

use super::StepContext;
use super::begun::BegunBody;
use super::coupling::{Besides, LinearisedWrench};
use super::evaluation::Evaluation;
use super::free_motion::FreeMotion;
use super::implicit::implicit_change;
use super::method::Method;
use super::motion::{Completion, Faster, Load, Motions, Start, VelocityUpdate, bearable, kicked};
use crate::math::{DVec3, Real, Vector, from_dvec3, to_dquat, to_dvec3, to_f64};
use crate::number::{constant, real};
use crate::rapier::na::Vector6;
use crate::rigid::{
    Body, Lookup, Mobility, Wrench, of_wrench, pair, rounded, six, stopped, velocities,
};

/// A force that a kick has changed by more than this share is evaluated again in the next step: for one that grows with
/// the square of the speed, the slope alone would be off by a quarter of the share's square, 2.5e-3.
const OUTDATED: f64 = 0.1;

/// New velocities of a body, and the angular impulse that is part of them.
pub(super) type Kicked = (VelocityUpdate, DVec3);

/// A body that is kicked.
pub(super) struct Kick<'a, W> {
    pub context: &'a StepContext<'a, W>,
    pub evaluation: &'a Evaluation,
    /// Set in the second half.
    pub begun: Option<BegunBody<'a>>,
    pub place: usize,
    pub body: &'a Body,
    pub wrench: Wrench,
    pub wake: bool,
    /// False if fields are left out.
    pub felt: bool,
}

impl<W: Lookup> Kick<'_, W> {
    /// This kick without fields.
    pub(super) fn unfelt(&self) -> Self {
        Kick {
            wrench: Wrench::ZERO,
            felt: false,
            ..*self
        }
    }

    /// Carries out the action; `None` if there is nothing more to write.
    pub(super) fn done(
        &self,
        method: Method,
        motions: &mut Motions,
    ) -> Result<Option<Kicked>, Faster> {
        let kicked = match (self.begun, method) {
            (Some(begun), method) => self.second(method, begun, motions),
            (None, Method::Inner(plan)) => {
                motions.complete_by(self.body.handle, Completion::Settled);
                motions.inner.push(Start::new(self.place, plan, self.wake));
                None
            }
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
    fn first(&self, method: Method, motions: &mut Motions) -> Option<Kicked> {
        let (context, body) = (self.context, self.body);
        let twice = context.rules.scheme.kicks_twice();
        let (duration, implicit) = method.kick()?;
        if implicit {
            motions.complete_by(body.handle, Completion::Settled);
        }
        // A single kick leaves damping to Rapier.
        let free = match context.free_motion(body) {
            free if twice => free,
            free => free.undamped(),
        };
        let solved = if implicit {
            self.implicit(&free.pull(body), duration)
        } else {
            self.solved(Some(&free), duration)
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
            motions.complete_by(body.handle, Completion::Free);
        } else {
            motions.means.push(free.carried_out(body.handle, linvel));
        }
        Some((update, twist))
    }

    /// The second half; `None` if there is nothing to write.
    fn second(
        &self,
        method: Method,
        begun: BegunBody<'_>,
        motions: &mut Motions,
    ) -> Option<Kicked> {
        let (context, body, first) = (self.context, self.body, begun.step.motions);
        let load = first.load(body.handle);
        let (duration, implicit) = method.kick()?;
        let motion = context.free_motion(body);
        let free = begun
            .completion
            .is_some_and(Completion::is_free)
            .then_some(&motion);
        let solved = if implicit {
            let pull = free.map_or(Besides::default(), |free| free.pull(body));
            self.implicit(&pull, duration)
        } else {
            self.solved(free, duration)
        };
        let held = context.is_held(body);
        let felt = motion.second(self.wrench, load, held);
        let correction = begun.step.correction(self.place, body.handle, self.wrench);
        let correction = correction.filter(|_| self.felt);
        let felt = match correction {
            Some(correction) if load.is_none() => felt.plus(correction),
            _ => felt,
        };
        let taken_back = free.filter(|_| held).map(|free| {
            let given = first.given(body.handle);
            free.taken_back(body, given, self.wrench, duration)
        });
        let true_after = !held && (solved.is_some() || self.wrench != Wrench::ZERO);
        let lag = motion.catches_up(free.is_some(), true_after);
        motions.outdated |= solved
            .as_ref()
            .is_some_and(|(update, _)| self.outdates(update));
        if true_after && !motion.is_none() {
            motions.complete_by(body.handle, Completion::Ahead);
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

    /// The load for a body that is held, or that is moved by Rapier's forces.
    fn load(&self, method: Method, motions: &mut Motions) -> Wrench {
        let (context, body, dt) = (self.context, self.body, self.context.dt);
        // Gravity acts besides the load, and so do the contacts and joints that hold the body.
        let free = !context.is_held(body);
        let reactions = context.rules.reactions;
        let besides = match reactions.and_then(|known| known.on(body)) {
            _ if free => context.free_motion(body).pull(body),
            known => known.unwrap_or_default(),
        };
        let solved = match method {
            Method::Implicit(duration) => self.implicit(&besides, duration),
            _ => self.solved(None, dt),
        };
        // Only a plain load is completed by a second half.
        if !matches!(method, Method::Kick(_)) {
            motions.complete_by(body.handle, Completion::Settled);
        } else if solved.is_some() {
            let twice = context.rules.scheme.kicks_twice();
            let completion = if twice {
                Completion::Sloped
            } else {
                Completion::Settled
            };
            motions.complete_by(body.handle, completion);
        }
        let all = match solved {
            Some((update, _)) if matches!(method, Method::Implicit(_)) => {
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

    /// The wrench on the body linearised in its velocities, if fields that read velocities act on it.
    fn coupling(&self) -> Option<&LinearisedWrench> {
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
        let after = |was, more| real(stopped::<f64>(constant(was), constant(more)));
        let now = six(after(now.0, change.0), after(now.1, change.1));
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
