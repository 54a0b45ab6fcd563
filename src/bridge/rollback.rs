//! The bodies as they were when a step began, to go back to.

use super::world::View;
use crate::math::{ColliderHandle, ColliderSet, Pose, RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::dynamics::{IslandManager, RigidBody, RigidBodyActivation};
use crate::rigid::{Body, Lookup};

/// Copies of the bodies that Rapier may move in a step. Of sleepers, which it may wake, those of
/// when they fell asleep are kept.
#[derive(Debug, Default)]
pub(crate) struct Rollback {
    /// By the index of a body.
    copies: Vec<Option<BodyCopy>>,
    active: Vec<RigidBodyHandle>,
}

#[derive(Clone, Debug, PartialEq)]
struct BodyCopy {
    handle: RigidBodyHandle,
    pose: Pose,
    linvel: Vector,
    angvel: Vector,
    activation: RigidBodyActivation,
}

impl BodyCopy {
    fn of(handle: RigidBodyHandle, body: &RigidBody) -> Self {
        BodyCopy {
            handle,
            pose: *body.position(),
            linvel: body.linvel(),
            angvel: body.angvel(),
            activation: *body.activation(),
        }
    }
}

impl Rollback {
    /// Takes the present state: of `all` bodies that can move, or of those that Rapier has awake,
    /// those that it had when this was called last, and those that were read as awake.
    pub(crate) fn take(
        &mut self,
        view: &View<'_>,
        islands: &IslandManager,
        all: bool,
        read: &[Body],
    ) {
        if all || self.copies.is_empty() {
            self.copies.clear();
            let movable = view.bodies().filter(|(_, body)| !body.is_fixed());
            for (handle, body) in movable {
                self.put(handle, body);
            }
        } else {
            let last = std::mem::take(&mut self.active);
            for handle in last.iter().copied().chain(islands.active_bodies()) {
                if let Some(body) = view.body(handle) {
                    self.put(handle, body);
                }
            }
            self.active = last;
            // Whoever was woken since the last step is not among Rapier's active ones yet.
            for copy in read {
                if let Some(body) = view.body(copy.handle).filter(|_| !self.knows(copy)) {
                    self.put(copy.handle, body);
                }
            }
        }
        self.active.clear();
        self.active.extend(islands.active_bodies());
    }

    /// Forgets all: nothing in this step can fail once it has begun.
    pub(crate) fn clear(&mut self) {
        self.copies.clear();
    }

    fn put(&mut self, handle: RigidBodyHandle, body: &RigidBody) {
        let index = handle.into_raw_parts().0 as usize;
        if self.copies.len() <= index {
            self.copies.resize(index + 1, None);
        }
        self.copies[index] = Some(BodyCopy::of(handle, body));
    }

    /// Whether a body was copied as it is.
    fn knows(&self, body: &Body) -> bool {
        let same = |copy: &BodyCopy| {
            let sleeping = copy.activation.sleeping == body.sleeping;
            sleeping && copy.pose == body.pose && copy.linvel == body.linvel
        };
        self.copy(body.handle).is_some_and(same)
    }

    fn copy(&self, handle: RigidBodyHandle) -> Option<&BodyCopy> {
        let copy = self
            .copies
            .get(handle.into_raw_parts().0 as usize)?
            .as_ref();
        copy.filter(|copy| copy.handle == handle)
    }

    /// The world pose that a collider had. What was not copied has not moved.
    pub(crate) fn pose_before(&self, handle: ColliderHandle, world: &impl Lookup) -> Option<Pose> {
        let collider = world.collider(handle)?;
        let (Some(parent), Some(local_pose)) = (collider.parent(), collider.position_wrt_parent())
        else {
            return Some(*collider.position());
        };
        let pose = match self.copy(parent) {
            Some(copy) => copy.pose,
            None => *world.body(parent)?.position(),
        };
        Some(pose * *local_pose)
    }

    /// Puts every body back.
    pub(crate) fn restore(&self, bodies: &mut RigidBodySet, colliders: &ColliderSet) {
        for was in self.copies.iter().flatten() {
            let same = |body: &RigidBody| BodyCopy::of(was.handle, body) == *was;
            if bodies.get(was.handle).is_none_or(same) {
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
