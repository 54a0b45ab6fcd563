//! Components that colliders and bodies may have: what fields read of them, and how they are sampled.

use bevy::prelude::*;
use rapier3d_fields::{ColliderProperties, Sampling};

/// Limits the [`ForceField`](crate::ForceField) of an entity to the shape of its `Collider`: a zone. The collider is
/// usually a `Sensor`.
///
/// A region of the field itself is intersected with the shape. The shape is the scaled one, and changes of it are
/// followed. A shape without an inside (a triangle, a segment, a polyline) is refused, as by
/// [`Region::shape`](rapier3d_fields::Region::shape).
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Default, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    reflect(Serialize, Deserialize)
)]
pub struct WithinCollider;

/// The properties of an entity's `Collider` that fields read: charge, mass and values along axes of your own.
///
/// ```
/// use bevy_rapier3d_fields::prelude::*;
/// let nitrogen = FieldProperties(ColliderProperties::new().charge(-1.02));
/// ```
#[derive(Component, Clone, Debug, Default, PartialEq, Deref, DerefMut, Reflect)]
#[reflect(opaque, Component, Default, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    reflect(Serialize, Deserialize)
)]
pub struct FieldProperties(pub ColliderProperties);

/// The sampling of an entity's `RigidBody`, for all fields that leave it to [`Sampling::Auto`].
#[derive(Component, Clone, Copy, Debug, PartialEq, Deref, DerefMut, Reflect)]
#[reflect(opaque, Component, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    reflect(Serialize, Deserialize)
)]
pub struct FieldSampling(pub Sampling);
