//! The state and acceleration of all bodies when Rapier's step begins, from which contacts take their resting
//! thresholds and sweeps their paths.

use crate::field::ContactLaw;
use crate::math::{DVec3, Pose, Real, RigidBodyHandle, Vector, to_dvec3, to_f64};
use crate::rapier::dynamics::{IntegrationParameters, RigidBody, RigidBodyType};
use crate::rigid::{Lookup, Wrench};

/// A body when Rapier's step begins, in world axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyStart {
    pub body: RigidBodyHandle,
    pub pose: Pose,
    pub linvel: Vector,
    pub angvel: Vector,
    /// The rotation, if this crate rotates the body.
    pub turn: Option<FreeTurn>,
    /// The acceleration that Rapier spreads over its step: gravity and the user's force.
    pub spread: Vector,
    /// The mean acceleration by fields over the step.
    kicked: Vector,
    /// The rate of change of that acceleration, for a body that is moved within the step.
    pub jerk: Vector,
    share: KickShare,
    /// The velocity of the path at the end of Rapier's step, minus the body's velocity there. Rapier's substeps lag
    /// behind the parabola, and after a whole kick the velocity is that of the middle of the step. Zero for a body that
    /// is moved within the step.
    pub behind: Vector,
}

/// The rotation over a step of a body that this crate rotates: angular momenta and torques, in world axes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FreeTurn {
    /// At the end of Rapier's step.
    pub momentum: DVec3,
    /// Of the free rotation that leads from the attitude at the start approximately to that at the end.
    pub mean: DVec3,
    /// The mean torque, which bends the rotation about that free one, and its rate of change.
    pub torque: DVec3,
    pub torque_rate: DVec3,
    /// The part by which the angular momentum lags behind after a whole kick.
    pub behind: DVec3,
}

/// All bodies when Rapier's step begins, by their index, and the threshold between resting contacts and impacts.
#[derive(Clone, Debug, Default)]
pub(crate) struct Starts {
    list: Vec<Option<BodyStart>>,
    setting: StepSetting,
}

/// The parameters of Rapier's step.
#[derive(Clone, Copy, Debug, Default)]
struct StepSetting {
    gravity: Vector,
    dt: Real,
    iterations: usize,
    /// Rapier's allowed linear error: a contact that would rebound lower than this is at rest.
    rebound: Real,
}

/// The share of the kicks of a step that a body got before Rapier's step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum KickShare {
    /// Half of them. The other half follows, so the path is bent by both as by gravity.
    Half {
        /// True if the kicks also contain gravity and the user's force, and the velocity that Rapier's step adds for
        /// these was subtracted before it.
        free: bool,
    },
    Whole,
    /// The body is moved within the step; `None` if nothing accelerates it.
    Within(Option<Arrival>),
}

/// The end of the path of a body that is moved within the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arrival {
    /// The velocity with which it arrives.
    pub linvel: Vector,
    /// The wrench of the fields at the start of the step.
    pub first: Wrench,
}

/// The point of a body, in its frame, whose velocity a contact uses: the centre of mass of a body that is dynamic or
/// that Rapier rotates about it, else the origin. Rapier ignores the centre of mass of other bodies, and for an open
/// mesh it may be anywhere.
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
            ..FreeTurn::default()
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
    /// The body in its present state, accelerated by gravity and the user's force only.
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
            spread,
            behind: spread * (setting.dt / (2.0 * iterations as Real)),
            turn: None,
            kicked: Vector::ZERO,
            jerk: Vector::ZERO,
            share: KickShare::Whole,
        }
    }

    /// Adds the acceleration by fields, from the change of velocity since `before`.
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

    /// Returns true if the body has not moved since, and has no velocity.
    pub(super) fn is_still(&self, body: &RigidBody) -> bool {
        let moves = [self.linvel, self.angvel, body.linvel(), body.angvel()];
        moves == [Vector::ZERO; 4] && self.pose == *body.position()
    }

    /// The mean acceleration over the step, from all causes.
    pub(super) fn acceleration(&self) -> Vector {
        self.spread + self.kicked
    }

    /// The acceleration that is not due to fields, for a body that is moved within the step. `None` for others, which
    /// get the rest of their kick after Rapier's step.
    pub(super) fn spread_within(&self) -> Option<DVec3> {
        let within = matches!(self.share, KickShare::Within(Some(_)));
        within.then(|| to_dvec3(self.spread))
    }

    /// The velocity at the start of the path over a step that nothing interrupts, its mean acceleration, and the
    /// velocity at the end of Rapier's step.
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
    /// Records the bodies before fields have acted on them in this step.
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
    }

    /// Records the bodies after the first kicks. `share` says which part of its kicks a body got. `momenta` are, for
    /// each body that this crate rotates, its angular momentum and the part of it that fields gave.
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
    }

    /// Clears the lag of bodies whose velocities do not lag behind any more.
    pub(crate) fn catch_up(&mut self, bodies: impl Iterator<Item = RigidBodyHandle>) {
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

    /// The start of a body; a body that was added since counts as having stood at its present pose.
    pub(super) fn of(&self, handle: RigidBodyHandle, body: &RigidBody) -> BodyStart {
        self.known(handle).copied().unwrap_or(BodyStart {
            linvel: Vector::ZERO,
            angvel: Vector::ZERO,
            ..BodyStart::now(handle, body, &self.setting)
        })
    }

    /// The velocity of the pivot of a body after Rapier's step; for a position-based kinematic body, that of its way in
    /// the step.
    pub(super) fn pivot_velocity(&self, handle: RigidBodyHandle, body: &RigidBody) -> Vector {
        let dt = self.setting.dt;
        let placed = body.body_type() == RigidBodyType::KinematicPositionBased && dt > 0.0;
        match self.known(handle).filter(|_| placed) {
            Some(start) => (body.translation() - start.pose.translation) / dt,
            None => body.linvel(),
        }
    }

    /// Returns true if no body has moved since, and none has a velocity.
    pub(super) fn all_still(&self, world: &impl Lookup) -> bool {
        let mut bodies = world.bodies();
        bodies.all(|(handle, body)| self.of(handle, body).is_still(body))
    }

    /// A contact that would rebound lower than this is at rest: Rapier's allowed linear error.
    pub(super) fn rebound(&self) -> Real {
        self.setting.rebound
    }

    /// The velocity that gravity and the user's force give a body in Rapier's step.
    pub(super) fn gained(&self, handle: RigidBodyHandle) -> Vector {
        let known = self.known(handle);
        known.map_or(Vector::ZERO, |start| start.spread * self.setting.dt)
    }

    /// The length of the step.
    pub(super) fn dt(&self) -> Real {
        self.setting.dt
    }

    /// The velocity by which a body lags behind its path; zero if it is not known.
    pub(super) fn behind(&self, handle: Option<RigidBodyHandle>) -> Vector {
        let known = handle.and_then(|handle| self.known(handle));
        known.map_or(Vector::ZERO, |start| start.behind)
    }

    /// The magnitude of a body's acceleration in this step; zero if it is not known.
    fn pressed(&self, handle: Option<RigidBodyHandle>) -> Real {
        let known = handle.and_then(|handle| self.known(handle));
        known.map_or(0.0, |start| start.acceleration().length())
    }

    /// The resting threshold: contacts that approach or separate more slowly last, and Rapier holds them. Their rebound
    /// would rise for less than two steps, or less high than Rapier's allowed linear error. Under laws without loss the
    /// limit is the speed gained in one step, or energy would be lost. Zero, so that no contact lasts, if nothing
    /// accelerates the two bodies or if a spring holds them.
    pub(super) fn resting_speed(
        &self,
        law: ContactLaw,
        bodies: [Option<RigidBodyHandle>; 2],
    ) -> Real {
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
