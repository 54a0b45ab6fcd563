//! A force with its derivatives by position and velocity.

use crate::math::{DMat3, DVec3};
use crate::number::{Dual, Vec3, real};

/// A force and its derivatives at a sample, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearised {
    /// The force.
    pub force: DVec3,
    /// ∂F/∂x: column k is the change of the force with coordinate k of the sample point.
    pub by_position: DMat3,
    /// ∂F/∂v: column k is the change of the force with component k of the velocity.
    pub by_velocity: DMat3,
}

impl Default for Linearised {
    /// All zero. (The default of a matrix is the identity.)
    fn default() -> Self {
        Linearised {
            force: DVec3::ZERO,
            by_position: DMat3::ZERO,
            by_velocity: DMat3::ZERO,
        }
    }
}

impl Linearised {
    /// From a force with derivatives by velocity (K = 3), or by position and then velocity (K = 6).
    pub(crate) fn new<const K: usize>(force: Vec3<Dual<K>>) -> Self {
        let column = |k: usize| real(force.map(|component| component.slopes[k]));
        let matrix = |k: usize| DMat3::from_cols(column(k), column(k + 1), column(k + 2));
        Linearised {
            force: real(force),
            by_position: if K > 3 { matrix(0) } else { DMat3::ZERO },
            by_velocity: matrix(K - 3),
        }
    }

    pub(crate) fn add(&mut self, other: &Linearised) {
        self.force += other.force;
        self.by_position += other.by_position;
        self.by_velocity += other.by_velocity;
    }

    /// Adds the force w s d and its derivative by position w (s + 2 s' d dᵀ), given s and its derivative s' by r².
    pub(crate) fn add_central(&mut self, d: DVec3, factor: Dual<1>, weight: f64) {
        let whole = factor.re * weight;
        let along = d * (2.0 * factor.slopes[0] * weight);
        self.force += d * whole;
        self.by_position += DMat3::from_cols(along * d.x, along * d.y, along * d.z);
        self.by_position += DMat3::from_diagonal(DVec3::splat(whole));
    }
}
