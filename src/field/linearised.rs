//! A force with its derivatives by place and velocity.

use super::number::{Dual, Vec3, real};
use crate::math::{DMat3, DVec3};

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
    /// From a force that carries its derivatives.
    pub(crate) fn new(force: Vec3<Dual<6>>) -> Self {
        let column = |k: usize| {
            let Vec3 { x, y, z } = force;
            DVec3::new(x.slopes[k], y.slopes[k], z.slopes[k])
        };
        Linearised {
            force: real(force),
            by_position: DMat3::from_cols(column(0), column(1), column(2)),
            by_velocity: DMat3::from_cols(column(3), column(4), column(5)),
        }
    }
}
