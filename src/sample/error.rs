//! What can be wrong with what users say about colliders and bodies.

use crate::math::{ColliderHandle, Real, RigidBodyHandle};

/// Why a property of a collider, a body or an axis was refused. Nothing has changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PropertyError {
    /// A collider was named that is not in the world.
    #[error("there is no collider {collider:?}")]
    NoSuchCollider {
        /// The collider.
        collider: ColliderHandle,
    },
    /// A body was named that is not in the world.
    #[error("there is no body {body:?}")]
    NoSuchBody {
        /// The body.
        body: RigidBodyHandle,
    },
    /// A tolerance is zero, negative, infinite or NaN.
    #[error("the tolerance of {body:?} must be more than zero, and finite, but is {tolerance}")]
    Tolerance {
        /// The body.
        body: RigidBodyHandle,
        /// The value found.
        tolerance: Real,
    },
    /// A property of a collider is out of its range.
    #[error("{quantity} of collider {collider:?} must be {requirement}, but is {value}")]
    Property {
        /// The collider.
        collider: ColliderHandle,
        /// The property.
        quantity: &'static str,
        /// Its range.
        requirement: &'static str,
        /// The value found.
        value: Real,
    },
    /// An axis was set that was never declared.
    #[error("there is no axis `{axis}`; declare it when building the fields")]
    UnknownAxis {
        /// The axis.
        axis: String,
    },
    /// An axis was set to infinity or NaN.
    #[error("the value of axis `{axis}` must be finite, but is {value}")]
    AxisValue {
        /// The axis.
        axis: String,
        /// The value.
        value: Real,
    },
}
