//! The surface of a solid as seen from a point.

use super::number::{Plain, Vec3, constant};
use crate::math::DVec3;

/// Signed distance from a surface (negative inside), and the outward direction.
pub(super) struct Surface<P = f64> {
    /// Its size is at most that of the distance, and zero only on the surface.
    pub distance: P,
    pub outward: Vec3<P>,
    /// The derivative of `distance` along `outward`.
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
    /// A surface as seen from one point.
    pub fn new(distance: f64, outward: DVec3) -> Self {
        Surface::seen(distance, constant(outward))
    }

    /// The same for a kind of number that may be for several points.
    pub fn lift<P: Plain>(&self) -> Surface<P> {
        Surface {
            distance: self.distance.into(),
            outward: self.outward.map(P::from),
            slope: self.slope.into(),
        }
    }
}
