//! Samples as a field sees them.

use fearless_simd::{Simd, SimdBase, SimdFloat};

use super::chunk::{Chunk, Eight, Vectors};
use crate::field::{Axis, Frame};
use crate::math::{DPose3, DQuat, DVec3, Pose, Vector, to_dpose3, to_dvec3, to_f64};
use crate::sample::{Moment, SamplePoint};

/// How far a coordinate may be off, beside the numbers that it is made of.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Points and velocities relative to a frame, in its axes.
pub(super) struct Local<'a, S: Simd> {
    pub chunk: &'a Chunk<'a, S>,
    pub point: Vectors<S>,
    pub velocity: Vectors<S>,
    /// Frame to world.
    rotation: DQuat,
    pub moment: Moment,
    /// How far a coordinate, or one of the velocity, may be off.
    blur: Eight<S>,
    velocity_blur: Eight<S>,
}

impl<'a, S: Simd> Local<'a, S> {
    #[inline(always)]
    pub(super) fn new(chunk: &'a Chunk<'a, S>, frame: &Frame, moment: Moment) -> Self {
        let pose = to_dpose3(&frame.pose);
        let (moving, turning) = (to_dvec3(frame.velocity), to_dvec3(frame.angvel));
        let arm = less(chunk.point, pose.translation);
        let mut velocity = less(chunk.velocity, moving);
        let (reach, mut pace) = (size(arm), size(chunk.velocity) + size_of(moving));
        if frame.angvel != Vector::ZERO {
            let [x, y, z] = cross(turning, arm);
            velocity = [velocity[0] - x, velocity[1] - y, velocity[2] - z];
            pace += reach * size_of(turning);
        }
        let inward = pose.rotation.inverse();
        Local {
            chunk,
            point: rotate(inward, arm),
            velocity: rotate(inward, velocity),
            rotation: pose.rotation,
            moment,
            blur: reach * ROUNDING,
            velocity_blur: pace * ROUNDING,
        }
    }

    /// Vectors of the frame in the world.
    #[inline(always)]
    pub(super) fn to_world(&self, vector: Vectors<S>) -> Vectors<S> {
        rotate(self.rotation, vector)
    }

    /// The points in a frame within this one, and how far they may be off.
    #[inline(always)]
    pub(super) fn points_in(&self, pose: &Pose) -> (Vectors<S>, Eight<S>) {
        let pose = to_dpose3(pose);
        if pose == DPose3::IDENTITY {
            return (self.point, self.blur);
        }
        let arm = less(self.point, pose.translation);
        let blur = self.blur + size_of(pose.translation) * ROUNDING;
        (rotate(pose.rotation.inverse(), arm), blur)
    }

    /// The coordinates along an axis, and how far they may be off; see [`Program::in_lanes`](crate::compile::Program).
    #[inline(always)]
    pub(super) fn coordinate(&self, axis: &Axis) -> (Eight<S>, Eight<S>) {
        let exact = self.chunk.splat(0.0);
        let of_each = |number: fn(&SamplePoint) -> f64| self.chunk.of_each(number);
        match axis {
            Axis::X => (self.point[0], self.blur),
            Axis::Y => (self.point[1], self.blur),
            Axis::Z => (self.point[2], self.blur),
            Axis::Distance => (length(self.point), self.blur),
            Axis::VelocityX => (self.velocity[0], self.velocity_blur),
            Axis::VelocityY => (self.velocity[1], self.velocity_blur),
            Axis::VelocityZ => (self.velocity[2], self.velocity_blur),
            Axis::Speed => (length(self.velocity), self.velocity_blur),
            Axis::Time => (self.chunk.splat(self.moment.time), exact),
            Axis::Radius => (of_each(|sample| to_f64(sample.radius)), exact),
            Axis::Mass => (of_each(|sample| to_f64(sample.mass)), exact),
            Axis::Charge => (of_each(|sample| to_f64(sample.charge)), exact),
            _ => (self.chunk.splat(f64::NAN), exact),
        }
    }
}

/// As [`rotate`](crate::field) of single vectors, step by step.
#[inline(always)]
fn rotate<S: Simd>(rotation: DQuat, v: Vectors<S>) -> Vectors<S> {
    // Exact where nothing is turned.
    if rotation == DQuat::IDENTITY {
        return v;
    }
    let axis = rotation.xyz();
    let across = cross(axis, v).map(|part| part * 2.0);
    let again = cross(axis, across);
    let turned = |k: usize| v[k] + across[k] * rotation.w + again[k];
    [turned(0), turned(1), turned(2)]
}

#[inline(always)]
fn cross<S: Simd>(a: DVec3, [x, y, z]: Vectors<S>) -> Vectors<S> {
    [z * a.y - y * a.z, x * a.z - z * a.x, y * a.x - x * a.y]
}

#[inline(always)]
fn less<S: Simd>([x, y, z]: Vectors<S>, by: DVec3) -> Vectors<S> {
    [x - by.x, y - by.y, z - by.z]
}

fn size_of(vector: DVec3) -> f64 {
    vector.abs().element_sum()
}

/// No less than the length.
#[inline(always)]
fn size<S: Simd>([x, y, z]: Vectors<S>) -> Eight<S> {
    x.abs() + y.abs() + z.abs()
}

#[inline(always)]
pub(super) fn square<S: Simd>([x, y, z]: Vectors<S>) -> Eight<S> {
    x * x + y * y + z * z
}

#[inline(always)]
pub(super) fn length<S: Simd>(vector: Vectors<S>) -> Eight<S> {
    square(vector).sqrt()
}

#[inline(always)]
pub(super) fn times<S: Simd>([x, y, z]: Vectors<S>, factor: Eight<S>) -> Vectors<S> {
    [x * factor, y * factor, z * factor]
}

/// How far what is made of a number may be off.
pub(super) fn blur_of(number: f64) -> f64 {
    number.abs() * ROUNDING
}
