//! Loads: forces on bodies that Rapier's solver holds, by contacts or joints.
//!
//! An impulse before Rapier's step acts whole in the first of its iterations, and leaves a contact
//! unloaded in the others: what friction should hold creeps. So these forces go where Rapier puts
//! gravity, and are spread over the iterations. The map stays that of kick-drift-kick if the
//! velocity that Rapier works with is behind the true one, by half an iteration of the force. That
//! velocity is the one that is shown, since it is zero for what rests.

use super::StepContext;
use super::evaluation::find;
use crate::math::Real;
use crate::rigid::{Body, Lookup, Wrench};

impl<W: Lookup> StepContext<'_, W> {
    /// Whether Rapier's solver holds a body.
    pub(super) fn is_held(&self, body: &Body) -> bool {
        let held = self.rules.held;
        !held.is_empty() && find(held, body.handle).is_some()
    }

    /// The part of a step by half of which the velocity of a held body is behind: one iteration.
    pub(super) fn behind(&self, body: &Body) -> Real {
        let count = body.iterations(self.rules.iterations).max(1);
        (count as Real).recip()
    }

    /// See [`second`].
    pub(super) fn second(&self, body: &Body, wrench: Wrench, load: Option<Wrench>) -> Wrench {
        second(wrench, load, self.is_held(body), self.behind(body))
    }
}

/// What is to act for the second half of a step, on a body with that load in its first half: the
/// wrench after Rapier's step, but for what the velocity that is shown of a held body is `behind` by,
/// in steps.
pub(crate) fn second(wrench: Wrench, load: Option<Wrench>, held: bool, behind: Real) -> Wrench {
    if held && load == Some(wrench) {
        return Wrench::ZERO;
    }
    let share = if held { 1.0 - behind } else { 1.0 };
    let had = load.unwrap_or(Wrench::ZERO).times(behind - 1.0);
    wrench.times(share).plus(had)
}
