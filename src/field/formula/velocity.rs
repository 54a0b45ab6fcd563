//! Drag and the magnetic force, which depend on the velocity.

use super::law::Law;
use crate::field::error::{BuildError, all_finite, finite_vector};
use crate::field::query::{LocalQuery, QueryNumber, Single};
use crate::math::{Real, Vector, to_dvec3, to_f64};
use crate::number::{Number, Vec3, constant, length};

/// F = −(c₁ + c₂ |v|) v, with v relative to the field's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Drag {
    /// c₁, force per velocity.
    #[cfg_attr(feature = "serde-serialize", serde(default))]
    pub linear: Real,
    /// c₂, force per velocity squared: ½ ρ C A for a body of drag coefficient C and area A in a
    /// fluid of density ρ.
    #[cfg_attr(feature = "serde-serialize", serde(default))]
    pub quadratic: Real,
}

impl Drag {
    /// The force on a sample that moves with `velocity` through the medium.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(crate) fn force<T: Number>(&self, velocity: Vec3<T>) -> Vec3<T> {
        let (linear, quadratic) = (to_f64(self.linear), to_f64(self.quadratic));
        if quadratic == 0.0 {
            return velocity * T::from(-linear);
        }
        velocity * -(length(velocity) * quadratic + linear)
    }
}

impl Law for Drag {
    fn kind(&self) -> &'static str {
        "drag"
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn vector<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        self.force(local.velocity)
    }

    fn reads_velocity(&self) -> bool {
        true
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        all_finite(
            field,
            &[
                ("the linear drag coefficient", self.linear),
                ("the quadratic drag coefficient", self.quadratic),
            ],
        )
    }
}

/// F = v × B, with v relative to the field's frame. It does no work: its potential is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Magnetic {
    /// B, in the field's frame.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub field: Vector,
}

impl Law for Magnetic {
    fn kind(&self) -> &'static str {
        "magnetic"
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn vector<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        local.velocity.cross(constant(to_dvec3(self.field)))
    }

    fn potential<T: Single>(&self, _: &LocalQuery<'_, T>) -> Option<T> {
        Some(0.0.into())
    }

    fn reads_velocity(&self) -> bool {
        true
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        finite_vector(field, "a component of the vector", self.field)
    }
}
