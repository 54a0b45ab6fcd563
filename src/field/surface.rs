//! The surface of a solid, as seen from a point.

use crate::math::DVec3;

/// Signed distance from a surface (negative inside) and its outward direction.
pub(super) struct Surface {
    /// No more than the distance, taken absolute, and zero on the surface only.
    pub distance: f64,
    pub outward: DVec3,
    /// How fast `distance` grows along `outward`.
    pub slope: f64,
}

impl Surface {
    /// A surface whose distance is exact near it.
    pub fn new(distance: f64, outward: DVec3) -> Self {
        Surface {
            distance,
            outward,
            slope: 1.0,
        }
    }
}
