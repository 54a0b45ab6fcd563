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

/// New velocities of a body, not yet written.
pub(super) struct Update {
    pub body: RigidBodyHandle,
    pub wrench: Wrench,
    pub linvel: Vector,
    pub angvel: Vector,
    pub spin: Option<Spin>,
    pub wake: bool,
}

impl Update {
    /// Replaces the angular velocity by the steady one that Rapier turns into the free rotation
    /// over `dt`, after the torque acted for `duration`.
    pub(super) fn spin(
        &mut self,
        body: &RigidBody,
        inertia: &Inertia,
        duration: Real,
        dt: Real,
        substeps: u32,
    ) {
        let attitude = *body.rotation();
        let turned = inertia.angular_momentum(attitude, body.angvel());
        let momentum = turned + to_dvec3(self.wrench.torque * duration);
        let rotation = inertia.free_rotation(attitude, momentum, dt);
        let substeps = substeps + body.additional_solver_iterations() as u32;
        self.angvel = rotation::steady_angvel(rotation, dt, substeps);
        self.spin = Some(Spin {
            body: self.body,
            angular_momentum: momentum,
            steady: self.angvel,
        });
    }
}

/// The inertia of a body whose free rotation is the layer's to do: one that turns, freely, and
/// not like a ball.
pub(super) fn free_top(body: &RigidBody, angvel: Vector) -> Option<Inertia> {
    if angvel == Vector::ZERO || !body.gyroscopic_forces_enabled() {
        return None;
    }
    Inertia::of(body).filter(|inertia| !inertia.is_spherical())
}

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
        wrench,
        linvel: body.linvel() + wrench.force * duration * properties.effective_inv_mass,
        angvel: body.angvel() + twist,
        spin: None,
        wake: false,
    }
}

pub(super) fn write(
    bodies: &mut RigidBodySet,
    updates: Vec<Update>,
    spins: &mut Vec<Spin>,
) -> usize {
    let written = updates.len();
    for update in updates {
        let Some(body) = bodies.get_mut(update.body) else {
            continue;
        };
        if update.wake {
            body.wake_up(true);
        }
        body.set_linvel(update.linvel, false);
        body.set_angvel(update.angvel, false);
        if let Some(spin) = update.spin {
            body.enable_gyroscopic_forces(false);
            spins.push(spin);
        }
    }
    written
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
