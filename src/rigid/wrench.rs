//! A force together with its torque.

use crate::math::{Real, Vector};

/// A force and the torque about the centre of mass that comes with it, in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct Wrench {
    /// Force (N).
    pub force: Vector,
    /// Torque about the centre of mass (N·m).
    pub torque: Vector,
}

impl Wrench {
    /// No force and no torque.
    pub const ZERO: Wrench = Wrench {
        force: Vector::ZERO,
        torque: Vector::ZERO,
    };

    pub(crate) fn plus(self, other: Wrench) -> Self {
        Wrench {
            force: self.force + other.force,
            torque: self.torque + other.torque,
        }
    }

    pub(crate) fn times(self, factor: Real) -> Self {
        Wrench {
            force: self.force * factor,
            torque: self.torque * factor,
        }
    }

    /// Returns true if all components are finite.
    pub fn is_finite(&self) -> bool {
        self.force.is_finite() && self.torque.is_finite()
    }
}
