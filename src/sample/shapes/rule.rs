//! What is worked out for a shape: samples and their weights.

use super::moments::{Moments, cholesky};
use crate::math::{DMat3, DVec3, SharedShape, Vector, from_dvec3, to_dvec3};

/// Of a tetrahedron: their mean is zero, and the mean of v vᵀ is the identity.
const CORNERS: [DVec3; 4] = [
    DVec3::new(1.0, 1.0, 1.0),
    DVec3::new(1.0, -1.0, -1.0),
    DVec3::new(-1.0, 1.0, -1.0),
    DVec3::new(-1.0, -1.0, 1.0),
];

/// Samples of a shape, in its frame; their fractions sum to one.
#[derive(Debug)]
pub(in crate::sample) struct Rule {
    pub samples: Vec<(Vector, f64)>,
    /// Second moments, about its sample, of what each stands for.
    pub spread: DMat3,
}

impl Rule {
    /// Four points with the same moments up to the second; `None` if the points are flat, or no more than that.
    pub(super) fn few(&self) -> Option<Self> {
        let points = self.samples.iter();
        let points: Vec<_> = points
            .map(|(point, part)| (to_dvec3(*point), *part))
            .collect();
        let moments = Moments::of_points(&points);
        let root = cholesky(moments.second).filter(|_| points.len() > CORNERS.len())?;
        let part = moments.measure / CORNERS.len() as f64;
        let sample = |corner| (from_dvec3(moments.centre + root * corner), part);
        Some(Rule {
            samples: CORNERS.map(sample).to_vec(),
            spread: DMat3::ZERO,
        })
    }

    /// Where a shape gives no better ones.
    pub(super) fn single(local_point: Vector) -> Self {
        Rule {
            samples: vec![(local_point, 1.0)],
            spread: DMat3::ZERO,
        }
    }
}

/// The local bounds of a shape, if they are finite and not empty.
pub(super) fn bounds(shape: &SharedShape) -> Option<(DVec3, DVec3)> {
    let bounds = shape.compute_local_aabb();
    let (low, high) = (to_dvec3(bounds.mins), to_dvec3(bounds.maxs));
    let sound = low.is_finite() && high.is_finite() && (high - low).max_element() > 0.0;
    sound.then_some((low, high))
}
