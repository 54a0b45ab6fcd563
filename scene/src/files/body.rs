//! Rigid bodies.

use serde::{Deserialize, Serialize};

use super::collider::ColliderDoc;
use super::error::{FileError, content};
use super::fields::Sampling;
use super::fields::rapier::dynamics::{
    LockedAxes, RigidBody, RigidBodyActivation, RigidBodyAdditionalMassProps, RigidBodyBuilder,
    RigidBodyType,
};
use super::mass::MassDoc;
use super::number::{
    Num, Quad, Triple, bounded, count, not_negative, placed, quad, unless, unless_num, unless_zero,
};

/// A rigid body. Keys are named after Rapier's settings.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct BodyDoc {
    /// For readers and references in the file; the world has no names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    #[serde(rename = "type", default, skip_serializing_if = "TypeDoc::is_usual")]
    body_type: TypeDoc,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    at: Option<Triple>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rotation: Option<Quad>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    velocity: Option<Triple>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    angular_velocity: Option<Triple>,
    /// The user's force, which acts in every step, as does the torque.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    force: Option<Triple>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    torque: Option<Triple>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    gravity_scale: Option<Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    linear_damping: Option<Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    angular_damping: Option<Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    added_mass: Option<AddedMassDoc>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    locked: Vec<LockDoc>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dominance: Option<i8>,
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    enabled: bool,
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    can_sleep: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    sleeping: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    ccd: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    soft_ccd_prediction: Option<Num>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    allow_fast_rotation: bool,
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    gyroscopic_forces: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    additional_solver_iterations: Option<usize>,
    /// The sampling of the body by fields that have none of their own.
    #[serde(
        default,
        deserialize_with = "super::field::sampling",
        skip_serializing_if = "Option::is_none"
    )]
    pub sampling: Option<Sampling>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub colliders: Vec<ColliderDoc>,
}

/// The default of some keys.
pub(super) fn yes() -> bool {
    true
}

pub(super) fn is_yes(value: &bool) -> bool {
    *value
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
enum TypeDoc {
    #[default]
    Dynamic,
    Fixed,
    KinematicPositionBased,
    KinematicVelocityBased,
}

impl TypeDoc {
    fn is_usual(&self) -> bool {
        *self == TypeDoc::Dynamic
    }

    fn read(self) -> RigidBodyType {
        match self {
            TypeDoc::Dynamic => RigidBodyType::Dynamic,
            TypeDoc::Fixed => RigidBodyType::Fixed,
            TypeDoc::KinematicPositionBased => RigidBodyType::KinematicPositionBased,
            TypeDoc::KinematicVelocityBased => RigidBodyType::KinematicVelocityBased,
        }
    }

    fn write(body_type: RigidBodyType) -> Self {
        match body_type {
            RigidBodyType::Dynamic | RigidBodyType::SoftFrame => TypeDoc::Dynamic,
            RigidBodyType::Fixed => TypeDoc::Fixed,
            RigidBodyType::KinematicPositionBased => TypeDoc::KinematicPositionBased,
            RigidBodyType::KinematicVelocityBased => TypeDoc::KinematicVelocityBased,
        }
    }
}

/// Mass on top of that of the colliders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
enum AddedMassDoc {
    /// Scales the inertia of the colliders up.
    Mass(Num),
    Properties(MassDoc),
}

/// An axis of the world along, or about, which a body does not move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
enum LockDoc {
    X,
    Y,
    Z,
    RotationX,
    RotationY,
    RotationZ,
}

const LOCKS: [(LockDoc, LockedAxes); 6] = [
    (LockDoc::X, LockedAxes::TRANSLATION_LOCKED_X),
    (LockDoc::Y, LockedAxes::TRANSLATION_LOCKED_Y),
    (LockDoc::Z, LockedAxes::TRANSLATION_LOCKED_Z),
    (LockDoc::RotationX, LockedAxes::ROTATION_LOCKED_X),
    (LockDoc::RotationY, LockedAxes::ROTATION_LOCKED_Y),
    (LockDoc::RotationZ, LockedAxes::ROTATION_LOCKED_Z),
];

impl BodyDoc {
    /// Makes the body, without its colliders.
    pub(super) fn read(&self) -> Result<RigidBody, FileError> {
        let none_negative = |name: &str, value: Option<Num>| match value {
            Some(value) => not_negative(name, value),
            None => Ok(0.0),
        };
        let mut builder = RigidBodyBuilder::new(self.body_type.read())
            .pose(placed(self.at, self.rotation)?)
            .linvel(bounded("velocity", self.velocity)?)
            .angvel(bounded("angular-velocity", self.angular_velocity)?)
            .gravity_scale(self.gravity_scale.map_or(1.0, |scale| scale.0))
            .linear_damping(none_negative("linear-damping", self.linear_damping)?)
            .angular_damping(none_negative("angular-damping", self.angular_damping)?)
            .locked_axes(self.locks())
            .dominance_group(self.dominance.unwrap_or(0))
            .enabled(self.enabled)
            .can_sleep(self.can_sleep)
            .sleeping(self.sleeping)
            .ccd_enabled(self.ccd)
            .soft_ccd_prediction(none_negative(
                "soft-ccd-prediction",
                self.soft_ccd_prediction,
            )?)
            .allow_fast_rotation(self.allow_fast_rotation)
            .gyroscopic_forces_enabled(self.gyroscopic_forces);
        if let Some(iterations) = self.additional_solver_iterations {
            let iterations = count("additional-solver-iterations", iterations, 0)?;
            builder = builder.additional_solver_iterations(iterations);
        }
        builder = match &self.added_mass {
            None => builder,
            Some(AddedMassDoc::Mass(mass)) => {
                builder.additional_mass(not_negative("added-mass.mass", *mass)?)
            }
            Some(AddedMassDoc::Properties(properties)) => {
                let properties = properties.read();
                let inner = |error: FileError| error.within("added-mass.properties");
                builder.additional_mass_properties(properties.map_err(inner)?)
            }
        };
        let mut body = builder.build();
        body.add_force(bounded("force", self.force)?, false);
        body.add_torque(bounded("torque", self.torque)?, false);
        Ok(body)
    }

    fn locks(&self) -> LockedAxes {
        let locked = LOCKS.iter().filter(|(lock, _)| self.locked.contains(lock));
        locked.fold(LockedAxes::empty(), |all, (_, axis)| all | *axis)
    }

    /// The document of a body, without its colliders.
    pub(super) fn write(body: &RigidBody) -> Result<Self, FileError> {
        if body.is_soft_frame() {
            return Err(content("soft bodies cannot stand in a file"));
        }
        let activation = body.activation();
        let can_sleep = sleeps(activation)?;
        let locked = body.locked_axes();
        let locks = LOCKS.iter().filter(|(_, axis)| locked.contains(*axis));
        let additional = body.mass_properties().additional_local_mprops.as_deref();
        let iterations = body.additional_solver_iterations();
        Ok(BodyDoc {
            name: None,
            body_type: TypeDoc::write(body.body_type()),
            at: unless_zero(body.translation()),
            rotation: quad(*body.rotation()),
            velocity: unless_zero(body.linvel()),
            angular_velocity: unless_zero(body.angvel()),
            force: unless_zero(body.user_force()),
            torque: unless_zero(body.user_torque()),
            gravity_scale: unless_num(body.gravity_scale(), 1.0),
            linear_damping: unless_num(body.linear_damping(), 0.0),
            angular_damping: unless_num(body.angular_damping(), 0.0),
            added_mass: additional.map(AddedMassDoc::write),
            locked: locks.map(|(lock, _)| *lock).collect(),
            dominance: unless(body.dominance_group(), 0),
            enabled: body.is_enabled(),
            can_sleep,
            sleeping: body.is_sleeping(),
            ccd: body.is_ccd_enabled(),
            soft_ccd_prediction: unless_num(body.soft_ccd_prediction(), 0.0),
            allow_fast_rotation: body.is_fast_rotation_allowed(),
            gyroscopic_forces: body.gyroscopic_forces_enabled(),
            additional_solver_iterations: unless(iterations, 0),
            sampling: None,
            colliders: Vec::new(),
        })
    }
}

/// Whether a body can sleep; thresholds other than Rapier's defaults are an error.
fn sleeps(activation: &RigidBodyActivation) -> Result<bool, FileError> {
    let thresholds = [
        activation.normalized_linear_threshold,
        activation.angular_threshold,
        activation.time_until_sleep,
    ];
    let after = RigidBodyActivation::default_time_until_sleep();
    let usual = [
        RigidBodyActivation::default_normalized_linear_threshold(),
        RigidBodyActivation::default_angular_threshold(),
        after,
    ];
    if thresholds == usual {
        return Ok(true);
    }
    if thresholds == [-1.0, -1.0, after] {
        return Ok(false);
    }
    Err(content(
        "thresholds of sleep other than the usual ones cannot stand in a file",
    ))
}

impl AddedMassDoc {
    fn write(additional: &RigidBodyAdditionalMassProps) -> Self {
        match additional {
            RigidBodyAdditionalMassProps::Mass(mass) => AddedMassDoc::Mass(Num(*mass)),
            RigidBodyAdditionalMassProps::MassProps(properties) => {
                AddedMassDoc::Properties(MassDoc::write(properties))
            }
        }
    }
}
