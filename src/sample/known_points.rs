//! Sample points of parts in the axes of a body, kept for other bodies with equal ones.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::sync::Arc;

use super::cloud::Columns;
use super::shapes::Quadrature;
use crate::field::Fingerprint;
use crate::math::{Pose, Vector, to_f64};

pub(super) type PointsMap = HashMap<PointsKey, KnownPoints, BuildHasherDefault<Fingerprint>>;

/// The data from which the points in the axes of a body follow, bit for bit: equal keys have equal points.
#[derive(Debug, PartialEq, Eq, Hash)]
pub(super) struct PointsKey {
    /// The address of the rule.
    rule: usize,
    /// Translation and rotation of the collider on the body, and the centre of mass.
    numbers: [u64; 10],
}

#[derive(Debug)]
pub(super) struct KnownPoints {
    pub columns: Columns,
    /// Held so that no other rule gets its address.
    #[expect(dead_code, reason = "held for its address")]
    pub rule: Arc<Quadrature>,
}

impl PointsKey {
    pub fn new(rule: &Arc<Quadrature>, local_pose: &Pose, local_com: Vector) -> Self {
        let [a, b, c] = local_pose.translation.to_array();
        let [d, e, f, g] = local_pose.rotation.to_array();
        let [h, i, j] = local_com.to_array();
        PointsKey {
            rule: Arc::as_ptr(rule).addr(),
            numbers: [a, b, c, d, e, f, g, h, i, j].map(|number| to_f64(number).to_bits()),
        }
    }
}
