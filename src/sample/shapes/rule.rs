//! What is worked out for a shape: samples and their weights.

use crate::math::{DMat3, DVec3, SharedShape, Vector, to_dvec3};

/// Samples of a shape, in its frame; their fractions sum to one.
#[derive(Debug)]
pub(in crate::sample) struct Rule {
    pub samples: Vec<(Vector, f64)>,
    /// Second moments, about its sample, of what each stands for.
    pub spread: DMat3,
}

impl Rule {
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
