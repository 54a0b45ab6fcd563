//! Buoyancy.

use std::f64::consts::PI;

use super::Law;
use crate::field::error::{TreeError, all_finite};
use crate::field::number::{Number, Vec3};
use crate::field::query::LocalQuery;
use crate::math::{Real, to_f64};

/// The weight of the displaced fluid: F = density · gravity · V(h) ŷ for a fluid that fills the
/// field's frame below y = 0.
///
/// A probe counts as a ball of its volume. Submerged to the depth h = R − y, 0 ≤ h ≤ 2R, a ball
/// of radius R displaces the cap V(h) = π h² (3R − h)/3; so a ball collider is exact, and other
/// shapes are as good as their volume is sampled. Potential density · gravity · ∫V dh. Parts
/// without a volume feel nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Buoyancy {
    /// Mass per volume of the fluid.
    pub density: Real,
    /// Acceleration of gravity, along −y.
    pub gravity: Real,
}

impl Buoyancy {
    fn weight_per_volume(&self) -> f64 {
        to_f64(self.density) * to_f64(self.gravity)
    }
}

/// The radius of a probe's ball, and how deep its lowest point lies; nothing in the air.
fn submersion<T: Number>(local: &LocalQuery<'_, T>) -> Option<(f64, T)> {
    let radius = (local.query.volume * 3.0 / (4.0 * PI)).cbrt();
    let depth = -local.point.y + radius;
    (depth.re() > 0.0 && radius > 0.0).then_some((radius, depth))
}

impl Law for Buoyancy {
    fn kind(&self) -> &'static str {
        "buoyancy"
    }

    fn vector<T: Number>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let volume = match submersion(local) {
            None => 0.0.into(),
            Some((r, h)) if h.re() < 2.0 * r => h * h * (-h + 3.0 * r) * (PI / 3.0),
            Some(_) => local.query.volume.into(),
        };
        Vec3::new(0.0.into(), volume * self.weight_per_volume(), 0.0.into())
    }

    fn potential<T: Number>(&self, local: &LocalQuery<'_, T>) -> Option<T> {
        let cap = |r: f64, h: T| h * h * h * (-h * 0.25 + r) * (PI / 3.0);
        let sum = match submersion(local) {
            None => 0.0.into(),
            Some((r, h)) if h.re() < 2.0 * r => cap(r, h),
            Some((r, h)) => cap(r, T::from(2.0 * r)) + (h - 2.0 * r) * local.query.volume,
        };
        Some(sum * self.weight_per_volume())
    }

    fn validate(&self, field: &str) -> Result<(), TreeError> {
        all_finite(
            field,
            &[("the density", self.density), ("the gravity", self.gravity)],
        )
    }
}
