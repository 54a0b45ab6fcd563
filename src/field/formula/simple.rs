//! A uniform vector, and a spring.

use super::Law;
use crate::field::error::{BuildError, all_finite, finite_vector};
use crate::field::query::{LocalQuery, QueryNumber, Single};
use crate::math::{Real, Vector, to_dvec3, to_f64};
use crate::number::{Vec3, constant, direction, length};

/// F = the vector. Potential −F·d.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Uniform {
    /// The vector, in the field's frame.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub vector: Vector,
}

impl Law for Uniform {
    fn kind(&self) -> &'static str {
        "uniform"
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn vector<T: QueryNumber>(&self, _: &LocalQuery<'_, T>) -> Vec3<T> {
        constant(to_dvec3(self.vector))
    }

    fn potential<T: Single>(&self, local: &LocalQuery<'_, T>) -> Option<T> {
        Some(-constant::<T>(to_dvec3(self.vector)).dot(local.point))
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        finite_vector(field, "a component of the vector", self.vector)
    }
}

/// F = −k (r − L) d/r − c v, for the distance vector d from the field's origin, |d| = r, and the
/// velocity v relative to the field's frame; for a rest length L of zero, F = −k d − c v.
/// Potential k (r − L)²/2, of the spring alone. At the centre a spring with a rest length gives no
/// force.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Spring {
    /// k, force per length.
    pub stiffness: Real,
    /// c, force per velocity; isotropic.
    #[cfg_attr(feature = "serde-serialize", serde(default))]
    pub damping: Real,
    /// L.
    #[cfg_attr(feature = "serde-serialize", serde(default))]
    pub rest_length: Real,
}

impl Law for Spring {
    fn kind(&self) -> &'static str {
        "spring"
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn vector<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let (k, rest) = (to_f64(self.stiffness), to_f64(self.rest_length));
        let d = local.point;
        let pull = if rest == 0.0 {
            d * T::from(-k)
        } else {
            direction(d) * ((length(d) - rest) * -k)
        };
        pull - local.velocity * T::from(to_f64(self.damping))
    }

    fn potential<T: Single>(&self, local: &LocalQuery<'_, T>) -> Option<T> {
        let stretch = length(local.point) - to_f64(self.rest_length);
        Some(stretch * stretch * (to_f64(self.stiffness) / 2.0))
    }

    fn reads_velocity(&self) -> bool {
        self.damping != 0.0
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        all_finite(
            field,
            &[
                ("the stiffness", self.stiffness),
                ("the damping", self.damping),
                ("the rest length", self.rest_length),
            ],
        )
    }
}
