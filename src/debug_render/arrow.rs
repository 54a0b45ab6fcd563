//! Arrows, and the compression of their lengths.

use super::pen::Pen;
use crate::math::{Real, Vector, from_f64, to_dvec3, to_f64};
use crate::rapier::pipeline::{DebugColor, DebugRenderBackend};

/// The length and half the width of an arrow's point, as shares of the length of the arrow.
const POINT: [Real; 2] = [0.3, 0.12];

/// An arrow in world space.
pub(super) struct Arrow {
    pub start: Vector,
    /// From its start to its tip.
    pub way: Vector,
    /// A direction across the plane in which its point lies.
    pub across: Vector,
    pub color: DebugColor,
    /// The colours of the two strokes of its point.
    pub point_colors: [DebugColor; 2],
}

impl Arrow {
    /// An arrow of one colour.
    pub fn new(start: Vector, way: Vector, across: Vector, color: DebugColor) -> Self {
        Arrow {
            start,
            way,
            across,
            color,
            point_colors: [color; 2],
        }
    }

    pub fn draw<B: DebugRenderBackend>(&self, pen: &mut Pen<'_, B>) {
        let tip = self.start + self.way;
        let beside = self.way.cross(self.across).try_normalize();
        let beside = beside.unwrap_or_else(|| self.way.any_orthogonal_vector().normalize_or_zero());
        let [length, width] = POINT;
        let back = tip - self.way * length;
        let aside = beside * (self.way.length() * width);
        pen.line(self.start, tip, self.color);
        pen.line(tip, back + aside, self.point_colors[0]);
        pen.line(tip, back - aside, self.point_colors[1]);
    }
}

/// A vector as a direction and a magnitude, which may exceed the range of Rapier's scalar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Polar {
    pub direction: Vector,
    pub magnitude: f64,
}

impl Polar {
    /// `None` for a vector that is zero, infinite or NaN.
    pub fn of(vector: Vector) -> Option<Self> {
        let largest = vector.abs().max_element();
        if !vector.is_finite() || largest == 0.0 {
            return None;
        }
        // Divided first, so that no square underflows or overflows.
        Some(Polar {
            direction: (vector / largest).normalize(),
            magnitude: to_dvec3(vector / largest).length() * to_f64(largest),
        })
    }
}

/// Turns magnitudes into shares of the length of the longest arrow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gauge {
    /// The magnitude whose share is one half.
    half: f64,
}

impl Gauge {
    /// A gauge in which the magnitude `half` has the share of one half; `None` for the median of `magnitudes`.
    pub fn new(half: Option<Real>, magnitudes: impl Iterator<Item = f64>) -> Self {
        let half = half.map(to_f64).unwrap_or_else(|| {
            let mut all: Vec<f64> = magnitudes.collect();
            all.sort_unstable_by(f64::total_cmp);
            all.get(all.len() / 2).copied().unwrap_or(1.0)
        });
        Gauge { half }
    }

    /// The share of a magnitude, from 0 to 1.
    pub fn share(&self, magnitude: f64) -> Real {
        from_f64(1.0 / (1.0 + self.half / magnitude))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_rise_from_zero_to_one() {
        let gauge = Gauge::new(None, [9.0, 1.0, 4.0].into_iter());
        assert_eq!(gauge.share(4.0), 0.5);
        assert!(gauge.share(1e-300) < 1e-30);
        assert_eq!(gauge.share(f64::INFINITY), 1.0);
    }

    #[test]
    fn vectors_at_the_ends_of_the_range_have_a_direction() {
        for size in [Real::MAX, 1.0, Real::MIN_POSITIVE] {
            let polar = Polar::of(Vector::new(0.0, -size, 0.0)).expect("a direction");
            assert_eq!(polar.direction, -Vector::Y);
            assert_eq!(polar.magnitude, to_f64(size));
        }
        assert_eq!(Polar::of(Vector::ZERO), None);
        assert_eq!(Polar::of(Vector::X * Real::NAN), None);
    }
}
