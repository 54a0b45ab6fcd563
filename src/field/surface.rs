//! The surface of a solid as seen from a point.

use crate::math::DVec3;
use crate::number::{Plain, Vec3, constant, real};

/// Signed distance from a surface (negative inside), and the outward direction.
pub(super) struct Surface<P = f64> {
    /// In size at most the true distance, and zero only on the surface.
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

    /// The same surface in numbers that may stand for several points.
    pub fn lift<P: Plain>(&self) -> Surface<P> {
        Surface {
            distance: self.distance.into(),
            outward: self.outward.map(P::from),
            slope: self.slope.into(),
        }
    }
}

/// One of the smooth faces of a solid, as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// Distance of the point from the face; negative inside the solid.
    pub distance: f64,
    /// The outward normal, of length one.
    pub outward: DVec3,
    /// Bound of the curvature within a given distance of the point; zero for a plane.
    pub curvature: f64,
    /// For a face that bends inwards by `curvature`: the tangent along which it is straight, or zero if it bends
    /// alike in all directions. `None` if the face may have another form. Meaningless for a plane.
    pub round: Option<DVec3>,
    /// True if the face is a whole sphere.
    pub is_sphere: bool,
}

impl Face {
    /// A plane that is `offset` from the origin along its outward normal.
    pub(super) fn plane(point: DVec3, outward: DVec3, offset: f64) -> Self {
        Face {
            distance: point.dot(outward) - offset,
            outward,
            curvature: 0.0,
            round: None,
            is_sphere: false,
        }
    }

    /// A curved surface.
    pub(super) fn curved(seen: &Surface, curvature: f64, round: Option<DVec3>) -> Self {
        Face {
            distance: seen.distance / seen.slope,
            outward: real(seen.outward).normalize_or_zero(),
            curvature,
            round,
            is_sphere: false,
        }
    }
}
