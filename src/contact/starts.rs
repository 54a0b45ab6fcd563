//! The bodies when Rapier's step begins: how they move, and what presses on them.

use crate::field::ContactLaw;
use crate::math::{DVec3, Pose, Real, RigidBodyHandle, Vector, to_dvec3, to_f64};
use crate::rapier::dynamics::{IntegrationParameters, RigidBody, RigidBodyType};
use crate::rigid::{Lookup, Wrench};

/// A body when Rapier's step began.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyStart {
    pub body: RigidBodyHandle,
    pub pose: Pose,
    pub linvel: Vector,
    pub angvel: Vector,
    /// The rotation of a body that this crate turns.
    pub turn: Option<FreeTurn>,
    /// The acceleration that Rapier spreads over its step: gravity and the user's force.
    pub spread: Vector,
    /// The mean acceleration by fields.
    kicked: Vector,
    /// By which it grows, of a body that is moved within the step.
    pub jerk: Vector,
    share: KickShare,
    /// By how much the velocity at the end of the step is behind where the body is: Rapier's, which
    /// moves it in steps within the step, behind the parabola, and that of a whole kick, which is
    /// the velocity in the middle.
    pub behind: Vector,
}

/// The rotation over a step of a body that this crate turns: angular momenta in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreeTurn {
    /// With which Rapier's step ends.
    pub momentum: DVec3,
    /// With which it would have turned freely from where it began to about where it ended.
    pub mean: DVec3,
    /// The mean torque that bends its way about that, and by which it grows.
    pub torque: DVec3,
    pub torque_rate: DVec3,
    /// By how much that of a whole kick is behind.
    pub behind: DVec3,
}

/// All bodies when Rapier's step began, by their index, and what tells a contact that lasts from an
/// impact.
#[derive(Clone, Debug, Default)]
pub(crate) struct Starts {
    list: Vec<Option<BodyStart>>,
    /// How fast each is accelerated; apart, since hooks ask for nothing else.
    pressed: Vec<(RigidBodyHandle, Real)>,
    setting: StepSetting,
}

/// The parameters of Rapier's step.
#[derive(Clone, Copy, Debug, Default)]
struct StepSetting {
    gravity: Vector,
    dt: Real,
    iterations: usize,
    /// A contact that would rebound lower than this is at rest.
    rebound: Real,
}

/// Which share of the kicks of a step a body gets when it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum KickShare {
    /// The second follows, so that the way is bent by both as by gravity; `free`: they hold Rapier's
    /// own pull, which is taken off before its step.
    Half {
        free: bool,
    },
    Whole,
    /// It is moved within the step, if anything accelerates it.
    Within(Option<Arrival>),
}

/// The known end of the way of a body that is moved within the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arrival {
    /// With which it is to arrive.
    pub linvel: Vector,
    /// The wrench of the fields at the start.
    pub first: Wrench,
}

/// The point of a body, in its frame, of which a contact takes the velocity: the centre of mass of a
/// body that is dynamic, or that Rapier turns about it. That of any other body says nothing, since
/// Rapier never looks at it: of an open mesh it may be anywhere.
pub(super) fn pivot(body: &RigidBody) -> Vector {
    let kind = body.body_type();
    let turned = kind == RigidBodyType::KinematicVelocityBased && body.angvel() != Vector::ZERO;
    let com = body.local_center_of_mass();
    if body.is_dynamic() || turned && com.is_finite() {
        com
    } else {
        Vector::ZERO
    }
}

impl FreeTurn {
    fn new(share: KickShare, [momentum, twist]: [DVec3; 2], dt: f64) -> Self {
        let free = FreeTurn {
            momentum,
            mean: momentum,
            torque: DVec3::ZERO,
            torque_rate: DVec3::ZERO,
            behind: DVec3::ZERO,
        };
        match share {
            KickShare::Half { .. } => FreeTurn {
                torque: twist * 2.0 / dt,
                ..free
            },
            KickShare::Whole => FreeTurn {
                behind: twist * 0.5,
                ..free
            },
            KickShare::Within(arrival) => {
                let torque = twist / dt;
                let first = arrival.map_or(torque, |it| to_dvec3(it.first.torque));
                FreeTurn {
                    mean: momentum - twist * 0.5,
                    torque,
                    torque_rate: (torque - first) * (2.0 / dt),
                    ..free
                }
            }
        }
    }
}

impl BodyStart {
    /// A body that nothing but gravity and its own force acts on, with the state it has.
    fn now(handle: RigidBodyHandle, body: &RigidBody, setting: &StepSetting) -> Self {
        let inverse_mass = body.mass_properties().effective_inv_mass;
        let pulled = if inverse_mass == Vector::ZERO {
            0.0
        } else {
            body.gravity_scale()
        };
        let spread = setting.gravity * pulled + body.user_force() * inverse_mass;
        let iterations = setting.iterations.max(1) + body.additional_solver_iterations();
        BodyStart {
            body: handle,
            pose: *body.position(),
            linvel: body.linvel(),
            angvel: body.angvel(),
            turn: None,
            spread,
            kicked: Vector::ZERO,
            jerk: Vector::ZERO,
            share: KickShare::Whole,
            behind: spread * (setting.dt / (2.0 * iterations as Real)),
        }
    }

    /// Of what has no body.
    pub(super) fn nowhere() -> Self {
        BodyStart {
            body: RigidBodyHandle::invalid(),
            pose: Pose::IDENTITY,
            linvel: Vector::ZERO,
            angvel: Vector::ZERO,
            turn: None,
            spread: Vector::ZERO,
            kicked: Vector::ZERO,
            jerk: Vector::ZERO,
            share: KickShare::Whole,
            behind: Vector::ZERO,
        }
    }

    /// Adds what fields have given the body since `before`.
    fn kick(&mut self, before: Vector, share: KickShare, dt: Real, inverse_mass: Vector) {
        let taken = match share {
            KickShare::Half { free: true } => self.behind,
            _ => Vector::ZERO,
        };
        let change = self.linvel + taken - before;
        self.share = share;
        if dt <= 0.0 {
            return;
        }
        self.kicked = change / dt;
        match share {
            KickShare::Half { .. } => self.kicked *= 2.0,
            KickShare::Whole => self.behind += change * 0.5,
            KickShare::Within(Some(arrival)) => {
                self.kicked = (arrival.linvel - before) / dt - self.spread;
                self.jerk = (self.kicked - arrival.first.force * inverse_mass) * (2.0 / dt);
                self.behind = Vector::ZERO;
            }
            KickShare::Within(None) => {}
        }
    }

    /// Whether the body has not moved since, and does not move.
    pub(super) fn is_still(&self, body: &RigidBody) -> bool {
        let moves = [self.linvel, self.angvel, body.linvel(), body.angvel()];
        moves == [Vector::ZERO; 4] && self.pose == *body.position()
    }

    /// All that accelerates the body, in the mean.
    pub(super) fn acceleration(&self) -> Vector {
        self.spread + self.kicked
    }

    /// The share of the fields in the acceleration of a body that is moved within the step, if there is
    /// no second half of a kick to come.
    pub(super) fn by_fields(&self, acceleration: DVec3) -> Option<DVec3> {
        let within = matches!(self.share, KickShare::Within(Some(_)));
        within.then(|| acceleration - to_dvec3(self.spread))
    }

    /// The velocity with which its true way over a step begins, and its mean acceleration, if nothing
    /// hits it; and the velocity with which Rapier's step ends.
    pub(super) fn way(&self, dt: Real) -> [Vector; 3] {
        let (half, end) = (self.kicked * (0.5 * dt), self.linvel + self.spread * dt);
        match self.share {
            KickShare::Half { .. } => {
                let begin = self.linvel + self.behind - half;
                [begin, self.acceleration(), end]
            }
            KickShare::Within(Some(Arrival { linvel, .. })) => {
                let acceleration = self.acceleration();
                [linvel - acceleration * dt, acceleration, linvel]
            }
            KickShare::Within(None) => [self.linvel + self.behind, self.spread, end],
            KickShare::Whole => [self.linvel + self.behind - half, self.spread, end],
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
        self.setting = StepSetting {
            gravity,
            dt: parameters.dt,
            iterations: parameters.num_solver_iterations,
            rebound: parameters.allowed_linear_error(),
        };
        self.list.clear();
        for (handle, body) in world.bodies() {
            let index = handle.into_raw_parts().0 as usize;
            self.list.resize(self.list.len().max(index + 1), None);
            self.list[index] = Some(BodyStart::now(handle, body, &self.setting));
        }
        self.press();
    }

    fn press(&mut self) {
        let none = (RigidBodyHandle::invalid(), 0.0);
        let pressed = |start: &BodyStart| (start.body, start.acceleration().length());
        self.pressed.clear();
        let pressed = self.list.iter().map(|it| it.as_ref().map_or(none, pressed));
        self.pressed.extend(pressed);
    }

    /// Takes note of what fields have given them: `share` says which share of the kicks of the step
    /// it was, if any. `momenta` are those of the bodies that this crate turns, and what fields have
    /// given of them.
    pub(crate) fn after(
        &mut self,
        world: &impl Lookup,
        share: impl Fn(RigidBodyHandle) -> KickShare,
        momenta: impl Iterator<Item = (RigidBodyHandle, [DVec3; 2])>,
    ) {
        for start in self.list.iter_mut().flatten() {
            let Some(body) = world.body(start.body) else {
                continue;
            };
            let before = start.linvel;
            *start = BodyStart::now(start.body, body, &self.setting);
            let inverse_mass = body.mass_properties().effective_inv_mass;
            start.kick(before, share(start.body), self.setting.dt, inverse_mass);
        }
        let dt = to_f64(self.setting.dt);
        for (handle, changes) in momenta.filter(|_| dt > 0.0) {
            let start = self.list.get_mut(handle.into_raw_parts().0 as usize);
            if let Some(Some(start)) = start {
                start.turn = Some(FreeTurn::new(start.share, changes, dt));
            }
        }
        self.press();
    }

    /// Takes note of bodies whose velocities are not behind any more.
    pub(crate) fn catch_up(&mut self, bodies: &[RigidBodyHandle]) {
        for handle in bodies {
            let start = self.list.get_mut(handle.into_raw_parts().0 as usize);
            if let Some(Some(start)) = start {
                start.behind = Vector::ZERO;
            }
        }
    }

    fn known(&self, handle: RigidBodyHandle) -> Option<&BodyStart> {
        let start = self.list.get(handle.into_raw_parts().0 as usize)?;
        start.as_ref().filter(|start| start.body == handle)
    }

    /// How a body was; one that was not there yet has stood where it is.
    pub(super) fn of(&self, handle: RigidBodyHandle, body: &RigidBody) -> BodyStart {
        self.known(handle).copied().unwrap_or(BodyStart {
            linvel: Vector::ZERO,
            angvel: Vector::ZERO,
            ..BodyStart::now(handle, body, &self.setting)
        })
    }

    /// The velocity of the pivot of a body after Rapier's step; of one that was moved to a place, that of
    /// its way there.
    pub(super) fn pivot_velocity(&self, handle: RigidBodyHandle, body: &RigidBody) -> Vector {
        let dt = self.setting.dt;
        let placed = body.body_type() == RigidBodyType::KinematicPositionBased && dt > 0.0;
        match self.known(handle).filter(|_| placed) {
            Some(start) => (body.translation() - start.pose.translation) / dt,
            None => body.linvel(),
        }
    }

    /// Whether no body has moved since, or moves.
    pub(super) fn all_still(&self, world: &impl Lookup) -> bool {
        let mut bodies = world.bodies();
        bodies.all(|(handle, body)| self.of(handle, body).is_still(body))
    }

    /// A contact that would rebound lower than this is at rest.
    pub(super) fn rebound(&self) -> Real {
        self.setting.rebound
    }

    /// By how much faster gravity and the user's force make a body in Rapier's step.
    pub(super) fn gained(&self, handle: RigidBodyHandle) -> Vector {
        let known = self.known(handle);
        known.map_or(Vector::ZERO, |start| start.spread * self.setting.dt)
    }

    /// The length of the step.
    pub(super) fn dt(&self) -> Real {
        self.setting.dt
    }

    /// By how much the velocity of a body is behind where it is, as far as it is known.
    pub(super) fn behind(&self, handle: Option<RigidBodyHandle>) -> Vector {
        let known = handle.and_then(|handle| self.known(handle));
        known.map_or(Vector::ZERO, |start| start.behind)
    }

    /// How fast a body is accelerated in this step, as far as it is known.
    fn pressed(&self, handle: Option<RigidBodyHandle>) -> Real {
        let known = handle.and_then(|it| self.pressed.get(it.into_raw_parts().0 as usize));
        let known = known.filter(|(body, _)| Some(*body) == handle);
        known.map_or(0.0, |(_, pressed)| *pressed)
    }

    /// Contacts that approach or part more slowly last, and are Rapier's to hold: they would
    /// rebound less than two steps take, or lower than Rapier's solver tells from touching. Of what
    /// rebounds without loss only what a step itself makes up lasts, or energy would be lost.
    /// Without anything that presses two bodies together no contact lasts, and none held by a
    /// spring.
    pub(super) fn slow(&self, law: ContactLaw, bodies: [Option<RigidBodyHandle>; 2]) -> Real {
        let pressed = bodies.map(|body| self.pressed(body));
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
