//! From wrenches to velocities, and the free rotations that Rapier carries out.

use super::rotation::{self, Inertia};
use crate::eval::Wrench;
use crate::math::{DVec3, Real, RigidBodyHandle, RigidBodySet, Vector, to_dvec3};
use crate::rapier::dynamics::RigidBody;

/// The largest speed whose square is finite.
#[cfg(feature = "f32")]
pub(super) const FASTEST: Real = 1.8e19;
/// The largest speed whose square is finite.
#[cfg(feature = "f64")]
pub(super) const FASTEST: Real = 1.3e154;

/// A free rotation that Rapier is carrying out.
pub(super) struct Spin {
    pub body: RigidBodyHandle,
    /// In the world; conserved but for what contacts and joints add.
    pub angular_momentum: DVec3,
    /// The angular velocity that Rapier was given, and changes when something pushes the body.
    pub steady: Vector,
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
        twist: Vector,
        dt: Real,
        substeps: u32,
    ) -> Self {
        let attitude = *body.rotation();
        let turned = inertia.angular_momentum(attitude, body.angvel());
        let angular_momentum = turned + to_dvec3(twist);
        let rotation = inertia.free_rotation(attitude, angular_momentum, dt);
        let substeps = substeps + body.additional_solver_iterations() as u32;
        Spin {
            body: handle,
            angular_momentum,
            steady: rotation::steady_angvel(rotation, dt, substeps),
        }
    }
}

/// The inertia of a body whose free rotation is the layer's to do: one that turns, freely, and
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
        if update.spins {
            body.enable_gyroscopic_forces(false);
        }
    }
    updates.len()
}

/// Turns the steady velocities back into the true ones, with what pushed the bodies meanwhile.
pub(super) fn finish_spins(bodies: &mut RigidBodySet, spins: &[Spin]) {
    for spin in spins {
        let Some(body) = bodies.get_mut(spin.body) else {
            continue;
        };
        body.enable_gyroscopic_forces(true);
        // A body that fell asleep, or was quarantined, has come to rest.
        if body.is_sleeping() || !body.is_enabled() {
            continue;
        }
        if let Some(inertia) = Inertia::of(body) {
            let pushed = body.angvel() - spin.steady;
            let angvel = inertia.angvel_after(*body.rotation(), spin.angular_momentum);
            body.set_angvel(angvel + pushed, false);
        }
    }
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
