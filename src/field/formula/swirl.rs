//! Flows and forces around, towards and along an axis.

use super::Law;
use crate::field::error::{BuildError, all_finite, not_negative};
use crate::field::query::{LocalQuery, QueryNumber, Single};
use crate::math::{Real, to_f64};
use crate::number::{Plain, Vec3};

/// Around the y axis of the field's frame: with ρ the distance vector from the axis,
/// s² = |ρ|² + core², F = sⁿ (around · ŷ×ρ/s − inward · ρ/s) + along · ŷ.
///
/// n = 1 turns like a rigid body, n = −1 like a free vortex, smoothed within the core (a Rankine
/// vortex with a soft edge; the profile of Vatistas for his n = 1, Exp. Fluids 11, 1991). Singular on
/// the axis for n < 0 without a core; otherwise the force on the axis is along it. It has a potential
/// only if it is along the axis everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Swirl {
    /// Strength around the axis, right-handed about +y.
    #[cfg_attr(feature = "serde-serialize", serde(default))]
    pub around: Real,
    /// Strength towards the axis.
    #[cfg_attr(feature = "serde-serialize", serde(default))]
    pub inward: Real,
    /// Strength along the axis.
    #[cfg_attr(feature = "serde-serialize", serde(default))]
    pub along: Real,
    /// n.
    pub power: Real,
    /// Radius within which it is smoothed.
    #[cfg_attr(feature = "serde-serialize", serde(default))]
    pub core: Real,
}

impl Law for Swirl {
    fn kind(&self) -> &'static str {
        "swirl"
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn vector<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let (x, z) = (local.point.x, local.point.z);
        let core = to_f64(self.core);
        let s2 = x * x + z * z + core * core;
        let power = to_f64(self.power);
        let along = T::from(to_f64(self.along));
        if self.around == 0.0 && self.inward == 0.0 {
            return Vec3::new(0.0.into(), along, 0.0.into());
        }
        let mut scale = s2.powf((power - 1.0) / 2.0);
        if power >= 0.0 {
            scale = T::select(s2.re().equals(0.0), 0.0.into(), scale);
        }
        let (around, inward) = (scale * to_f64(self.around), scale * to_f64(self.inward));
        Vec3::new(z * around - x * inward, along, -x * around - z * inward)
    }

    fn potential<T: Single>(&self, local: &LocalQuery<'_, T>) -> Option<T> {
        let lift = local.point.y * -to_f64(self.along);
        (self.around == 0.0 && self.inward == 0.0).then_some(lift)
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        not_negative(field, "the core", self.core)?;
        all_finite(
            field,
            &[
                ("the strength around the axis", self.around),
                ("the strength towards the axis", self.inward),
                ("the strength along the axis", self.along),
                ("the power", self.power),
            ],
        )
    }
}
