//! The weight of a displaced fluid.

use std::f64::consts::PI;

use super::{Law, alone};
use crate::field::error::{BuildError, finite, not_negative};
use crate::field::query::{Alone, LocalQuery, Single};
use crate::math::{DVec3, Real, to_f64};
use crate::number::Vec3;

/// The weight of the displaced fluid: F = density · gravity · V(h) ŷ for a fluid that fills the
/// field's frame below y = 0.
///
/// By default parts are cut at the surface (see [`Sampling`](crate::Sampling)): V is the volume below it, and the force
/// acts at the centre of that volume.
///
/// Where they are not cut, a whole part counts as a ball of its volume. Submerged to the depth h = R − y, 0 ≤ h
/// ≤ 2R, a ball of radius R displaces the cap V(h) = π h² (3R − h)/3; so a ball collider is exact. A sample
/// that stands for a piece of a part counts as a layer of the piece's volume and of a thickness t with the
/// piece's second moment along ŷ: V(h) = V h/t for 0 ≤ h = t/2 − y ≤ t; so the pieces of an upright cuboid
/// displace without gaps. Potential density · gravity · ∫V dh. Parts without a volume get no force. Particles
/// of soft bodies count as balls of their [volume](crate::Fields).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Buoyancy {
    /// Mass per volume of the fluid.
    pub density: Real,
    /// Acceleration of gravity, along −y; not negative.
    pub gravity: Real,
}

impl Buoyancy {
    fn weight_per_volume(&self) -> f64 {
        to_f64(self.density) * to_f64(self.gravity)
    }
}

/// The shape as which a sample displaces fluid.
enum Displacing<T> {
    /// A ball: its radius, and the depth of its lowest point.
    Ball(f64, T),
    /// A layer: its thickness, and the depth of its lowest point.
    Layer(f64, T),
}

/// The shape of a sample that is at least partly below the surface; `None` for others, and without a volume.
fn submersion<T: Single>(local: &LocalQuery<'_, T>) -> Option<Displacing<T>> {
    let query = local.query;
    let up = local.rotation * DVec3::Y;
    let variance = up.dot(query.spread * up);
    let (piece, depth) = if variance > 0.0 {
        let thickness = (12.0 * variance).sqrt();
        let depth = -local.point.y + thickness * 0.5;
        (Displacing::Layer(thickness, depth), depth)
    } else {
        let radius = (query.volume * 3.0 / (4.0 * PI)).cbrt();
        let depth = -local.point.y + radius;
        (Displacing::Ball(radius, depth), depth)
    };
    (depth.re() > 0.0 && query.volume > 0.0).then_some(piece)
}

impl Alone for Buoyancy {
    fn vector_alone<T: Single>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let whole = local.query.volume;
        let volume = match submersion(local) {
            None => 0.0.into(),
            Some(Displacing::Ball(r, h)) if h.re() < 2.0 * r => h * h * (-h + 3.0 * r) * (PI / 3.0),
            Some(Displacing::Layer(t, h)) if h.re() < t => h * (whole / t),
            Some(_) => whole.into(),
        };
        Vec3::new(0.0.into(), volume * self.weight_per_volume(), 0.0.into())
    }
}

impl Law for Buoyancy {
    fn kind(&self) -> &'static str {
        "buoyancy"
    }

    alone!();

    fn potential<T: Single>(&self, local: &LocalQuery<'_, T>) -> Option<T> {
        let cap = |r: f64, h: T| h * h * h * (-h * 0.25 + r) * (PI / 3.0);
        let whole = local.query.volume;
        let sum = match submersion(local) {
            None => 0.0.into(),
            Some(Displacing::Ball(r, h)) if h.re() < 2.0 * r => cap(r, h),
            Some(Displacing::Ball(r, h)) => cap(r, T::from(2.0 * r)) + (h - 2.0 * r) * whole,
            Some(Displacing::Layer(t, h)) if h.re() < t => h * h * (whole / (2.0 * t)),
            Some(Displacing::Layer(t, h)) => (h - t * 0.5) * whole,
        };
        Some(sum * self.weight_per_volume())
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        finite(field, "the density", self.density)?;
        // A length of the vector, not its component upwards: the fluid would pull down everything in it.
        not_negative(field, "the gravity", self.gravity)
    }
}
