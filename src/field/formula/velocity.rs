//! Forces that depend on the velocity.

use super::{Formula, Law};
use crate::field::axis::Axis;
use crate::field::error::{BuildError, all_finite, bad, finite_vector};
use crate::field::number::{Number, Vec3, constant, length};
use crate::field::query::LocalQuery;
use crate::math::{Real, Vector, to_dvec3, to_f64};

/// F = −(c₁ + c₂ |v|) v, with v relative to the field's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
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
    /// The force on what moves with `velocity` through the medium.
    fn force<T: Number>(&self, velocity: &Vec3<T>) -> Vec3<T> {
        let rate = length(velocity) * to_f64(self.quadratic) + to_f64(self.linear);
        velocity * -rate
    }
}

impl Law for Drag {
    fn kind(&self) -> &'static str {
        "drag"
    }

    fn vector<T: Number>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        self.force(&local.velocity)
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

/// Drag relative to a flow: F = (c₁ + c₂ |w|) w for the velocity w = u − v of the flow u past the
/// sample. Where |w| is above the cap, w is shortened to it, so that the force has a bound.
///
/// The flow is another formula's vector, read as a velocity in the field's frame.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub struct Wind {
    /// u.
    #[cfg_attr(feature = "serde-serialize", serde(with = "crate::field::saved::flow"))]
    pub flow: Box<Formula>,
    /// c₁ and c₂.
    pub drag: Drag,
    /// The largest |w| that counts; may be infinite.
    #[cfg_attr(
        feature = "serde-serialize",
        serde(with = "crate::field::saved::upper")
    )]
    pub speed_cap: Real,
}

impl Law for Wind {
    fn kind(&self) -> &'static str {
        "wind"
    }

    fn vector<T: Number>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let past = local.velocity - self.flow.vector(local);
        let speed = length(&past);
        let cap = to_f64(self.speed_cap);
        if speed.re() <= cap {
            return self.drag.force(&past);
        }
        self.drag.force(&(past * (speed.recip() * cap)))
    }

    fn reads_velocity(&self) -> bool {
        true
    }

    fn axes(&self) -> &[Axis] {
        self.flow.axes()
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        if self.speed_cap.is_nan() || self.speed_cap < 0.0 {
            let value = to_f64(self.speed_cap);
            return Err(bad(field, "the speed cap", "zero or more", value));
        }
        self.flow.validate(field)?;
        self.drag.validate(field)
    }
}

/// F = v × B, with v relative to the field's frame. It does no work: its potential is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
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

    fn vector<T: Number>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        local.velocity.cross(&constant(to_dvec3(self.field)))
    }

    fn potential<T: Number>(&self, _: &LocalQuery<'_, T>) -> Option<T> {
        Some(0.0.into())
    }

    fn reads_velocity(&self) -> bool {
        true
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        finite_vector(field, "a component of the vector", self.field)
    }
}
