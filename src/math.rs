//! The types of numbers, vectors, poses, shapes and handles, all of them Rapier's own.
//!
//! A second `glam` in the dependency graph would give types that do not fit. [`Real`] is `f32` in `rapier3d-fields` and
//! `f64` in `rapier3d-fields-f64`. The reference evaluator computes in `f64` in both, with [`DVec3`] and [`DPose3`].

pub use rapier::dynamics::{RigidBodyHandle, RigidBodySet};
pub use rapier::geometry::{ColliderHandle, ColliderSet, InteractionGroups, SharedShape};
pub(crate) use rapier::glamx::DVec2;
pub use rapier::glamx::{DMat3, DPose3, DQuat, DVec3};
pub use rapier::math::{AngularInertia, Pose, Real, Rotation, Vector};

/// `v` in 64-bit precision; exact.
#[cfg(feature = "f32")]
pub fn to_dvec3(v: Vector) -> DVec3 {
    v.as_dvec3()
}

/// `v` in 64-bit precision; exact.
#[cfg(feature = "f64")]
pub fn to_dvec3(v: Vector) -> DVec3 {
    v
}

/// `v` rounded to [`Real`].
#[cfg(feature = "f32")]
pub fn from_dvec3(v: DVec3) -> Vector {
    v.as_vec3()
}

/// `v` rounded to [`Real`].
#[cfg(feature = "f64")]
pub fn from_dvec3(v: DVec3) -> Vector {
    v
}

/// `rotation` in 64-bit precision, normalised again, since Rapier's has unit length only to the rounding of [`Real`].
pub(crate) fn to_dquat(rotation: Rotation) -> DQuat {
    let [x, y, z, w] = rotation.to_array().map(to_f64);
    DQuat::from_xyzw(x, y, z, w).normalize()
}

/// `pose` in 64-bit precision, its rotation renormalised.
pub fn to_dpose3(pose: &Pose) -> DPose3 {
    DPose3::from_parts(to_dvec3(pose.translation), to_dquat(pose.rotation))
}

/// `pose` rounded to [`Real`], its rotation renormalised.
pub(crate) fn from_dpose3(pose: &DPose3) -> Pose {
    let [x, y, z, w] = pose.rotation.to_array().map(from_f64);
    let rotation = Rotation::from_xyzw(x, y, z, w).normalize();
    Pose::from_parts(from_dvec3(pose.translation), rotation)
}

/// The pose of `two` relative to `one`. It is computed in 64 bits, so that a large distance from the origin costs no
/// precision, and then rounded.
pub(crate) fn relative_pose(one: &DPose3, two: &DPose3) -> Pose {
    let to_first = one.rotation.inverse();
    let place = to_first * (two.translation - one.translation);
    from_dpose3(&DPose3::from_parts(place, to_first * two.rotation))
}

/// `x` in 64-bit precision; exact.
#[allow(
    clippy::unnecessary_cast,
    reason = "Real is f64 in one of the two builds"
)]
pub fn to_f64(x: Real) -> f64 {
    x as f64
}

/// `x` rounded to [`Real`].
#[allow(
    clippy::unnecessary_cast,
    reason = "Real is f64 in one of the two builds"
)]
pub fn from_f64(x: f64) -> Real {
    x as Real
}

/// The border between the numbers that are low and those that are not, by `rounds` halvings of an interval whose first
/// end is low and whose other end is not. The result is low.
pub(crate) fn bisect(
    [mut low, mut high]: [f64; 2],
    rounds: u32,
    is_low: impl Fn(f64) -> bool,
) -> f64 {
    for _ in 0..rounds {
        let middle = 0.5 * (low + high);
        let half = if is_low(middle) { &mut low } else { &mut high };
        *half = middle;
    }
    low
}
