//! Radial forces from a shape rather than a point.

use super::Law;
use super::radial::Radial;
use crate::field::any_shape::AnyShape;
use crate::field::closure::difference_step;
use crate::field::error::BuildError;
use crate::field::number::{Number, Vec3, chain, differences};
use crate::field::query::LocalQuery;
use crate::math::{DVec3, SharedShape, from_dvec3, to_dvec3};

/// A radial force whose distance vector d is measured from the nearest point of a shape: the pull
/// of a ring, a wall, a planet that is a cube. Inside a solid shape d is zero, and so is the force
/// of all that is not singular there.
///
/// The nearest point is Parry's, to the rounding of [`Real`](crate::math::Real). Where two points
/// are equally near, the force jumps. Its derivatives are central differences.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub struct Nearest {
    pub(crate) shape: AnyShape,
    /// The force as a function of d.
    pub radial: Radial,
}

impl Nearest {
    /// The shape.
    pub fn shape(&self) -> &SharedShape {
        &self.shape.0
    }

    /// d.
    fn distance<T: Number>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let from = |point: DVec3| {
            let projection = self.shape.0.project_local_point(from_dvec3(point), true);
            point - to_dvec3(projection.point)
        };
        let p = local.local_point();
        if self.shape.0.contains_local_point(from_dvec3(p)) {
            return Vec3::from_element(0.0.into());
        }
        let inputs = [local.point.x, local.point.y, local.point.z];
        chain(from(p), inputs, || {
            let at = [p.x, p.y, p.z];
            differences(at, at.map(difference_step), |[x, y, z]| {
                from(DVec3::new(x, y, z))
            })
        })
    }
}

impl Law for Nearest {
    fn kind(&self) -> &'static str {
        "nearest point"
    }

    fn vector<T: Number>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let d = self.distance(local);
        d * self.radial.factor(d.dot(&d))
    }

    fn potential<T: Number>(&self, local: &LocalQuery<'_, T>) -> Option<T> {
        let d = self.distance(local);
        self.radial.potential_at(d.dot(&d))
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        self.radial.validate(field)
    }
}
