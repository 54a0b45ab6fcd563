//! Samples of one shape with their weights.

use super::moments::{Moments, cholesky};
use crate::math::{DMat3, DVec3, SharedShape, Vector, from_dvec3, to_dvec3};

/// Corners of a tetrahedron: their mean is zero, and the mean of v vᵀ is the identity.
const CORNERS: [DVec3; 4] = [
    DVec3::new(1.0, 1.0, 1.0),
    DVec3::new(1.0, -1.0, -1.0),
    DVec3::new(-1.0, 1.0, -1.0),
    DVec3::new(-1.0, -1.0, 1.0),
];

/// Samples of a shape, in its frame, each with its fraction. Fractions add up to one.
#[derive(Debug)]
pub(in crate::sample) struct Quadrature {
    pub samples: Vec<(Vector, f64)>,
    /// Second moments of the fraction that a sample stands for, about the sample.
    pub spread: DMat3,
}

impl Quadrature {
    /// Points with their fractions.
    pub(super) fn of(points: impl IntoIterator<Item = (DVec3, f64)>, spread: DMat3) -> Self {
        let points = points.into_iter();
        let samples = points.map(|(point, fraction)| (from_dvec3(point), fraction));
        Quadrature {
            samples: samples.collect(),
            spread,
        }
    }

    /// Four points with the same moments up to the second; `None` if the points are flat, or no more than four.
    pub(super) fn few(&self) -> Option<Self> {
        let points = self.samples.iter();
        let points: Vec<_> = points
            .map(|(point, part)| (to_dvec3(*point), *part))
            .collect();
        let moments = Moments::of_points(&points);
        let root = cholesky(moments.second).filter(|_| points.len() > CORNERS.len())?;
        let part = moments.measure / CORNERS.len() as f64;
        let sample = |corner| (moments.centre + root * corner, part);
        Some(Quadrature::of(CORNERS.map(sample), DMat3::ZERO))
    }

    /// One sample, for a shape that has no others.
    pub(super) fn single(local_point: Vector) -> Self {
        Quadrature {
            samples: vec![(local_point, 1.0)],
            spread: DMat3::ZERO,
        }
    }
}

/// The bounding box of a shape in its frame, if it is finite and not empty.
pub(super) fn bounds(shape: &SharedShape) -> Option<(DVec3, DVec3)> {
    let bounds = shape.compute_local_aabb();
    let (low, high) = (to_dvec3(bounds.mins), to_dvec3(bounds.maxs));
    let sound = low.is_finite() && high.is_finite() && (high - low).max_element() > 0.0;
    sound.then_some((low, high))
}
