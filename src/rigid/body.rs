//! A copy of the state of one rigid body, which the stages of a step read in place of Rapier's set.

use super::principal_inertia::PrincipalInertia;
use super::rotation::Inertia;
use crate::math::{
    AngularInertia, ColliderHandle, DVec3, Pose, Real, RigidBodyHandle, Vector, to_dquat, to_dvec3,
};
use crate::rapier::dynamics::RigidBody;

/// A dynamic body at one moment, in world axes unless a member says otherwise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    pub handle: RigidBodyHandle,
    pub pose: Pose,
    pub linvel: Vector,
    pub angvel: Vector,
    /// The centre of mass, in the body's frame.
    pub local_com: Vector,
    pub mass: Real,
    /// Zero along locked axes of the world.
    pub inv_mass: Vector,
    /// In world axes, zero about locked ones.
    pub inv_inertia: AngularInertia,
    pub principal_inertia: PrincipalInertia,
    pub rotation_locked: [bool; 3],
    /// True if Rapier applies gyroscopic forces to it.
    pub gyroscopic: bool,
    pub sleeping: bool,
    /// Time for which it has been slow enough to fall asleep (s).
    pub drowsy: Real,
    /// Time after which a slow body falls asleep (s).
    pub patience: Real,
    pub gravity_scale: Real,
    /// Force set by the user, without the force of fields.
    pub user_force: Vector,
    pub user_torque: Vector,
    /// Rates of Rapier's damping, linear and angular (1/s).
    pub damping: [Real; 2],
    /// Solver iterations on top of those of the world.
    pub extra_iterations: u32,
    pub parts: PartsMark,
}

/// A mark of a body's list of colliders. It changes whenever one is added or removed, because new ones come last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct PartsMark {
    count: u32,
    last: Option<ColliderHandle>,
}

impl PartsMark {
    #[inline]
    pub(crate) fn of(body: &RigidBody) -> Self {
        let colliders = body.colliders();
        PartsMark {
            count: colliders.len() as u32,
            last: colliders.last().copied(),
        }
    }
}

impl Body {
    #[inline]
    pub(crate) fn of(handle: RigidBodyHandle, body: &RigidBody) -> Self {
        let properties = body.mass_properties();
        let local = &properties.local_mprops;
        let extra = body.additional_solver_iterations();
        Body {
            handle,
            pose: *body.position(),
            linvel: body.linvel(),
            angvel: body.angvel(),
            local_com: body.local_center_of_mass(),
            mass: body.mass(),
            inv_mass: properties.effective_inv_mass,
            inv_inertia: properties.effective_world_inv_inertia,
            principal_inertia: PrincipalInertia::of(local),
            rotation_locked: body.is_rotation_locked(),
            gyroscopic: body.gyroscopic_forces_enabled(),
            sleeping: body.is_sleeping(),
            drowsy: drowsy(body),
            patience: body.activation().time_until_sleep,
            gravity_scale: body.gravity_scale(),
            user_force: body.user_force(),
            user_torque: body.user_torque(),
            damping: [body.linear_damping(), body.angular_damping()],
            extra_iterations: u32::try_from(extra).unwrap_or(u32::MAX),
            parts: PartsMark::of(body),
        }
    }

    /// The centre of mass in the world. Rapier's own is stale after a body was teleported, until its next step.
    pub(crate) fn world_com(&self) -> Vector {
        self.pose.transform_point(self.local_com)
    }

    /// The inertia of the body, or `None` if an axis cannot turn.
    pub(crate) fn inertia(&self) -> Option<Inertia> {
        let free = self.rotation_locked == [false; 3];
        free.then(|| Inertia::of_principal(self.principal_inertia))
            .flatten()
    }

    /// The inertia of a body at angular velocity `angvel` if this crate is to compute its free rotation: it
    /// turns, no axis is locked, gyroscopic forces are on, and its moments differ (which is not required with
    /// `balls_too`). `None` if Rapier is to turn it.
    pub(crate) fn free_top(&self, angvel: Vector, balls_too: bool) -> Option<Inertia> {
        let [x, y, z] = self.principal_inertia.inverse.to_array();
        let round = !balls_too && x == y && y == z;
        if angvel == Vector::ZERO || !self.gyroscopic || round {
            return None;
        }
        let inertia = self.inertia();
        inertia.filter(|inertia| balls_too || !inertia.is_spherical())
    }

    /// The angular momentum about the centre of mass, in world axes, of a body with this inertia.
    pub(crate) fn angular_momentum(&self, inertia: &Inertia) -> DVec3 {
        inertia.angular_momentum(to_dquat(self.pose.rotation), to_dvec3(self.angvel))
    }

    /// The number of solver iterations over which Rapier moves the body, in a world of `substeps` iterations.
    pub(crate) fn iterations(&self, substeps: u32) -> u32 {
        substeps.saturating_add(self.extra_iterations)
    }
}

/// The time (s) up to which Rapier's record of how long a body has been slow counts as zero: this crate leaves such
/// numbers there as marks, by which it recognises the next step.
pub(crate) const SMALLEST_TIME: Real = 1e-30;

/// The time for which a body has been slow enough to fall asleep (s).
#[inline]
pub(crate) fn drowsy(body: &RigidBody) -> Real {
    let time = body.activation().time_since_can_sleep;
    if time > SMALLEST_TIME { time } else { 0.0 }
}

/// The velocity of the origin of a body's frame. For a body that is not dynamic the centre of mass may be
/// anywhere: Rapier computes it for open meshes too, and does not use it.
pub(crate) fn origin_velocity(body: &RigidBody) -> Vector {
    if body.angvel() == Vector::ZERO {
        return body.linvel();
    }
    body.linvel() + body.angvel().cross(body.translation() - world_com(body))
}

/// The centre of mass of a body in the world. Rapier's own is the world's origin for a body without colliders that has
/// not been stepped yet.
#[inline(always)]
pub(crate) fn world_com(body: &RigidBody) -> Vector {
    body.position().transform_point(body.local_center_of_mass())
}

/// Returns true if pose, velocities and user forces are finite. Other bodies are left to Rapier, which
/// quarantines them in its step.
#[inline]
pub(crate) fn is_sound(body: &RigidBody) -> bool {
    let pose = body.position();
    // Zero times a number is NaN where the number is not finite; a sum of such products shows all of them at once.
    let moves = body.linvel() * 0.0 + body.angvel() * 0.0;
    let pushed = body.user_force() * 0.0 + body.user_torque() * 0.0;
    pose.translation * 0.0 + moves + pushed == Vector::ZERO && pose.rotation.is_finite()
}
