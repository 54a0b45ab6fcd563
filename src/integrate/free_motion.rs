//! The motion of a free body apart from fields: Rapier's gravity, the user's force and damping.
//!
//! Rapier spreads its acceleration a over the n iterations of a step, and damps at its end; both are
//! of first order. So the half kicks of a body that fields push hold all of it, and Rapier's own
//! part is taken off beforehand: a body that is to move at v is given v − (n + 1)/2n · a dt, and
//! arrives at v + (n − 1)/2n · a dt, damped.

use super::StepContext;
use super::coupling::Besides;
use super::motion::VelocityUpdate;
use crate::eval::CentreForce;
use crate::math::{DVec3, Real, Vector, from_dvec3, from_f64, to_dvec3, to_f64};
use crate::number::{Plain, Vec3, constant, real};
use crate::rapier::na::Vector6;
use crate::rigid::{Body, Lookup, Wrench, phi1, six, stopped};

/// The causes that move a body freely in a step, apart from fields.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeMotion {
    /// Rapier's own acceleration: by gravity and the user's force.
    pub(super) own: Vector,
    damping: [Real; 2],
    /// The part of a step that is one iteration.
    pub(super) iteration: Real,
    dt: Real,
}

impl<W: Lookup> StepContext<'_, W> {
    pub(super) fn free_motion(&self, body: &Body) -> FreeMotion {
        FreeMotion::new(body, self.rules.gravity, self.rules.iterations, self.dt)
    }
}

impl FreeMotion {
    /// No cause but fields.
    pub(crate) const NONE: FreeMotion = FreeMotion {
        own: Vector::ZERO,
        damping: [0.0; 2],
        iteration: 1.0,
        dt: 0.0,
    };

    pub(crate) fn new(body: &Body, gravity: Vector, iterations: u32, dt: Real) -> Self {
        let weight = gravity * (body.gravity_scale * body.mass);
        let count = body.iterations(iterations).max(1);
        FreeMotion {
            own: (body.user_force + weight) * body.inv_mass,
            damping: body.damping,
            iteration: (count as Real).recip(),
            dt,
        }
    }

    /// Returns true if nothing but fields moves the body.
    pub(crate) fn is_none(&self) -> bool {
        self.own == Vector::ZERO && self.damping == [0.0; 2]
    }

    /// The velocities after a wrench and these causes have acted for `duration`.
    pub(crate) fn kicked(&self, body: &Body, wrench: Wrench, duration: Real) -> VelocityUpdate {
        let [linear, angular] = self.damping.map(|rate| -rate * duration);
        let mean = |rate: Real| from_f64(phi1(to_f64(rate)));
        let pull = wrench.force * duration * body.inv_mass + self.own * duration;
        let twist = body.inv_inertia * (wrench.torque * duration);
        VelocityUpdate {
            body: body.handle,
            linvel: body.linvel + (body.linvel * linear + pull) * mean(linear),
            angvel: body.angvel + (body.angvel * angular + twist) * mean(angular),
            spins: false,
            wake: false,
        }
    }

    /// The same, with the change of the angular momentum.
    pub(crate) fn along(
        &self,
        body: &Body,
        wrench: Wrench,
        duration: Real,
    ) -> (VelocityUpdate, DVec3) {
        let rate = to_f64(-self.damping[1] * duration);
        let mut twist = to_dvec3(wrench.torque * (duration * from_f64(phi1(rate))));
        if rate != 0.0 {
            twist += body.angular_momentum_now() * rate.exp_m1();
        }
        (self.kicked(body, wrench, duration), twist)
    }

    /// The velocity after a force at the centre of mass and these causes have acted for `duration`. It is exact where
    /// the force is linear in the velocity: a drag of any strength stops a body without turning it back.
    #[inline(always)]
    pub(crate) fn slowed<T: Plain>(
        &self,
        linvel: Vec3<T>,
        inv_mass: T,
        felt: &CentreForce<T>,
        duration: f64,
    ) -> Vec3<T> {
        let damping = to_f64(self.damping[0]);
        let own = constant(to_dvec3(self.own));
        let all = felt.force * inv_mass + own - linvel * damping.into();
        let mean = felt.slowing.mean(all, inv_mass, damping, duration);
        stopped(linvel, mean * duration.into())
    }

    /// The same for one body.
    pub(crate) fn slowed_body(&self, body: &Body, felt: &CentreForce, duration: Real) -> Vector {
        let (linvel, inv_mass) = (constant(to_dvec3(body.linvel)), to_f64(body.inv_mass.x));
        from_dvec3(real(self.slowed(linvel, inv_mass, felt, to_f64(duration))))
    }

    /// The velocity to give to Rapier so that the body moves at `linvel`.
    pub(crate) fn given(&self, linvel: Vector) -> Vector {
        linvel - self.own * (0.5 * self.dt * (1.0 + self.iteration))
    }

    /// The velocity at which a body moves that was `given` this velocity.
    fn moves(&self, given: Vector) -> Vector {
        given + self.own * (0.5 * self.dt * (1.0 + self.iteration))
    }

    /// The part of the second half of a kick that a contact would have taken back if it had been there earlier; `given`
    /// is the velocity that Rapier was given. Without this, a body that floats just above the ground would be thrown up
    /// by its buoyancy when it touches it.
    pub(super) fn taken_back(
        &self,
        body: &Body,
        given: Option<Vector>,
        wrench: Wrench,
        duration: Real,
    ) -> Vector {
        let pushed = given.map_or(Vector::ZERO, |given| body.linvel - self.moves(given));
        let away = pushed.normalize_or_zero();
        let kick = away.dot(wrench.force * body.inv_mass) * duration;
        // Zero for a body that rebounds.
        if kick <= 0.0 || body.linvel.dot(away) > kick {
            return Vector::ZERO;
        }
        away * kick.min(pushed.length())
    }

    /// The velocity with which Rapier's step ends if it begins with `given`, except for damping.
    pub(super) fn arrives(&self, given: Vector) -> Vector {
        given + self.own * self.dt
    }

    /// The same causes, for a kick that is solved for.
    pub(super) fn besides(&self, body: &Body) -> Besides {
        let momentum = match self.damping {
            [0.0, 0.0] => Vector6::zeros(),
            _ => six(
                to_dvec3(body.linvel * body.mass),
                body.angular_momentum_now(),
            ),
        };
        Besides {
            damping: self.damping.map(to_f64),
            momentum,
            ..self.pull(body)
        }
    }

    /// Gravity and the user's force alone.
    pub(super) fn pull(&self, body: &Body) -> Besides {
        Besides {
            pull: six(to_dvec3(self.own * body.mass), DVec3::ZERO),
            ..Besides::default()
        }
    }

    /// The velocity at which the body has moved if Rapier's step ends with `linvel`, and the angular velocity.
    pub(crate) fn moved(&self, linvel: Vector, angvel: Vector) -> [Vector; 2] {
        let [linear, angular] = self.damping.map(|rate| 1.0 + rate * self.dt);
        let more = self.own * (0.5 * self.dt * (1.0 - self.iteration));
        [linvel * linear - more, angvel * angular]
    }

    /// The lag of the velocity that Rapier works with behind the true one.
    pub(crate) fn lag(&self) -> Vector {
        self.own * (0.5 * self.dt * self.iteration)
    }
}
