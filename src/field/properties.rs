//! Properties of axes, colliders and bodies that users set, as data.

use std::sync::Arc;

use super::axis::Axis;
use super::error::{BuildError, finite};
use super::sampling::Sampling;
use crate::math::{ColliderHandle, Real, RigidBodyHandle, to_f64};

/// The reason why a property of a collider, a body or an axis was refused. Nothing has changed.
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
    /// An axis was set that is not declared.
    #[error("there is no axis `{axis}`; declare it first")]
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

/// Properties of a collider that fields may read, besides its shape and place.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let nitrogen = ColliderProperties::new().charge(-1.02).mass(14.0067).axis("dispersion", 1.0);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[non_exhaustive]
pub struct ColliderProperties {
    /// Electric charge, for [`Axis::Charge`]. Zero by default.
    pub charge: Real,
    /// Mass of this part of the body, in place of the collider's own, which is zero for a density of zero. Only
    /// the ratios between the parts of a body matter.
    pub mass: Option<Real>,
    /// Values along some of the user's axes; on others the value of the world applies.
    pub axes: Vec<(Arc<str>, Real)>,
}

impl ColliderProperties {
    /// No charge, the collider's own mass, and the world's values on the user's axes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the charge.
    pub fn charge(mut self, charge: Real) -> Self {
        self.charge = charge;
        self
    }

    /// Sets the mass of this part of the body.
    pub fn mass(mut self, mass: Real) -> Self {
        self.mass = Some(mass);
        self
    }

    /// Sets the value along one of the user's axes.
    pub fn axis(mut self, name: &str, value: Real) -> Self {
        self.axes.push((name.into(), value));
        self
    }

    fn validate(&self, collider: ColliderHandle) -> Result<(), PropertyError> {
        let bad = |quantity, requirement, value| PropertyError::Property {
            collider,
            quantity,
            requirement,
            value,
        };
        if !self.charge.is_finite() {
            return Err(bad("the charge", "finite", self.charge));
        }
        match self.mass {
            Some(mass) if !(mass >= 0.0 && mass.is_finite()) => {
                Err(bad("the mass", "zero or more, and finite", mass))
            }
            _ => Ok(()),
        }
    }
}

/// The user's axes with the world's values, the properties of colliders, and the samplings of bodies.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct UserProperties {
    axes: Vec<(Arc<str>, f64)>,
    /// In the order of handles.
    colliders: Vec<(ColliderHandle, ColliderProperties)>,
    /// In the order of handles; never [`Sampling::Auto`].
    samplings: Vec<(RigidBodyHandle, Sampling)>,
}

impl UserProperties {
    pub(super) fn declare(&mut self, name: &str, value: Real) -> Result<(), BuildError> {
        if self.value(name).is_some() || !matches!(Axis::named(name), Axis::User(_)) {
            let axis = name.to_owned();
            return Err(BuildError::DuplicateAxis { axis });
        }
        finite(&format!("axis `{name}`"), "its value", value)?;
        self.axes.push((name.into(), to_f64(value)));
        Ok(())
    }

    /// The user's axes, with the world's values.
    pub(crate) fn axes(&self) -> &[(Arc<str>, f64)] {
        &self.axes
    }

    fn value(&self, name: &str) -> Option<f64> {
        let mut axes = self.axes.iter();
        axes.find(|(known, _)| **known == *name).map(|axis| axis.1)
    }

    pub(super) fn set_axis(&mut self, name: &str, value: Real) -> Result<(), PropertyError> {
        self.check_axis(name, value)?;
        for (known, current) in &mut self.axes {
            if **known == *name {
                *current = to_f64(value);
            }
        }
        Ok(())
    }

    fn check_axis(&self, name: &str, value: Real) -> Result<(), PropertyError> {
        let axis = name.to_owned();
        if self.value(name).is_none() {
            return Err(PropertyError::UnknownAxis { axis });
        }
        if !value.is_finite() {
            return Err(PropertyError::AxisValue { axis, value });
        }
        Ok(())
    }

    pub(super) fn set(
        &mut self,
        collider: ColliderHandle,
        properties: ColliderProperties,
    ) -> Result<(), PropertyError> {
        properties.validate(collider)?;
        for (name, value) in &properties.axes {
            self.check_axis(name, *value)?;
        }
        match self.place_of(collider) {
            Ok(place) => self.colliders[place].1 = properties,
            Err(place) => self.colliders.insert(place, (collider, properties)),
        }
        Ok(())
    }

    fn place_of(&self, collider: ColliderHandle) -> Result<usize, usize> {
        let parts = collider.into_raw_parts();
        self.colliders
            .binary_search_by_key(&parts, |(known, _)| known.into_raw_parts())
    }

    /// The properties of a collider, if it has some.
    pub(crate) fn get(&self, collider: ColliderHandle) -> Option<&ColliderProperties> {
        let place = self.place_of(collider).ok()?;
        Some(&self.colliders[place].1)
    }

    /// The properties of all colliders that have some, in the order of handles.
    pub(crate) fn colliders(&self) -> &[(ColliderHandle, ColliderProperties)] {
        &self.colliders
    }

    pub(super) fn set_sampling(&mut self, body: RigidBodyHandle, sampling: Option<Sampling>) {
        let own = sampling.filter(|sampling| *sampling != Sampling::Auto);
        let parts = body.into_raw_parts();
        let known = self
            .samplings
            .binary_search_by_key(&parts, |(known, _)| known.into_raw_parts());
        match (known, own) {
            (Ok(place), Some(own)) => self.samplings[place].1 = own,
            (Ok(place), None) => {
                self.samplings.remove(place);
            }
            (Err(place), Some(own)) => self.samplings.insert(place, (body, own)),
            (Err(_), None) => {}
        }
    }

    /// The samplings that were set for bodies, in the order of handles. They include bodies that no longer exist.
    pub(crate) fn samplings(&self) -> &[(RigidBodyHandle, Sampling)] {
        &self.samplings
    }

    /// The samplings that were set for bodies, each once, in an order that does not depend on the order of bodies.
    pub(crate) fn overrides(&self) -> Vec<Sampling> {
        let mut overrides: Vec<Sampling> = Vec::new();
        for (_, own) in &self.samplings {
            if !overrides.contains(own) {
                overrides.push(*own);
            }
        }
        overrides.sort_unstable_by_key(|own| *own as u8);
        overrides
    }

    /// Checks properties that were read from a file: values must be in range. Restores the order.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn checked(self) -> Result<Self, PropertyError> {
        let mut checked = UserProperties::default();
        for (name, value) in self.axes {
            let axis = name.to_string();
            if !matches!(Axis::named(&name), Axis::User(_)) || checked.value(&name).is_some() {
                return Err(PropertyError::UnknownAxis { axis });
            }
            if !value.is_finite() {
                let value = crate::math::from_f64(value);
                return Err(PropertyError::AxisValue { axis, value });
            }
            checked.axes.push((name, value));
        }
        for (collider, properties) in self.colliders {
            checked.set(collider, properties)?;
        }
        for (body, own) in self.samplings {
            checked.set_sampling(body, Some(own));
        }
        Ok(checked)
    }
}
