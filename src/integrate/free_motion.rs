//! The motion of a free body apart from fields: Rapier's gravity, the user's force and damping.
//!
//! Rapier spreads its acceleration a over the n iterations of a step, and damps at its end; both are
//! of first order. So the half kicks of a body in fields include all of it, and Rapier's own part is
//! subtracted beforehand: a body that is to move at v is given v − (n + 1)/2n · a dt, and arrives at
//! v + (n − 1)/2n · a dt, damped.

use super::StepContext;
use super::coupling::ExternalTerms;
use super::motion::{MeanVelocity, VelocityUpdate};
use crate::eval::CentreForce;
use crate::math::{DVec3, Real, RigidBodyHandle, Vector, from_f64, to_dvec3, to_f64};
use crate::number::{LANES, Lanes, Vec3, each_lane};
use crate::rapier::dynamics::RigidBody;
use crate::rapier::na::Vector6;
use crate::rigid::{Body, Lookup, Wrench, phi1, six, stopped};

/// The causes that move a body freely in a step, apart from fields.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeMotion {
    /// Rapier's own acceleration: by gravity and the user's force.
    pub(super) own: Vector,
    damping: [Real; 2],
    /// One solver iteration, as a share of the step.
    pub(super) iteration: Real,
    dt: Real,
}

/// [`FreeMotion`] of several bodies, for their linear velocities only, in columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeMotions {
    own: [[Real; LANES]; 3],
    damping: [Real; LANES],
}

impl<W: Lookup> StepContext<'_, W> {
    pub(super) fn free_motion(&self, body: &Body) -> FreeMotion {
        FreeMotion::new(body, self.rules.gravity, self.rules.iterations, self.dt)
    }
}

impl FreeMotion {
    /// Only fields move the body.
    pub(crate) const NONE: FreeMotion = FreeMotion {
        own: Vector::ZERO,
        damping: [0.0; 2],
        iteration: 1.0,
        dt: 0.0,
    };

    pub(crate) fn new(body: &Body, gravity: Vector, iterations: u32, dt: Real) -> Self {
        let weight = gravity * (body.gravity_scale * body.mass);
        FreeMotion {
            own: (body.user_force + weight) * body.inv_mass,
            damping: body.damping,
            iteration: one_of(body.iterations(iterations)),
            dt,
        }
    }

    /// [`Self::new`] for a body in Rapier's set.
    #[inline]
    pub(crate) fn of(body: &RigidBody, gravity: Vector, iterations: u32, dt: Real) -> Self {
        let weight = gravity * (body.gravity_scale() * body.mass());
        let extra = u32::try_from(body.additional_solver_iterations()).unwrap_or(u32::MAX);
        FreeMotion {
            own: (body.user_force() + weight) * body.mass_properties().effective_inv_mass,
            damping: [body.linear_damping(), body.angular_damping()],
            iteration: one_of(iterations.saturating_add(extra)),
            dt,
        }
    }

    /// These causes without damping.
    pub(crate) fn undamped(self) -> Self {
        FreeMotion {
            damping: [0.0; 2],
            ..self
        }
    }

    /// Returns true if only fields move the body.
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

    /// [`Self::kicked`], and the change of the angular momentum.
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

    /// The factor by which damping alone changes the angular velocity of a ball over `duration`.
    pub(crate) fn spin_kept(&self, duration: Real) -> Real {
        let rate = -self.damping[1] * duration;
        if rate == 0.0 {
            return 1.0;
        }
        1.0 + rate * from_f64(phi1(to_f64(rate)))
    }

    /// The velocity to give to Rapier so that the body moves at `linvel`.
    pub(crate) fn given(&self, linvel: Vector) -> Vector {
        linvel - self.own * (0.5 * self.dt * (1.0 + self.iteration))
    }

    /// The record of a body that moves at `linvel` because Rapier gets [`Self::given`]; damping acts afterwards.
    pub(crate) fn carried_out(&self, body: RigidBodyHandle, linvel: Vector) -> MeanVelocity {
        MeanVelocity {
            body,
            expected: self.arrives(self.given(linvel)),
            linvel,
            damped: false,
            given: None,
            behind: Vector::ZERO,
        }
    }

    /// The velocity at which a body moves if Rapier was `given` this one.
    fn moves(&self, given: Vector) -> Vector {
        given + self.own * (0.5 * self.dt * (1.0 + self.iteration))
    }

    /// The part of the second half of a kick that a contact would have taken back if it had been there earlier; `given`
    /// is the velocity that Rapier was given. Without this, buoyancy would throw up a body that floats just above the
    /// ground and touches it.
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
    fn arrives(&self, given: Vector) -> Vector {
        given + self.own * self.dt
    }

    /// These causes, for a kick that is solved for.
    pub(super) fn external(&self, body: &Body) -> ExternalTerms {
        let momentum = match self.damping {
            [0.0, 0.0] => Vector6::zeros(),
            _ => six(
                to_dvec3(body.linvel * body.mass),
                body.angular_momentum_now(),
            ),
        };
        ExternalTerms {
            damping: self.damping.map(to_f64),
            momentum,
            ..self.pull(body)
        }
    }

    /// Gravity and the user's force alone.
    pub(super) fn pull(&self, body: &Body) -> ExternalTerms {
        ExternalTerms {
            pull: six(to_dvec3(self.own * body.mass), DVec3::ZERO),
            ..ExternalTerms::default()
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

/// One of these iterations, as a share of the step.
fn one_of(iterations: u32) -> Real {
    (iterations.max(1) as Real).recip()
}

impl FreeMotions {
    /// The causes that move several bodies; [`FreeMotion::NONE`] for those for which `acts` is false.
    #[inline(always)]
    pub(crate) fn new(each: &[FreeMotion; LANES], acts: impl Fn(usize) -> bool) -> Self {
        let of = |lane: usize| {
            if acts(lane) {
                &each[lane]
            } else {
                &FreeMotion::NONE
            }
        };
        FreeMotions {
            own: [0, 1, 2].map(|axis| each_lane(|lane| of(lane).own[axis])),
            damping: each_lane(|lane| of(lane).damping[0]),
        }
    }

    /// The velocities after constant forces and these causes have acted for `duration`, as [`FreeMotion::kicked`].
    #[inline(always)]
    pub(crate) fn kicked(
        &self,
        linvels: &[[Real; LANES]; 3],
        forces: &[[Real; LANES]; 3],
        inv_masses: &[[Real; LANES]; 3],
        duration: Real,
    ) -> [[Real; LANES]; 3] {
        let rates = self.damping.map(|damping| -damping * duration);
        let mut means = [1.0; LANES];
        if self.damping != [0.0; LANES] {
            means = rates.map(|rate| from_f64(phi1(to_f64(rate))));
        }
        [0, 1, 2].map(|axis| {
            let (was, forces, own) = (&linvels[axis], &forces[axis], &self.own[axis]);
            each_lane(|lane| {
                let pull = forces[lane] * duration * inv_masses[axis][lane] + own[lane] * duration;
                was[lane] + (was[lane] * rates[lane] + pull) * means[lane]
            })
        })
    }

    /// [`Self::kicked`] for forces at the centres of mass that may depend on velocities. It is exact where a force is
    /// linear in the velocity: a drag of any strength stops a body without reversing it. Where a force depends on the
    /// velocity, `inv_masses` must be the same along all axes.
    #[inline(always)]
    pub(crate) fn slowed(
        &self,
        linvels: Vec3<Lanes>,
        inv_masses: Vec3<Lanes>,
        felt: &CentreForce,
        duration: f64,
    ) -> Vec3<Lanes> {
        let [x, y, z] = self.own.map(widened);
        let (own, damping) = (Vec3::new(x, y, z), widened(self.damping));
        let pull = felt
            .force
            .zip(inv_masses, |force, inv_mass| force * inv_mass);
        let all = pull + own - linvels * damping;
        let mean = felt.slowing.mean(all, inv_masses.x, damping, duration);
        stopped(linvels, mean * duration.into())
    }
}

#[inline(always)]
fn widened(column: [Real; LANES]) -> Lanes {
    Lanes::from_fn(|lane| to_f64(column[lane]))
}
