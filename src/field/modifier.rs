//! What changes the vector of one composite.

use std::sync::Arc;

use super::anchor::Anchor;
use super::axis::Axis;
use super::number::{Vec3, limited};
use super::query::{Asked, LocalQuery};
use super::scalar::Scalar;
use crate::math::{Real, to_f64};

/// A change of the vector where it is defined.
#[derive(Clone, Debug)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) enum Modifier {
    /// Times a number that depends on the sample, seen in the frame of the anchor.
    Scale { scale: Arc<Scalar>, anchor: Anchor },
    /// No longer than this.
    Limit(Real),
}

impl Modifier {
    /// The frame it sees the sample in, if it looks.
    pub(crate) fn anchor(&self) -> Option<Anchor> {
        match self {
            Modifier::Scale { anchor, .. } => Some(*anchor),
            Modifier::Limit(_) => None,
        }
    }

    pub(crate) fn reads_velocity(&self) -> bool {
        match self {
            Modifier::Scale { scale, .. } => scale.axes().any(Axis::reads_velocity),
            Modifier::Limit(_) => false,
        }
    }

    /// Whether it can be asked about several samples at once.
    pub(crate) fn knows_several(&self) -> bool {
        match self {
            Modifier::Scale { scale, .. } => scale.knows_several(),
            Modifier::Limit(_) => true,
        }
    }

    /// Whether two differ in their anchors at most.
    pub(crate) fn is_like(&self, other: &Modifier) -> bool {
        match (self, other) {
            (Modifier::Scale { scale, .. }, Modifier::Scale { scale: known, .. }) => scale == known,
            (Modifier::Limit(length), Modifier::Limit(known)) => length == known,
            _ => false,
        }
    }

    /// The changed vector. `local` is the sample in the frame of the anchor; where that is not (or
    /// no longer) there, a scale leaves the vector as it is.
    #[inline(always)]
    pub(crate) fn apply<T: Asked>(
        &self,
        vector: Vec3<T>,
        local: Option<&LocalQuery<'_, T>>,
    ) -> Vec3<T> {
        match (self, local) {
            (Modifier::Scale { scale, .. }, Some(local)) => vector * scale.at(local),
            (Modifier::Scale { .. }, None) => vector,
            (Modifier::Limit(length), _) => limited(vector, to_f64(*length)),
        }
    }
}
