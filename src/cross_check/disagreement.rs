//! What one side found and the other did not.

use crate::math::{ColliderHandle, Real, Vector};

/// A contact that one side only found.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Disagreement {
    /// The number of the step, from 1.
    pub step: u64,
    /// Where the side that found it did.
    pub world_point: Vector,
    /// The colliders, in the order of their handles.
    pub colliders: [ColliderHandle; 2],
    /// Overlap as the fields found it, if they did.
    pub field_depth: Option<Real>,
    /// Overlap as Rapier found it, if it did.
    pub rapier_depth: Option<Real>,
    /// The tolerance band there.
    pub band: Real,
}
