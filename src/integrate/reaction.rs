//! The accelerations of a loaded body besides its load, by gravity, contacts and joints, estimated from the last steps.
//!
//! A force that reads velocities depends on the velocities within a step, and so on all other accelerations. For a free
//! body these are known; for one that contacts or joints hold, Rapier's solver computes them later. They are estimated
//! from the previous steps, which is exact for a body at rest or at its terminal velocity.

use super::coupling::ExternalTerms;
use crate::math::{Real, RigidBodyHandle, Vector, to_dquat, to_dvec3};
use crate::rigid::{Body, find_by, find_next, is_in_order, six, sort_by_body};

/// The loaded bodies whose forces read velocities, in the order of their handles.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Reactions(Vec<Loaded>);

/// A body that was loaded in a step. Pairs are linear and angular, in world axes.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Loaded {
    body: RigidBodyHandle,
    dt: Real,
    /// The velocities to which the load alone leads.
    loaded: [Vector; 2],
    /// The accelerations by all other causes, in the step before.
    before: Option<[Vector; 2]>,
}

impl Reactions {
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// Adds a body that is loaded in this step; `known` is its entry in the record of the step before.
    pub(super) fn add(
        &mut self,
        known: Option<&Loaded>,
        body: &Body,
        loaded: [Vector; 2],
        dt: Real,
    ) {
        self.0.push(Loaded {
            body: body.handle,
            dt,
            loaded,
            before: known.map(|known| known.accelerations(body)),
        });
    }

    pub(super) fn sort(&mut self) {
        sort_by_body(&mut self.0, |known| known.body);
    }

    pub(super) fn of(&self, body: RigidBodyHandle) -> Option<&Loaded> {
        let place = find_by(&self.0, body, |known| known.body)?;
        Some(&self.0[place])
    }

    /// [`Self::of`] for calls in the order of handles; `at` is the position in the list, zero at first.
    pub(crate) fn next_of(&self, at: &mut usize, body: RigidBodyHandle) -> Option<&Loaded> {
        find_next(&self.0, at, body, |known| known.body)
    }

    /// Returns true if the list is sorted and finite, which a deserialized one may not be.
    pub(crate) fn is_sound(&self) -> bool {
        let finite = |known: &Loaded| {
            let pairs = [known.loaded, known.before.unwrap_or_default()];
            known.dt > 0.0
                && known.dt.is_finite()
                && pairs.as_flattened().iter().all(|v| v.is_finite())
        };
        is_in_order(&self.0, |known| known.body) && self.0.iter().all(finite)
    }
}

impl Loaded {
    /// The accelerations of the body besides those by its load, as far as the last two steps agree, so that an impact
    /// does not affect the next step. `None` if the body was not loaded in both.
    pub(super) fn steady(&self, body: &Body) -> Option<[Vector; 2]> {
        let (now, before) = (self.accelerations(body), self.before?);
        Some([0, 1].map(|part| common(now[part], before[part])))
    }

    /// [`Self::steady`] as a force and a torque.
    pub(super) fn on(&self, body: &Body) -> Option<ExternalTerms> {
        let [linear, angular] = self.steady(body)?;
        let inertia = body.inertia();
        let attitude = to_dquat(body.pose.rotation);
        let torque = inertia.map(|it| it.angular_momentum(attitude, to_dvec3(angular)));
        Some(ExternalTerms {
            pull: six(to_dvec3(linear * body.mass), torque.unwrap_or_default()),
            ..ExternalTerms::default()
        })
    }

    /// The accelerations by all causes except the load, for the body as it is now.
    fn accelerations(&self, now: &Body) -> [Vector; 2] {
        let now = [now.linvel, now.angvel];
        [0, 1].map(|part| (now[part] - self.loaded[part]) / self.dt)
    }
}

/// The common part of two vectors: the shorter one, times the cosine of the angle between them if that is positive.
fn common(a: Vector, b: Vector) -> Vector {
    let shorter = if a.length_squared() < b.length_squared() {
        a
    } else {
        b
    };
    let share = a.normalize_or_zero().dot(b.normalize_or_zero());
    shorter * share.max(0.0)
}
