//! The state of all bodies at one moment: to see what changed, and to go back.

use crate::math::{ColliderSet, Pose, RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::dynamics::{RigidBody, RigidBodyActivation, RigidBodyType};

/// How far a world differs from a snapshot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Change {
    /// Not at all.
    Nothing,
    /// Bodies move differently.
    Velocities,
    /// Bodies were moved, added or removed, fell asleep or woke, or have other colliders or
    /// another type.
    Places,
}

/// The bodies of a world, in the order of their handles.
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) struct Snapshot {
    states: Vec<BodyState>,
}

#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
struct BodyState {
    handle: RigidBodyHandle,
    pose: Pose,
    linvel: Vector,
    angvel: Vector,
    colliders: usize,
    enabled: bool,
    /// A body that was not dynamic has no inverse mass until Rapier's next step.
    body_type: RigidBodyType,
    activation: RigidBodyActivation,
}

impl BodyState {
    fn of(handle: RigidBodyHandle, body: &RigidBody) -> Self {
        BodyState {
            handle,
            pose: *body.position(),
            linvel: body.linvel(),
            angvel: body.angvel(),
            colliders: body.colliders().len(),
            enabled: body.is_enabled(),
            body_type: body.body_type(),
            activation: *body.activation(),
        }
    }

    /// Whether a body is the same one, and stands where it stood.
    fn stands(&self, handle: RigidBodyHandle, body: &RigidBody) -> bool {
        self.handle == handle
            && self.pose == *body.position()
            && self.colliders == body.colliders().len()
            && self.enabled == body.is_enabled()
            && self.body_type == body.body_type()
            && self.activation.sleeping == body.is_sleeping()
    }
}

impl Snapshot {
    /// Takes the present state.
    pub(crate) fn take(&mut self, bodies: &RigidBodySet) {
        self.states.clear();
        let states = bodies
            .iter()
            .map(|(handle, body)| BodyState::of(handle, body));
        self.states.extend(states);
    }

    /// What has changed since.
    pub(crate) fn compare(&self, bodies: &RigidBodySet) -> Change {
        if bodies.len() != self.states.len() {
            return Change::Places;
        }
        let mut change = Change::Nothing;
        for ((handle, body), was) in bodies.iter().zip(&self.states) {
            if !was.stands(handle, body) {
                return Change::Places;
            }
            if body.linvel() != was.linvel || body.angvel() != was.angvel {
                change = Change::Velocities;
            }
        }
        change
    }

    /// Bodies that are new, or were moved, or have more or fewer colliders.
    pub(crate) fn moved(&self, bodies: &RigidBodySet) -> Vec<RigidBodyHandle> {
        let mut known = self.states.iter().peekable();
        let mut moved = Vec::new();
        for (handle, body) in bodies.iter() {
            let index = |handle: RigidBodyHandle| handle.into_raw_parts().0;
            while known
                .next_if(|was| index(was.handle) < index(handle))
                .is_some()
            {}
            let was = known.next_if(|was| was.handle == handle);
            if !was.is_some_and(|was| was.stands(handle, body)) {
                moved.push(handle);
            }
        }
        moved
    }

    /// The pose that a body had.
    pub(crate) fn pose(&self, body: RigidBodyHandle) -> Option<Pose> {
        let index = |handle: RigidBodyHandle| handle.into_raw_parts().0;
        let place = self
            .states
            .binary_search_by_key(&index(body), |state| index(state.handle));
        let state = &self.states[place.ok()?];
        (state.handle == body).then_some(state.pose)
    }

    /// Puts every body back.
    pub(crate) fn restore(&self, bodies: &mut RigidBodySet, colliders: &ColliderSet) {
        for was in &self.states {
            if bodies
                .get(was.handle)
                .is_some_and(|body| BodyState::of(was.handle, body) == *was)
            {
                continue;
            }
            let Some(body) = bodies.get_mut(was.handle) else {
                continue;
            };
            body.set_position(was.pose, false);
            body.set_linvel(was.linvel, false);
            body.set_angvel(was.angvel, false);
            *body.activation_mut() = was.activation;
            body.recompute_mass_properties_from_colliders(colliders);
        }
    }
}
