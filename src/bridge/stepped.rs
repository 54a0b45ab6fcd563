//! Whether Rapier made one step between the two halves of ours, and what is taken back if it made none.

use super::constrained::Constraints;
use super::restless::Drowsing;
use super::undo::Undo;
use super::world::WorldMut;
use crate::math::{Real, RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::dynamics::RigidBody;

/// What fields wrote to bodies before Rapier's step, and how that step shows on some of them.
#[derive(Debug, Default)]
pub(crate) struct Stepped {
    pub before: Undo,
    /// Bodies that were put into quarantine, as they were.
    condemned: Vec<(RigidBodyHandle, RigidBody)>,
    witnesses: Vec<Witness>,
    /// Which bodies were about to fall asleep when the step began.
    pub drowsing: Option<Drowsing>,
}

/// A body as Rapier's step is to find it.
#[derive(Debug)]
struct Witness {
    body: RigidBodyHandle,
    /// For how long it has been slow enough to fall asleep: a step adds its length, or makes it zero.
    slow_for: Real,
    centre: Vector,
    linvel: Vector,
}

/// What Rapier did meanwhile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Made {
    /// One step, as far as can be told.
    One,
    None,
    /// Steps of this length together.
    More(Real),
}

/// So many bodies are asked.
const WITNESSES: usize = 8;

/// From which multiple of the step on it is told: what is free moves by one within an eighth.
const MORE: Real = 1.5;

impl Stepped {
    pub(crate) fn clear(&mut self) {
        self.before.clear();
        self.condemned.clear();
        self.witnesses.clear();
        self.drowsing = None;
    }

    /// Takes note of bodies that are about to be written to.
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

    /// Takes note of bodies that are about to be disabled.
    pub(crate) fn note_condemned(&mut self, bodies: &RigidBodySet, condemned: &[RigidBodyHandle]) {
        let copies = condemned
            .iter()
            .filter_map(|handle| Some((*handle, bodies.get(*handle)?.clone())));
        self.condemned.extend(copies);
    }

    /// Chooses witnesses, evenly, of the bodies that were written to.
    pub(crate) fn choose(&mut self, bodies: &mut RigidBodySet, dt: Real) {
        // A step without length leaves them as they are.
        if dt <= 0.0 {
            return;
        }
        let every = self.before.len().div_ceil(WITNESSES).max(1);
        for handle in self.before.bodies().step_by(every) {
            let Some(body) = bodies.get_mut(handle).filter(|it| is_moved(it)) else {
                continue;
            };
            let activation = body.activation_mut();
            if activation.time_since_can_sleep == 0.0 {
                // Whatever a step makes of it, no bit of that shows this.
                activation.time_since_can_sleep = Real::MIN_POSITIVE;
            }
            self.witnesses.push(Witness {
                body: handle,
                slow_for: activation.time_since_can_sleep,
                centre: centre(body),
                linvel: body.linvel(),
            });
        }
    }

    /// What Rapier did since.
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
            let is_fine = witness.slow_for * 16.0 * Real::EPSILON < dt;
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

    /// Takes back what was written.
    pub(crate) fn take_back(&self, bodies: &mut RigidBodySet) {
        self.before.take_back(bodies);
        for (handle, was) in &self.condemned {
            if let Some(body) = bodies.get_mut(*handle) {
                body.set_enabled(true);
                body.copy_from(was);
            }
        }
    }
}

impl Witness {
    /// For how long a free body has moved on, by its way and its velocities at both ends; `None` where these
    /// do not tell.
    fn advanced(&self, body: &RigidBody, dt: Real) -> Option<Real> {
        let (begun, ended) = (self.linvel, body.linvel());
        let (mean, change) = ((begun + ended) * 0.5, (ended - begun).length());
        let (from, to) = (self.centre, centre(body));
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

fn centre(body: &RigidBody) -> Vector {
    body.position().transform_point(body.local_center_of_mass())
}

/// Whether Rapier's step moves a body.
fn is_moved(body: &RigidBody) -> bool {
    body.is_dynamic() && body.is_enabled() && !body.is_sleeping()
}
