//! Drag at the centre of mass in closed form: the derivative of its force by the velocity, and its mean over a
//! step, which stops a body and does not turn it back.

use crate::math::DVec3;

/// The derivative of a force at the centre of mass by the velocity: −∂F/∂v is `across` times the identity plus
/// `along` times a aᵀ, with the unit vector a = `axis`, in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Slowing {
    pub across: f64,
    pub along: f64,
    pub axis: DVec3,
}

/// φ₁(x) = (eˣ − 1)/x, the mean of e^(s x) over 0 ≤ s ≤ 1.
#[inline]
pub(crate) fn phi1(x: f64) -> f64 {
    // Below this the sixth power is less than a rounding error.
    if x.abs() < 1.0 / 64.0 {
        let series = [5040.0, 720.0, 120.0, 24.0, 6.0, 2.0];
        return series
            .into_iter()
            .fold(0.0, |sum, factorial: f64| sum * x + factorial.recip())
            * x
            + 1.0;
    }
    x.exp_m1() / x
}

impl Slowing {
    /// Returns true if the force does not depend on the velocity.
    #[inline]
    pub(crate) fn is_none(&self) -> bool {
        self.across == 0.0 && self.along == 0.0
    }

    /// The derivative of F = −w (c₁ + c₂ s) u, where u is the velocity past the medium and s its length, from
    /// F, w = `weight`, c₁ = `linear` and c₂ = `quadratic`.
    pub(crate) fn of_drag(force: DVec3, weight: f64, [linear, quadratic]: [f64; 2]) -> Self {
        let across = weight * linear;
        if quadratic == 0.0 || weight == 0.0 {
            return Slowing {
                across,
                ..Slowing::default()
            };
        }
        let length = force.length();
        let size = length / weight.abs();
        let root = (linear * linear + 4.0 * quadratic * size).sqrt();
        let speed = if size > 0.0 {
            2.0 * size / (linear + root)
        } else {
            0.0
        };
        let along = weight * quadratic * speed;
        Slowing {
            across: across + along,
            along,
            axis: if length > 0.0 {
                force / length
            } else {
                DVec3::ZERO
            },
        }
    }

    /// Adds another derivative. If both have an axis, it must be the same.
    pub(crate) fn add(&mut self, other: &Slowing) {
        self.across += other.across;
        if other.along != 0.0 {
            self.along += other.along;
            self.axis = other.axis;
        }
    }

    /// The mean over `duration` of the acceleration of a body that starts at `all`, drag and Rapier's damping
    /// (of rate `damping`) included, and falls with the velocity as they do. Exact where the force is linear in
    /// the velocity.
    pub(crate) fn mean(&self, all: DVec3, inv_mass: f64, damping: f64, duration: f64) -> DVec3 {
        let rate = -(self.across * inv_mass + damping) * duration;
        let across = phi1(rate);
        if self.along == 0.0 {
            return all * across;
        }
        let part = self.axis * self.axis.dot(all);
        let along = phi1(rate - self.along * inv_mass * duration);
        (all - part) * across + part * along
    }
}
