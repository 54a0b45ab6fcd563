//! Radial forces from the nearest point of a shape in place of a fixed point.

use super::radial::Radial;
use super::{Law, alone};
use crate::field::any_shape::AnyShape;
use crate::field::closure::difference_step;
use crate::field::error::BuildError;
use crate::field::query::{Alone, LocalQuery, QueryNumber, Single};
use crate::math::{DVec3, SharedShape, from_dvec3, to_dvec3, to_f64};
use crate::number::{Vec3, chain, constant, differences, limited};

/// A radial force whose distance vector d is measured from the nearest point of a shape: the pull
/// of a ring, a wall, a planet that is a cube. Inside a solid shape d is zero, and so is the force
/// unless the law is singular there.
///
/// The nearest point is Parry's, to the rounding of [`Real`](crate::math::Real). Where two points
/// are equally near, the force jumps. Its derivatives are central differences.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
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

    /// The distance vector d.
    fn distance<T: Single>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let from = |point: DVec3| {
            let projection = self.shape.0.project_local_point(from_dvec3(point), true);
            point - to_dvec3(projection.point)
        };
        let p = local.local_point();
        if self.shape.0.contains_local_point(from_dvec3(p)) {
            return Vec3::zero();
        }
        let inputs = [local.point.x, local.point.y, local.point.z];
        chain(constant(from(p)), inputs, || {
            let at = [p.x, p.y, p.z];
            let moved = |[x, y, z]: [f64; 3]| from(DVec3::new(x, y, z));
            differences(at, at.map(difference_step), moved).map(constant)
        })
    }

    /// The same formula without a bound.
    pub(crate) fn unbounded(&self) -> Nearest {
        Nearest {
            shape: self.shape.clone(),
            radial: self.radial.unbounded(),
        }
    }
}

impl Alone for Nearest {
    fn vector_alone<T: Single>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let d = self.distance(local);
        d * self.radial.factor(d.dot(d))
    }
}

impl Law for Nearest {
    fn kind(&self) -> &'static str {
        "nearest point"
    }

    alone!();

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn times<T: QueryNumber>(&self, strength: f64, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let vector = self.unbounded().vector(local) * T::from(strength);
        match self.radial.strongest {
            Some(bound) => limited(vector, to_f64(bound)),
            None => vector,
        }
    }

    fn potential<T: Single>(&self, local: &LocalQuery<'_, T>) -> Option<T> {
        let d = self.distance(local);
        self.radial.potential_at(d.dot(d))
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        self.radial.validate(field)
    }
}
