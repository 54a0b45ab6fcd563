//! Forces that depend on the velocity alone.

use crate::math::DVec3;

/// Linear and quadratic drag.
pub(super) fn drag(velocity: DVec3, linear: f64, quadratic: f64) -> DVec3 {
    velocity * -(linear + quadratic * velocity.length())
}
