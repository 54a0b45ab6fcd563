//! Torque-free rotation of a rigid body over one time step, realised through Rapier.
//!
//! Rapier turns a body with a constant world angular velocity over `n` linearised substeps and
//! changes that velocity by a first-order gyroscopic term, which adds energy and, in `f32`, drifts
//! faster the smaller the step. With that term off (`enable_gyroscopic_forces(false)`) and fast
//! rotation allowed, Rapier carries out the exact motion as follows:
//!
//! 1. before the step, [`Inertia::angular_momentum`] L of the body, then its
//!    [`Inertia::free_rotation`] ΔR over the step, then [`steady_angvel`] of ΔR as the velocity;
//! 2. Rapier steps;
//! 3. after it, [`Inertia::angvel_after`] of L and the attitude that Rapier reached, plus the change of the
//!    steady velocity by contacts and joints.
//!
//! The error of the attitude does not enter L, so L is kept to rounding, as is ΔR. All arithmetic is
//! `f64` in both builds, and results are rounded once: the rounding of `f32` is biased over many steps,
//! and the conversion costs nothing.

use super::principal_inertia::PrincipalInertia;
use super::small_turn::{AxisCoupling, SeriesPlan, series_error};
use super::taylor_rotation::Rotor;
use crate::math::{DQuat, DVec3, Real, Vector, from_dvec3, to_dquat, to_dvec3, to_f64};
use crate::number::{Plain, constant};
use crate::rapier::dynamics::{MassProperties, RigidBody};

#[cfg(test)]
pub(super) mod tests;

/// Bound of the relative energy error of the splitting, which does not grow with time; see [`Splitting::steps`].
pub(crate) const ENERGY_ERROR: f64 = 1.0e-5;

/// The bound for a splitting that is one step of a composition of fourth order: the error of the composition is
/// about the square of this.
pub(crate) const COMPOSED_ENERGY_ERROR: f64 = 3.0e-3;

/// Upper bound of the splitting's steps, so that the cost of one body is bounded when a step spans whole turns.
/// The energy error then grows.
const MAX_SPLITTING_STEPS: u32 = 256;

/// Largest tangent of half the angle of one linearised substep: a substep of half a turn would need an infinite
/// velocity. The cap costs such a substep 2e-4 rad, and changes no other.
const MAX_HALF_TANGENT: f64 = 1.0e4;

/// Up to this tangent of half an angle, tangents and their arcs are series.
const SMALL_TANGENT: f64 = 0.05;

/// Moments within this relative spread count as equal: Rapier computes them by an eigendecomposition in [`Real`],
/// accurate to some tens of roundings. If a top with such a spread is treated as spherical, the error in the
/// direction of L is no larger than the spread.
const SPHERICAL_SPREAD: Real = 64.0 * Real::EPSILON;

/// The rotational inertia of a free rigid body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inertia {
    /// About the principal axes; positive and finite.
    moments: DVec3,
    /// `1 / moments`, to rounding.
    inverse_moments: DVec3,
    /// Takes principal axes to body axes.
    principal_to_body: DQuat,
}

impl Inertia {
    /// The inertia of `body`, or `None` if it is no free top: not dynamic, or it cannot turn about some axis.
    pub(crate) fn of(body: &RigidBody) -> Option<Self> {
        let free = body.is_dynamic() && !body.is_rotation_locked().contains(&true);
        free.then(|| Self::new(&body.mass_properties().local_mprops))
            .flatten()
    }

    /// From mass properties; see [`Inertia::of_principal`].
    pub(crate) fn new(mass_properties: &MassProperties) -> Option<Self> {
        Self::of_principal(PrincipalInertia::of(mass_properties))
    }

    /// `None` if a principal moment is zero, infinite or NaN.
    pub(crate) fn of_principal(principal: PrincipalInertia) -> Option<Self> {
        let inverse_moments = to_dvec3(principal.inverse);
        let moments = inverse_moments.recip();
        let usable = |v: DVec3| v.is_finite() && v.min_element() > 0.0;
        (usable(inverse_moments) && usable(moments)).then(|| Self {
            moments,
            inverse_moments,
            principal_to_body: to_dquat(principal.frame),
        })
    }

    /// Returns true if all moments are equal, to rounding. The angular velocity is then constant, and Rapier
    /// turns the body correctly but for the linearised angle of its substeps.
    pub(crate) fn is_spherical(&self) -> bool {
        let largest = self.moments.max_element();
        largest - self.moments.min_element() <= to_f64(SPHERICAL_SPREAD) * largest
    }

    /// L = I w about the centre of mass, in world axes, of a body that turns with world velocity
    /// `angvel`.
    pub(crate) fn angular_momentum(&self, attitude: DQuat, angvel: DVec3) -> DVec3 {
        let to_world = attitude * self.principal_to_body;
        to_world * (self.moments * (to_world.inverse() * angvel))
    }

    /// w = I⁻¹ L: the world angular velocity of a body with `angular_momentum_world` at `attitude_after`, the
    /// attitude at the end of the step.
    pub(crate) fn angvel_after(
        &self,
        attitude_after: DQuat,
        angular_momentum_world: DVec3,
    ) -> DVec3 {
        let to_world = attitude_after * self.principal_to_body;
        let momentum = to_world.inverse() * angular_momentum_world;
        to_world * (self.inverse_moments * momentum)
    }

    /// ΔR of free motion over `dt`: the attitude goes from R to ΔR R.
    ///
    /// A small turn is a series of its scaled axis ([`AxisCoupling`]). Else one step of the splitting below is used
    /// where it is accurate to rounding, as for all symmetric tops. Else several of those series, or a Taylor series
    /// ([`Rotor::attitude_after`]), give ΔR to rounding. If the body turns too often for that, more than some ten
    /// times within `dt`, the splitting takes the number of steps that keeps its energy within [`ENERGY_ERROR`].
    ///
    /// With b the middle moment and ℓ = Rᵀ L, the kinetic energy is
    /// |ℓ|²/2b + (1/a - 1/b) ℓₐ²/2 + (1/c - 1/b) ℓ_c²/2. The first term commutes with the others
    /// and turns the body about L by |L| dt / b; each of the others turns it about its own axis,
    /// and the two are Strang-split. A symmetric top has only one of them, so its rotation is exact.
    ///
    /// Splitting into single-axis turns: Touma and Wisdom, Astron. J. 107 (1994) 1189; Dullweber,
    /// Leimkuhler and McLachlan, J. Chem. Phys. 107 (1997) 5840. How much the choice of
    /// the parts matters: Fassò, J. Comput. Phys. 189 (2003) 527.
    pub(crate) fn free_rotation(
        &self,
        attitude: DQuat,
        angular_momentum_world: DVec3,
        dt: f64,
    ) -> DQuat {
        self.free_rotation_within(attitude, angular_momentum_world, dt, ENERGY_ERROR)
    }

    /// [`Self::free_rotation`] with another bound of the relative energy error.
    pub(crate) fn free_rotation_within(
        &self,
        attitude: DQuat,
        angular_momentum_world: DVec3,
        dt: f64,
        energy_error: f64,
    ) -> DQuat {
        let to_world = attitude * self.principal_to_body;
        let momentum = to_world.inverse() * angular_momentum_world;
        let rounding = to_f64(Real::EPSILON);
        let coupling = AxisCoupling::new(constant(self.moments), constant(self.inverse_moments));
        let angle = (self.inverse_moments * momentum).length() * dt.abs();
        let plan = coupling.plan(angle, series_error());
        let small = |plan| {
            let turn = self.small_turn(coupling, momentum, dt, plan);
            let half = to_world * turn.xyz();
            DQuat::from_xyzw(half.x, half.y, half.z, turn.w)
        };
        if let Some(plan) = plan.filter(|plan| plan.steps == 1) {
            return small(plan);
        }
        let split = Splitting::new(self, momentum);
        if split.steps(dt, rounding) > 1 {
            if let Some(plan) = plan {
                return small(plan);
            }
            let rotor = Rotor {
                inverse_moments: self.inverse_moments,
                principal_to_body: self.principal_to_body,
            };
            let momentum = angular_momentum_world;
            if let Some(after) = rotor.attitude_after(attitude, momentum, dt, series_error()) {
                return (after * attitude.inverse()).normalize();
            }
        }
        let common = DQuat::from_scaled_axis(angular_momentum_world * (split.common_rate * dt));
        let anisotropic = split.turn(momentum, dt, split.steps(dt, energy_error));
        (common * to_world * anisotropic * to_world.inverse()).normalize()
    }

    /// The rotation over `dt` of a body with this momentum; both in principal axes.
    fn small_turn(
        &self,
        coupling: AxisCoupling<f64>,
        momentum: DVec3,
        dt: f64,
        plan: SeriesPlan,
    ) -> DQuat {
        let h = dt / f64::from(plan.steps);
        let turn = |momentum| coupling.turn(self.inverse_moments * momentum * h, plan);
        let mut all = turn(momentum);
        for _ in 1..plan.steps {
            all *= turn(all.inverse() * momentum);
        }
        all
    }
}

/// One principal axis of a [`Splitting`].
#[derive(Clone, Copy)]
struct PrincipalAxis {
    direction: DVec3,
    /// Rate of turning per unit of angular momentum along the axis.
    rate: f64,
    /// Upper bound of the angular speed of this part of the rotation.
    max_speed: f64,
}

/// The kinetic energy of a top as a spherical part and two single-axis parts.
struct Splitting {
    /// 1/b, b the middle moment.
    common_rate: f64,
    /// The faster axis: the error constant is smaller with its half turns on the outside.
    outer: PrincipalAxis,
    inner: PrincipalAxis,
    /// 2 E / |L|, the angular velocity along L.
    mean_speed: f64,
}

impl Splitting {
    fn new(inertia: &Inertia, momentum: DVec3) -> Self {
        let inverse = inertia.inverse_moments;
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| inverse[i].total_cmp(&inverse[j]));
        let common_rate = inverse[order[1]];

        let twice_energy = momentum.dot(inverse * momentum);
        let axis = |k: usize| {
            let rate = inverse[k] - common_rate;
            // The angular momentum along one axis is bounded by |L|, and by the whole energy.
            let most = momentum
                .length_squared()
                .min(twice_energy * inertia.moments[k]);
            PrincipalAxis {
                direction: DVec3::AXES[k],
                rate,
                max_speed: rate.abs() * most.sqrt(),
            }
        };
        let (mut outer, mut inner) = (axis(order[0]), axis(order[2]));
        if outer.max_speed < inner.max_speed {
            std::mem::swap(&mut outer, &mut inner);
        }
        let mean_speed = twice_energy / momentum.length();
        Self {
            common_rate,
            outer,
            inner,
            mean_speed,
        }
    }

    /// The number of steps over `dt` that keeps the relative error of the energy within `energy_error`.
    ///
    /// The splitting conserves an energy that differs from the true one by a fraction of at most
    /// α² γ / (8 θ steps²), with α, γ the largest turns of the two axes over `dt` and θ = 2 E dt / |L|.
    /// The form is that of the leading term of the modified Hamiltonian, [A, [A, C]]; the 8 was
    /// measured: the largest error over 3000 random tops at |w| dt = 0.2 is 8.7e-6.
    fn steps(&self, dt: f64, energy_error: f64) -> u32 {
        let (outer, inner) = (self.outer.max_speed, self.inner.max_speed);
        let error = 0.125 * outer * outer * inner * dt * dt / (self.mean_speed * energy_error);
        // The cast saturates, and turns the NaN of a body at rest into zero.
        (error.sqrt().ceil() as u32).clamp(1, MAX_SPLITTING_STEPS)
    }

    /// The rotation, in principal axes, of the two single-axis parts over `dt`.
    fn turn(&self, momentum: DVec3, dt: f64, steps: u32) -> DQuat {
        let h = dt / f64::from(steps);
        let mut top = SplitTop {
            momentum,
            rotation: DQuat::IDENTITY,
        };
        top.turn(&self.outer, 0.5 * h);
        for remaining in (0..steps).rev() {
            top.turn(&self.inner, h);
            // Neighbouring half turns are merged.
            top.turn(&self.outer, if remaining == 0 { 0.5 * h } else { h });
        }
        top.rotation
    }
}

/// A body in its own principal axes: its angular momentum there, and the rotation since the start.
struct SplitTop {
    momentum: DVec3,
    rotation: DQuat,
}

impl SplitTop {
    fn turn(&mut self, axis: &PrincipalAxis, h: f64) {
        let angle = axis.rate * axis.direction.dot(self.momentum) * h;
        let turn = DQuat::from_axis_angle(axis.direction, angle);
        self.rotation *= turn;
        self.momentum = turn.inverse() * self.momentum;
    }
}

/// The constant world angular velocity with which Rapier's `substeps` linearised substeps of `dt`
/// in all turn a body by exactly `delta`.
///
/// A substep of length h multiplies the attitude by normalize(1, w h / 2) (Rapier's
/// `RigidBodyVelocity::integrate_linearized`), a turn by 2 atan(|w| h / 2) about w. So
/// |w| = 2 n / dt tan(θ / 2n) for the angle θ of `delta`, which may exceed half a turn.
pub(crate) fn steady_angvel(delta: DQuat, dt: Real, substeps: u32) -> Vector {
    let (axis, sine) = (delta.xyz(), delta.xyz().length());
    if dt == 0.0 || sine == 0.0 {
        return Vector::ZERO;
    }
    let substeps = f64::from(substeps.max(1));
    // The tangent of half the angle, then that for one substep. `atan2` keeps all digits of small angles.
    let whole = sine / delta.w;
    let tangent = if whole.abs() <= SMALL_TANGENT {
        small_tangent(whole, substeps)
    } else {
        (sine.atan2(delta.w) / substeps).tan()
    };
    let tangent = tangent.clamp(-MAX_HALF_TANGENT, MAX_HALF_TANGENT);
    from_dvec3(axis * (2.0 * substeps / to_f64(dt) * tangent / sine))
}

/// tan(atan(`tangent`) / `parts`) to rounding, for a `tangent` of at most [`SMALL_TANGENT`].
fn small_tangent(tangent: f64, parts: f64) -> f64 {
    let x = tangent * tangent;
    let arc = [-1.0 / 11.0, 1.0 / 9.0, -1.0 / 7.0, 0.2, -1.0 / 3.0, 1.0];
    let angle = tangent * arc.iter().fold(0.0, |sum, term| sum * x + term) / parts;
    angle * tangent_ratio(angle * angle)
}

/// tan(y)/y to rounding, given y² of at most 0.01.
#[inline(always)]
pub(super) fn tangent_ratio<N: Plain>(y2: N) -> N {
    const TERMS: [f64; 7] = [
        21844.0 / 6_081_075.0,
        1382.0 / 155_925.0,
        62.0 / 2835.0,
        17.0 / 315.0,
        2.0 / 15.0,
        1.0 / 3.0,
        1.0,
    ];
    let [highest, rest @ ..] = TERMS;
    rest.iter()
        .fold(highest.into(), |sum: N, term| sum * y2 + *term)
}
