//! Scales and limits of the vector of a composite.

use std::sync::Arc;

use super::anchor::Anchor;
use super::axis::Axis;
use super::query::{LocalQuery, QueryNumber};
use super::scalar::Scalar;
use crate::math::{Real, to_f64};
use crate::number::{Vec3, limited};

/// A change of a composite's vector, where the composite is defined.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) enum Modifier {
    /// Multiplies by a number that depends on the sample in the frame of the anchor.
    Scale { scale: Arc<Scalar>, anchor: Anchor },
    /// Shortens the vector to this length if it is longer.
    Limit(Real),
}

impl Modifier {
    /// The anchor in whose frame it reads the sample, if it reads it.
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

    /// Returns true if it can be evaluated at several samples at once.
    pub(crate) fn knows_several(&self) -> bool {
        match self {
            Modifier::Scale { scale, .. } => scale.knows_several(),
            Modifier::Limit(_) => true,
        }
    }

    /// Returns true if two differ in their anchors at most.
    pub(crate) fn is_like(&self, other: &Modifier) -> bool {
        match (self, other) {
            (Modifier::Scale { scale, .. }, Modifier::Scale { scale: known, .. }) => scale == known,
            (Modifier::Limit(length), Modifier::Limit(known)) => length == known,
            _ => false,
        }
    }

    /// The changed vector. `local` is the sample in the frame of the anchor. If the carrier of the anchor does
    /// not exist (any more), a scale leaves the vector as it is.
    #[inline(always)]
    pub(crate) fn apply<T: QueryNumber>(
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
