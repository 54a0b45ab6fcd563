//! Loads: forces on bodies that Rapier's solver holds, by contacts or joints.
//!
//! An impulse before Rapier's step acts entirely in the first of its iterations, and leaves a contact unloaded in the
//! others, so bodies held by friction creep. So these forces are applied like gravity in Rapier, spread over the
//! iterations. The map stays that of kick-drift-kick if the velocity that Rapier works with lags behind the true one by
//! half an iteration of the force. Rapier's velocity is the one shown to users, since it is zero for a resting body.

use super::StepContext;
use super::free_motion::FreeMotion;
use super::motion::Completion;
use crate::math::{DVec3, Vector, to_dvec3, to_f64};
use crate::rigid::{Body, Lookup, Wrench};

impl<W: Lookup> StepContext<'_, W> {
    /// Returns true if Rapier's solver holds a body.
    pub(super) fn is_held(&self, body: &Body) -> bool {
        self.rules.held.contains(body.handle)
    }
}

/// The time by which the velocity of a held and loaded body lags; zero if any field reads velocities. `None` if the
/// body is not held.
pub(super) fn lag(context: &StepContext<'_, impl Lookup>, body: &Body) -> Option<f64> {
    let reads = context.compiled.reads_velocity;
    let half = half_iteration(context, body);
    context
        .is_held(body)
        .then_some(if reads { 0.0 } else { half })
}

/// The time by which the velocity of a body on which no field acts lags under Rapier's own pull, because Rapier moves
/// it. `None` if a field acts on it, or any field reads velocities.
pub(super) fn own_lag(
    context: &StepContext<'_, impl Lookup>,
    body: &Body,
    wrench: Wrench,
) -> Option<f64> {
    let own = wrench == Wrench::ZERO && !context.compiled.reads_velocity;
    own.then(|| half_iteration(context, body))
}

fn half_iteration(context: &StepContext<'_, impl Lookup>, body: &Body) -> f64 {
    0.5 * to_f64(context.dt) * to_f64(context.free_motion(body).iteration)
}

/// The acceleration of a body apart from fields: by Rapier's gravity and the user's force, and, if it is held and any
/// field reads velocities, by contacts and joints.
pub(super) fn all_else(context: &StepContext<'_, impl Lookup>, body: &Body) -> DVec3 {
    if !context.compiled.reads_velocity || !context.is_held(body) {
        return to_dvec3(context.free_motion(body).own);
    }
    let known = context
        .rules
        .reactions
        .and_then(|known| known.of(body.handle)?.steady(body));
    known.map_or(DVec3::ZERO, |[linear, _]| to_dvec3(linear))
}

/// The first half of a body's kick, before Rapier's step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Before {
    /// The part of its motion that was left, if it was not a plain second half.
    pub completion: Option<Completion>,
    pub load: Option<Wrench>,
    /// The velocity that Rapier was given; read for held bodies only.
    pub given: Option<Vector>,
    /// The correction of the wrench for an impact within the step.
    pub correction: Option<Wrench>,
}

impl Before {
    /// Returns true if its kick contained Rapier's own pull.
    pub(crate) fn is_free(&self) -> bool {
        self.completion.is_some_and(Completion::is_free)
    }
}

impl FreeMotion {
    /// The wrench for the second half of a step, on a body with `load` in the first: the wrench after Rapier's step,
    /// without the part by which the shown velocity of a held body lags.
    pub(super) fn second(&self, wrench: Wrench, load: Option<Wrench>, held: bool) -> Wrench {
        if held && load == Some(wrench) {
            return Wrench::ZERO;
        }
        let behind = self.iteration;
        let share = if held { 1.0 - behind } else { 1.0 };
        let had = load.unwrap_or(Wrench::ZERO).times(behind - 1.0);
        wrench.times(share).plus(had)
    }

    /// The part of a change of the load over a step that acts at its end.
    pub(super) fn completes(&self, change: Wrench, loaded: bool) -> Wrench {
        let share = if loaded { 1.0 - self.iteration } else { 1.0 };
        change.times(share)
    }

    /// The change from the velocity that Rapier works with to the true one, or back.
    pub(crate) fn catches_up(&self, was_true: bool, is_true: bool) -> Vector {
        match (was_true, is_true) {
            (true, false) => -self.lag(),
            (false, true) => self.lag(),
            _ => Vector::ZERO,
        }
    }
}
