//! The bodies when Rapier's step begins: how they move, and what presses on them.

use crate::field::ContactLaw;
use crate::math::{DVec3, Pose, Real, RigidBodyHandle, Vector};
use crate::rapier::dynamics::{IntegrationParameters, RigidBody};
use crate::rigid::Lookup;

/// A body when Rapier's step began.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub body: RigidBodyHandle,
    pub pose: Pose,
    pub linvel: Vector,
    pub angvel: Vector,
    /// Angular momentum, of a body that this crate turns.
    pub momentum: Option<DVec3>,
    /// The acceleration that Rapier spreads over its step: gravity and the user's force.
    pub spread: Vector,
    /// The acceleration by fields that kick.
    kicked: Vector,
    /// Whether they have given half of it, so that the way is bent by it as by gravity.
    halved: bool,
    /// By how much the velocity of a body that Rapier moves by `spread` is behind that of the
    /// parabola on which it moves it, in its steps within the step.
    pub lag: Vector,
}

/// All bodies when Rapier's step began, by their index, and what tells a contact that lasts from an
/// impact.
#[derive(Clone, Debug, Default)]
pub(crate) struct Starts {
    list: Vec<Option<Start>>,
    setting: Setting,
}

/// What Rapier's step depends on.
#[derive(Clone, Copy, Debug, Default)]
struct Setting {
    gravity: Vector,
    dt: Real,
    iterations: usize,
    /// What would rebound lower than this is at rest.
    rebound: Real,
}

impl Start {
    /// A body that nothing but gravity and its own force acts on, with the state it has.
    fn now(handle: RigidBodyHandle, body: &RigidBody, setting: &Setting) -> Self {
        let inverse_mass = body.mass_properties().effective_inv_mass;
        let pulled = if inverse_mass == Vector::ZERO {
            0.0
        } else {
            body.gravity_scale()
        };
        let spread = setting.gravity * pulled + body.user_force() * inverse_mass;
        let iterations = setting.iterations.max(1) + body.additional_solver_iterations();
        Start {
            body: handle,
            pose: *body.position(),
            linvel: body.linvel(),
            angvel: body.angvel(),
            momentum: None,
            spread,
            kicked: Vector::ZERO,
            halved: false,
            lag: spread * (setting.dt / (2.0 * iterations as Real)),
        }
    }

    /// Of what has no body.
    pub(super) fn nowhere() -> Self {
        Start {
            body: RigidBodyHandle::invalid(),
            pose: Pose::IDENTITY,
            linvel: Vector::ZERO,
            angvel: Vector::ZERO,
            momentum: None,
            spread: Vector::ZERO,
            kicked: Vector::ZERO,
            halved: false,
            lag: Vector::ZERO,
        }
    }

    /// Whether the body has not moved since, and does not move.
    pub(super) fn is_still(&self, body: &RigidBody) -> bool {
        let moves = [self.linvel, self.angvel, body.linvel(), body.angvel()];
        moves == [Vector::ZERO; 4] && self.pose == *body.position()
    }

    /// All that accelerates the body.
    pub(super) fn acceleration(&self) -> Vector {
        self.spread + self.kicked
    }

    /// The velocity and the acceleration with which its true way over a step begins, if nothing
    /// hits it.
    pub(super) fn way(&self, dt: Real) -> [Vector; 2] {
        let ahead = self.linvel + self.lag;
        if self.halved {
            [ahead - self.kicked * (0.5 * dt), self.acceleration()]
        } else {
            [ahead, self.spread]
        }
    }
}

impl Starts {
    /// Takes note of the bodies before fields have given them anything.
    pub(crate) fn before(
        &mut self,
        world: &impl Lookup,
        gravity: Vector,
        parameters: &IntegrationParameters,
    ) {
        self.setting = Setting {
            gravity,
            dt: parameters.dt,
            iterations: parameters.num_solver_iterations,
            rebound: parameters.allowed_linear_error(),
        };
        self.list.clear();
        for (handle, body) in world.bodies() {
            let index = handle.into_raw_parts().0 as usize;
            self.list.resize(self.list.len().max(index + 1), None);
            self.list[index] = Some(Start::now(handle, body, &self.setting));
        }
    }

    /// Takes note of what fields have given them: `halved` says for which it is the first half of
    /// two kicks. `momenta` are those of the bodies that this crate turns.
    pub(crate) fn after(
        &mut self,
        world: &impl Lookup,
        halved: impl Fn(RigidBodyHandle) -> bool,
        momenta: impl Iterator<Item = (RigidBodyHandle, DVec3)>,
    ) {
        for start in self.list.iter_mut().flatten() {
            let Some(body) = world.body(start.body) else {
                continue;
            };
            let before = start.linvel;
            *start = Start::now(start.body, body, &self.setting);
            start.halved = halved(start.body);
            if self.setting.dt > 0.0 {
                let share = if start.halved { 0.5 } else { 1.0 };
                start.kicked = (start.linvel - before) / (self.setting.dt * share);
            }
        }
        for (handle, momentum) in momenta {
            let start = self.list.get_mut(handle.into_raw_parts().0 as usize);
            if let Some(Some(start)) = start {
                start.momentum = Some(momentum);
            }
        }
    }

    fn known(&self, handle: RigidBodyHandle) -> Option<&Start> {
        let start = self.list.get(handle.into_raw_parts().0 as usize)?;
        start.as_ref().filter(|start| start.body == handle)
    }

    /// How a body was; one that was not there yet has stood where it is.
    pub(super) fn of(&self, handle: RigidBodyHandle, body: &RigidBody) -> Start {
        self.known(handle).copied().unwrap_or(Start {
            linvel: Vector::ZERO,
            angvel: Vector::ZERO,
            ..Start::now(handle, body, &self.setting)
        })
    }

    /// Whether no body has moved since, or moves.
    pub(super) fn all_still(&self, world: &impl Lookup) -> bool {
        let mut bodies = world.bodies();
        bodies.all(|(handle, body)| self.of(handle, body).is_still(body))
    }

    /// What would rebound lower than this is at rest.
    pub(super) fn rebound(&self) -> Real {
        self.setting.rebound
    }

    /// The length of the step.
    pub(super) fn dt(&self) -> Real {
        self.setting.dt
    }

    /// By how much a body is behind its parabola, as far as it is known.
    pub(super) fn lag(&self, handle: Option<RigidBodyHandle>) -> Vector {
        let known = handle.and_then(|handle| self.known(handle));
        known.map_or(Vector::ZERO, |start| start.lag)
    }

    /// The acceleration of a body in this step, as far as it is known.
    pub(super) fn acceleration(&self, handle: Option<RigidBodyHandle>) -> Vector {
        let known = handle.and_then(|handle| self.known(handle));
        known.map_or(Vector::ZERO, Start::acceleration)
    }

    /// Contacts that approach or part more slowly last, and are Rapier's to hold: they would
    /// rebound less than two steps take, or lower than Rapier's solver tells from touching. Of what
    /// rebounds without loss only what a step itself makes up lasts, or energy would be lost.
    /// Without anything that presses two bodies together no contact lasts, and none held by a
    /// spring.
    pub(super) fn slow(&self, law: ContactLaw, bodies: [Option<RigidBodyHandle>; 2]) -> Real {
        let pressed = bodies.map(|body| self.acceleration(body).length());
        let pressed = pressed[0].max(pressed[1]);
        let within_step = pressed * self.setting.dt;
        match law {
            ContactLaw::Observe | ContactLaw::Penalty { .. } => 0.0,
            ContactLaw::Impulse { restitution, .. } if restitution < 1.0 => {
                let two_steps = 2.0 * within_step;
                (two_steps * two_steps + 2.0 * pressed * self.setting.rebound).sqrt()
            }
            ContactLaw::Impulse { .. } | ContactLaw::Paper | ContactLaw::PaperRelative => {
                within_step
            }
        }
    }
}
