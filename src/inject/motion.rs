//! From wrenches to velocities, and the free rotations that Rapier carries out.

use super::realise::Start;
use crate::math::{DVec3, Real, RigidBodyHandle, RigidBodySet, Vector};
use crate::math::{from_dvec3, to_dvec3, to_f64};
use crate::rapier::dynamics::RigidBody;
use crate::rigid::Wrench;
use crate::rigid::{Inertia, steady_angvel, to_dquat};

/// The largest speed whose square is finite.
#[cfg(feature = "f32")]
pub(super) const FASTEST: Real = 1.8e19;
/// The largest speed whose square is finite.
#[cfg(feature = "f64")]
pub(super) const FASTEST: Real = 1.3e154;

/// A rotation that Rapier is carrying out.
pub(super) struct Spin {
    pub body: RigidBodyHandle,
    /// How the body turns at its end.
    pub after: Turned,
    /// Whether Rapier's gyroscopic term was on, and is to be put on again.
    pub gyroscopic: bool,
    /// The angular velocity that Rapier was given, and changes when something pushes the body.
    pub steady: Vector,
}

/// How a body turns at the end of a step that nothing interferes with.
pub(super) enum Turned {
    /// As a free top of this angular momentum, in the world.
    Momentum(DVec3),
    /// With this angular velocity.
    Velocity(DVec3),
}

/// A way that Rapier is carrying out.
pub(super) struct Ride {
    pub body: RigidBodyHandle,
    /// The velocity that Rapier arrives with if nothing interferes, but for damping.
    pub expected: Vector,
    /// The velocity that the body then has in truth.
    pub linvel: Vector,
}

/// A user's forces, while ours stand in their place.
pub(super) struct Loan {
    pub body: RigidBodyHandle,
    pub force: Vector,
    pub torque: Vector,
}

/// New velocities of bodies, not yet written, and the free rotations that begin with them.
#[derive(Default)]
pub(super) struct Kicks {
    pub updates: Vec<Update>,
    pub spins: Vec<Spin>,
    pub rides: Vec<Ride>,
    /// Bodies to be pushed by Rapier's own forces, by place, and whether to wake them.
    pub lent: Vec<(usize, bool)>,
    /// Bodies that the inner integrator is to move.
    pub inner: Vec<Start>,
}

impl Kicks {
    pub(super) fn clear(&mut self) {
        self.lent.clear();
        self.inner.clear();
        self.updates.clear();
        self.spins.clear();
        self.rides.clear();
    }
}

/// New velocities of a body.
pub(super) struct Update {
    pub body: RigidBodyHandle,
    pub linvel: Vector,
    pub angvel: Vector,
    pub spins: bool,
    pub wake: bool,
}

impl Spin {
    /// The free rotation of a body over `dt`, after an angular impulse `twist`; Rapier turns the
    /// steady velocity into it.
    pub(super) fn new(
        handle: RigidBodyHandle,
        body: &RigidBody,
        inertia: &Inertia,
        twist: DVec3,
        dt: Real,
        substeps: u32,
    ) -> Self {
        let attitude = to_dquat(*body.rotation());
        let turned = inertia.angular_momentum(attitude, to_dvec3(body.angvel()));
        let angular_momentum = turned + twist;
        let rotation = inertia.free_rotation(attitude, angular_momentum, to_f64(dt));
        Spin {
            body: handle,
            after: Turned::Momentum(angular_momentum),
            gyroscopic: true,
            steady: steady_angvel(rotation, dt, iterations(body, substeps)),
        }
    }
}

/// Over how many iterations Rapier moves a body.
pub(super) fn iterations(body: &RigidBody, substeps: u32) -> u32 {
    substeps.saturating_add(u32::try_from(body.additional_solver_iterations()).unwrap_or(u32::MAX))
}

/// The inertia of a body whose free rotation is this crate's to do: one that turns, freely, and
/// not like a ball, unless even those are to be turned exactly.
pub(super) fn free_top(body: &RigidBody, angvel: Vector, balls_too: bool) -> Option<Inertia> {
    if angvel == Vector::ZERO || !body.gyroscopic_forces_enabled() {
        return None;
    }
    Inertia::of(body).filter(|inertia| balls_too || !inertia.is_spherical())
}

/// The velocities of a body after a wrench has acted for `duration`.
pub(super) fn kicked(
    handle: RigidBodyHandle,
    body: &RigidBody,
    wrench: Wrench,
    duration: Real,
) -> Update {
    let properties = body.mass_properties();
    let twist = properties.effective_world_inv_inertia * (wrench.torque * duration);
    Update {
        body: handle,
        linvel: body.linvel() + wrench.force * duration * properties.effective_inv_mass,
        angvel: body.angvel() + twist,
        spins: false,
        wake: false,
    }
}

pub(super) fn write(bodies: &mut RigidBodySet, updates: &[Update]) -> usize {
    for update in updates {
        let Some(body) = bodies.get_mut(update.body) else {
            continue;
        };
        if update.wake {
            body.wake_up(true);
        }
        body.set_linvel(update.linvel, false);
        body.set_angvel(update.angvel, false);
        if update.spins && body.gyroscopic_forces_enabled() {
            body.enable_gyroscopic_forces(false);
        }
    }
    updates.len()
}

/// Turns the velocities that Rapier was given back into the true ones, with what pushed the bodies
/// meanwhile.
pub(super) fn finish(bodies: &mut RigidBodySet, spins: &[Spin], rides: &[Ride], dt: Real) {
    for spin in spins {
        let Some(body) = bodies.get_mut(spin.body) else {
            continue;
        };
        if spin.gyroscopic {
            body.enable_gyroscopic_forces(true);
        }
        if is_at_rest(body) {
            continue;
        }
        let angvel = match spin.after {
            Turned::Momentum(momentum) => Inertia::of(body)
                .map(|inertia| inertia.angvel_after(to_dquat(*body.rotation()), momentum)),
            Turned::Velocity(angvel) => Some(angvel),
        };
        if let Some(angvel) = angvel {
            let kept = damped(body.angular_damping(), dt);
            let pushed = body.angvel() - spin.steady * kept;
            body.set_angvel(from_dvec3(angvel) * kept + pushed, false);
        }
    }
    for ride in rides {
        let Some(body) = bodies.get_mut(ride.body).filter(|body| !is_at_rest(body)) else {
            continue;
        };
        let kept = damped(body.linear_damping(), dt);
        let pushed = body.linvel() - ride.expected * kept;
        body.set_linvel(ride.linvel * kept + pushed, false);
    }
}

/// A body that fell asleep, or was quarantined, has come to rest.
fn is_at_rest(body: &RigidBody) -> bool {
    body.is_sleeping() || !body.is_enabled()
}

/// What Rapier's damping leaves of a velocity.
fn damped(damping: Real, dt: Real) -> Real {
    (1.0 + dt * damping).recip()
}

/// Gives the users their forces back, bit for bit: resetting first, since (u + f) − f is not u.
pub(super) fn take_back(bodies: &mut RigidBodySet, loans: &[Loan]) -> usize {
    for loan in loans {
        if let Some(body) = bodies.get_mut(loan.body) {
            body.reset_forces(false);
            body.reset_torques(false);
            body.add_force(loan.force, false);
            body.add_torque(loan.torque, false);
        }
    }
    loans.len()
}
