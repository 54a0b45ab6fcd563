//! Drag at the centre of mass in closed form: the derivative of its force with respect to the velocity, and its mean
//! over a step, which stops a body and does not reverse its velocity.

use crate::number::{Mask, Plain, Vec3, length};

/// The derivative of a force at the centre of mass with respect to the velocity: −∂F/∂v is `across` times the identity
/// plus `along` times a aᵀ, with the unit vector a = `axis`, in world axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slowing<T = f64> {
    pub across: T,
    pub along: T,
    pub axis: Vec3<T>,
}

/// Speeds up to this count as zero; the squares of much smaller ones would underflow.
const SLOWEST: f64 = 1e-150;

/// φ₁(x) = (eˣ − 1)/x, the mean of e^(s x) over 0 ≤ s ≤ 1.
#[inline(always)]
pub(crate) fn phi1<T: Plain>(x: T) -> T {
    // Below this the sixth power is less than a rounding error.
    let is_large = !x.abs().below(1.0 / 64.0);
    let mut series = T::from(0.0);
    for factorial in [5040.0, 720.0, 120.0, 24.0, 6.0, 2.0] {
        series = series * x + f64::recip(factorial);
    }
    let small = series * x + 1.0;
    if !is_large.any() {
        return small;
    }
    T::select(is_large, x.map(f64::exp_m1) / x, small)
}

/// The velocity `was + more`, with zero for each component that is nothing but rounding, or slower than
/// [`SLOWEST`]: a body that drag stops must not move backwards.
#[inline(always)]
pub(crate) fn stopped<T: Plain>(was: Vec3<T>, more: Vec3<T>) -> Vec3<T> {
    was.zip(more, |was, more| {
        let sum = was + more;
        let rounding = was.abs() * (16.0 * f64::EPSILON) + SLOWEST;
        T::select(sum.abs().at_most(rounding), 0.0.into(), sum)
    })
}

impl<T: Plain> Slowing<T> {
    /// The derivative of a force that does not depend on the velocity.
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Slowing {
            across: 0.0.into(),
            along: 0.0.into(),
            axis: Vec3::zero(),
        }
    }

    /// True in the lanes in which the force does not depend on the velocity.
    #[inline(always)]
    pub(crate) fn is_none(&self) -> T::Mask {
        self.across.equals(0.0) & self.along.equals(0.0)
    }

    /// The derivative of F = −w (c₁ + c₂ s) u, where u is the velocity relative to the medium and s its length, from
    /// F, w = `weight`, c₁ = `linear` and c₂ = `quadratic`.
    #[inline(always)]
    pub(crate) fn of_drag(force: Vec3<T>, weight: T, [linear, quadratic]: [f64; 2]) -> Self {
        let none = Self::none();
        let across = weight * linear;
        if quadratic == 0.0 {
            return Slowing { across, ..none };
        }
        let length = length(force);
        let size = length / weight.abs();
        let root = (size * (4.0 * quadratic) + linear * linear).sqrt();
        let moves = size.above(0.0) & !weight.equals(0.0);
        let speed = T::select(moves, size * 2.0 / (root + linear), 0.0.into());
        let along = weight * quadratic * speed;
        Slowing {
            across: across + along,
            along,
            axis: Vec3::select(length.above(0.0), force / length, none.axis),
        }
    }

    /// Adds another derivative. If both have an axis, it must be the same.
    #[inline(always)]
    pub(crate) fn add(&mut self, other: &Self) {
        self.across = self.across + other.across;
        self.along = self.along + other.along;
        self.axis = Vec3::select(other.along.equals(0.0), self.axis, other.axis);
    }

    /// The mean acceleration of a body over `duration`, given the whole acceleration `all` at the start, drag and
    /// Rapier's damping (of rate `damping`) included. Exact where the force is linear in the velocity.
    #[inline(always)]
    pub(crate) fn mean(&self, all: Vec3<T>, inv_mass: T, damping: T, duration: f64) -> Vec3<T> {
        let rate = -(self.across * inv_mass + damping) * duration;
        let share = phi1(rate);
        let even = all * share;
        let has_axis = !self.along.equals(0.0);
        if !has_axis.any() {
            return even;
        }
        let part = self.axis * self.axis.dot(all);
        let along = phi1(rate - self.along * inv_mass * duration);
        let across = (all - part) * share;
        Vec3::select(has_axis, across + part * along, even)
    }
}
