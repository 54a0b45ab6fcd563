//! The check that Rapier made one step between the two halves of a field step, and the record that undoes the first
//! half otherwise.

use super::constrained::Constraints;
use super::restless::Drowsing;
use super::undo::Undo;
use super::world::WorldMut;
use crate::math::{Real, RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::dynamics::{IslandManager, RigidBody};
use crate::rigid::{SMALLEST_TIME, world_com};

/// The bodies that fields wrote to before Rapier's step, and the witnesses by which that step is recognised.
#[derive(Debug, Default)]
pub(crate) struct Stepped {
    pub before: Undo,
    /// Copies of bodies that were quarantined.
    quarantined: Vec<(RigidBodyHandle, RigidBody)>,
    witnesses: Vec<Witness>,
    /// The record of bodies about to fall asleep from before the step.
    pub drowsing: Option<Drowsing>,
}

/// A body as it was before Rapier's step.
#[derive(Debug)]
struct Witness {
    body: RigidBodyHandle,
    /// The time for which it has been slow enough to fall asleep; see [`mark`].
    slow_for: Real,
    centre: Vector,
    linvel: Vector,
}

/// The steps that Rapier made between the two halves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Made {
    /// One step, as far as the witnesses show.
    One,
    None,
    /// Several steps, of this length together.
    More(Real),
}

/// A body that shows whether Rapier has stepped since the mark was set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepMark {
    body: RigidBodyHandle,
    slow_for: Real,
}

impl StepMark {
    /// Marks the first of some bodies that Rapier's step moves; `None` if it moves none of them. The mark depends on
    /// the number of `steps` so far, so that a world put back to an earlier state does not have it.
    pub(crate) fn set(
        bodies: &mut RigidBodySet,
        mut of: impl Iterator<Item = RigidBodyHandle>,
        steps: u64,
    ) -> Option<Self> {
        let body = of.find(|handle| bodies.get(*handle).is_some_and(is_moved))?;
        let slow_for = mark(bodies.get_mut(body)?, steps);
        Some(StepMark { body, slow_for })
    }

    /// Returns true if no step of length `dt` or longer was made since, nor the body removed, woken or put to sleep.
    pub(crate) fn is_untouched(&self, bodies: &RigidBodySet, dt: Real) -> bool {
        let body = bodies.get(self.body).filter(|it| is_moved(it));
        let slow_for = body.map(|it| it.activation().time_since_can_sleep);
        // A step in which the body is woken sets this time to `dt`.
        slow_for == Some(self.slow_for) && self.slow_for != dt && shows(self.slow_for, dt)
    }
}

/// Makes the time for which a body has been slow one that Rapier's next step changes, and returns it. A step resets
/// the time to zero or adds `dt`, so zero is replaced by a time that is lost in the rounding of `dt`.
fn mark(body: &mut RigidBody, number: u64) -> Real {
    let activation = body.activation_mut();
    if activation.time_since_can_sleep <= SMALLEST_TIME {
        let share = (1 + number % MARKS) as Real / MARKS as Real;
        activation.time_since_can_sleep = SMALLEST_TIME * share;
    }
    activation.time_since_can_sleep
}

/// The number of different marks.
const MARKS: u64 = 1 << 16;

/// Returns true if adding `dt` to the time for which a body has been slow changes it.
fn shows(slow_for: Real, dt: Real) -> bool {
    slow_for * 16.0 * Real::EPSILON < dt
}

/// The largest number of witnesses.
const WITNESSES: usize = 8;

/// A body that has moved on for longer than this multiple of `dt` shows several steps; one step of a free body is
/// measured to within an eighth.
const MORE: Real = 1.5;

impl Stepped {
    pub(crate) fn clear(&mut self) {
        self.before.clear();
        self.quarantined.clear();
        self.witnesses.clear();
        self.drowsing = None;
    }

    /// Records bodies that are about to be written to.
    pub(crate) fn note(
        &mut self,
        bodies: &RigidBodySet,
        written: impl Iterator<Item = RigidBodyHandle>,
    ) {
        for handle in written {
            if let Some(body) = bodies.get(handle) {
                self.before.note(handle, body);
            }
        }
    }

    /// Copies bodies that are about to be disabled.
    pub(crate) fn note_quarantined(
        &mut self,
        bodies: &RigidBodySet,
        quarantined: &[RigidBodyHandle],
    ) {
        let copies = quarantined
            .iter()
            .filter_map(|handle| Some((*handle, bodies.get(*handle)?.clone())));
        self.quarantined.extend(copies);
    }

    /// Chooses witnesses among the recorded bodies, evenly spread; if there is none, the first active body that
    /// Rapier's step moves. `anew` is true if bodies may have been added since Rapier's last step.
    pub(crate) fn choose(
        &mut self,
        bodies: &mut RigidBodySet,
        islands: &IslandManager,
        dt: Real,
        anew: bool,
    ) {
        // A step of zero length shows on no body.
        if dt <= 0.0 {
            return;
        }
        let count = self.before.len();
        let every = count.div_ceil(WITNESSES).max(1);
        for number in (0..count).step_by(every) {
            let handle = self.before.body(number);
            self.watch(handle, bodies, dt);
        }
        if self.witnesses.is_empty() {
            let moved = |handle: &RigidBodyHandle| bodies.get(*handle).is_some_and(is_moved);
            let first = islands.active_bodies().find(moved);
            let unseen = || bodies.iter().map(|it| it.0).find(moved);
            if let Some(handle) = first.or_else(|| anew.then(unseen).flatten()) {
                self.watch(handle, bodies, dt);
            }
        }
    }

    /// Adds a witness, if Rapier's step moves it. It is written to only if that step may leave no trace in the time for
    /// which it has been slow: a write makes Rapier sort its contacts anew.
    fn watch(&mut self, handle: RigidBodyHandle, bodies: &mut RigidBodySet, dt: Real) {
        let Some(body) = bodies.get(handle).filter(|it| is_moved(it)) else {
            return;
        };
        let slow_for = body.activation().time_since_can_sleep;
        let mut witness = Witness {
            body: handle,
            slow_for,
            centre: world_com(body),
            linvel: body.linvel(),
        };
        // A step in which the body is woken resets this time and adds `dt`, so a time of `dt` becomes the next larger.
        if slow_for <= SMALLEST_TIME || slow_for == dt || !shows(slow_for, dt) {
            self.before.note(handle, body);
            if let Some(body) = bodies.get_mut(handle) {
                if slow_for == dt {
                    body.activation_mut().time_since_can_sleep = dt * (1.0 + Real::EPSILON);
                }
                witness.slow_for = mark(body, 0);
            }
        }
        self.witnesses.push(witness);
    }

    /// The steps that Rapier has made since [`Self::choose`].
    pub(crate) fn made(&self, world: &WorldMut<'_>, dt: Real) -> Made {
        if self.witnesses.is_empty() {
            return Made::One;
        }
        let constraints = Constraints::new(world);
        let mut more: Option<Real> = None;
        let mut is_one = false;
        for witness in &self.witnesses {
            let body = world.bodies.get(witness.body).filter(|it| is_moved(it));
            let Some(body) = body else {
                continue;
            };
            let slow_for = body.activation().time_since_can_sleep;
            let is_fine = shows(witness.slow_for, dt);
            if is_fine && slow_for == witness.slow_for {
                return Made::None;
            }
            let slowly = slow_for - witness.slow_for;
            if is_fine && slowly > MORE * dt {
                return Made::More(slowly);
            }
            let free = !constraints.concern(witness.body, body);
            match witness.advanced(body, dt).filter(|_| free) {
                Some(advanced) if advanced > MORE * dt => {
                    more = Some(more.map_or(advanced, |least| least.min(advanced)));
                }
                Some(_) => is_one = true,
                None => {}
            }
        }
        more.filter(|_| !is_one).map_or(Made::One, Made::More)
    }

    /// Takes back everything that was written.
    pub(crate) fn take_back(&self, bodies: &mut RigidBodySet) {
        self.before.take_back(bodies);
        for (handle, was) in &self.quarantined {
            if let Some(body) = bodies.get_mut(*handle) {
                body.set_enabled(true);
                body.copy_from(was);
            }
        }
    }
}

impl Witness {
    /// The time for which a free body has moved on, from its displacement and its velocities at both ends; `None` where
    /// these do not show it.
    fn advanced(&self, body: &RigidBody, dt: Real) -> Option<Real> {
        let (begun, ended) = (self.linvel, body.linvel());
        let (mean, change) = ((begun + ended) * 0.5, (ended - begun).length());
        let (from, to) = (self.centre, world_com(body));
        let way = to - from;
        let rounding = 32.0 * Real::EPSILON * (from.length() + to.length());
        if !(mean.length() * dt > 16.0 * rounding && change * 8.0 <= mean.length()) {
            return None;
        }
        let advanced = way.dot(mean) / mean.length_squared();
        let off = (way - mean * advanced).length();
        (off <= change * advanced + rounding).then_some(advanced)
    }
}

/// Returns true if Rapier's step moves a body.
fn is_moved(body: &RigidBody) -> bool {
    body.is_dynamic() && body.is_enabled() && !body.is_sleeping()
}
