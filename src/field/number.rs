//! Numbers that carry derivatives along.
//!
//! Formulas, scalars and the walks over trees are written once, over any [`Number`]. With `f64`
//! they give the force; with [`Dual`], the force and its exact derivative (forward mode) by the
//! point and the velocity of the sample.

use num_dual::{DualNum, DualSVec64};

use crate::math::{DQuat, DVec3};

/// A real number, or one with derivatives.
pub(crate) trait Number: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Number for T {}

/// A number with its derivatives by the world point (first three) and the world velocity (last
/// three) of the sample.
pub(crate) type Dual = DualSVec64<6>;

pub(crate) type Vec3<T> = nalgebra::Vector3<T>;

/// A vector that depends on nothing.
pub(crate) fn constant<T: Number>(v: DVec3) -> Vec3<T> {
    Vec3::new(v.x.into(), v.y.into(), v.z.into())
}

/// The vector without its derivatives.
pub(crate) fn real<T: Number>(v: &Vec3<T>) -> DVec3 {
    DVec3::new(v.x.re(), v.y.re(), v.z.re())
}

/// |v|; its slope at zero, where there is none, is taken as zero.
pub(crate) fn length<T: Number>(v: &Vec3<T>) -> T {
    root(v.dot(v))
}

/// √x; its slope at zero, where there is none, is taken as zero.
pub(crate) fn root<T: Number>(x: T) -> T {
    if x.re() == 0.0 { 0.0.into() } else { x.sqrt() }
}

/// v/|v|, or zero.
pub(crate) fn direction<T: Number>(v: &Vec3<T>) -> Vec3<T> {
    let length = length(v);
    if length.re() == 0.0 {
        return constant(DVec3::ZERO);
    }
    v / length
}

/// `v` turned by `rotation`.
pub(crate) fn rotate<T: Number>(rotation: DQuat, v: &Vec3<T>) -> Vec3<T> {
    // An unrotated frame must not cost the last bit: boundaries are compared exactly.
    if rotation == DQuat::IDENTITY {
        return *v;
    }
    let axis = constant::<T>(rotation.xyz());
    let across = axis.cross(v) * T::from(2.0);
    v + across * T::from(rotation.w) + axis.cross(&across)
}

/// A function known only by its value and, on demand, its slope along each input: its value as a
/// number that follows the inputs to first order.
pub(crate) fn chain<T: Number, const N: usize>(
    value: DVec3,
    inputs: [T; N],
    slopes: impl FnOnce() -> [DVec3; N],
) -> Vec3<T> {
    let mut result = constant(value);
    if T::NDERIV > 0 {
        for (input, slope) in inputs.into_iter().zip(slopes()) {
            // Zero, but for the derivative.
            let moved = input - T::from(input.re());
            result += constant::<T>(slope) * moved;
        }
    }
    result
}

/// Slopes by central differences, with a step for each input.
pub(crate) fn differences<const N: usize>(
    at: [f64; N],
    steps: [f64; N],
    function: impl Fn([f64; N]) -> DVec3,
) -> [DVec3; N] {
    std::array::from_fn(|k| {
        let moved = |by: f64| {
            let mut inputs = at;
            inputs[k] += by;
            function(inputs)
        };
        (moved(steps[k]) - moved(-steps[k])) / (2.0 * steps[k])
    })
}

/// The vector, no longer than `limit`.
pub(crate) fn limited<T: Number>(vector: Vec3<T>, limit: f64) -> Vec3<T> {
    if limit == 0.0 {
        // Its slope is zero, too, however small the vector.
        return constant(DVec3::ZERO);
    }
    let size = length(&vector);
    if size.re() > limit {
        vector * (size.recip() * limit)
    } else {
        vector
    }
}
