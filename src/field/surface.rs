//! The surface of a solid, as seen from a point.

use super::number::{Plain, Vec3, constant};
use crate::math::DVec3;

/// Signed distance from a surface (negative inside) and its outward direction.
pub(super) struct Surface<P = f64> {
    /// No more than the distance, taken absolute, and zero on the surface only.
    pub distance: P,
    pub outward: Vec3<P>,
    /// How fast `distance` grows along `outward`.
    pub slope: P,
}

impl<P: Plain> Surface<P> {
    /// A surface whose distance is exact near it.
    #[inline(always)]
    pub fn seen(distance: P, outward: Vec3<P>) -> Self {
        Surface {
            distance,
            outward,
            slope: 1.0.into(),
        }
    }
}

impl Surface {
    /// The same, seen from one point.
    pub fn new(distance: f64, outward: DVec3) -> Self {
        Surface::seen(distance, constant(outward))
    }

    /// Seen from one of several points, or from none.
    pub fn lift<P: Plain>(&self) -> Surface<P> {
        Surface {
            distance: self.distance.into(),
            outward: self.outward.map(P::from),
            slope: self.slope.into(),
        }
    }
}
