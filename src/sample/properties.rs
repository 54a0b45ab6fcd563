//! What users say about colliders and bodies.

use std::sync::Arc;

use super::error::PropertyError;
use super::point::{Samples, UserValues};
use crate::field::Sampling;
use crate::math::{ColliderHandle, Real, RigidBodyHandle, to_f64};
use crate::rapier::data::Coarena;

/// What the fields may ask of a collider, beyond its shape and place.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let nitrogen = ColliderProperties::new().charge(-1.02).mass(14.0067).axis("dispersion", 1.0);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
pub struct ColliderProperties {
    /// Electric charge, for [`Axis::Charge`](crate::Axis::Charge). Zero by default.
    pub charge: Real,
    /// Mass of this part of the body, if it is not the collider's own: colliders of density zero
    /// have none. Only the ratio between the parts of a body counts.
    pub mass: Option<Real>,
    /// Values along the user's axes; others take the value of the world.
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

/// The properties of all colliders that have some, and the world's values on the user's axes.
#[derive(Clone, Default)]
pub(crate) struct Properties {
    pub(crate) world: Vec<(Arc<str>, f64)>,
    entries: Coarena<Option<Entry>>,
    /// Handles with an entry, to rebuild them when the world's values change.
    listed: Vec<ColliderHandle>,
    /// By body: the sampling it asks for.
    samplings: Coarena<Option<Sampling>>,
    pub(crate) sampled: Vec<RigidBodyHandle>,
}

#[derive(Clone)]
pub(crate) struct Entry {
    pub(crate) properties: ColliderProperties,
    pub(crate) user: UserValues,
}

impl Properties {
    pub(crate) fn new(axes: Vec<(Arc<str>, Real)>) -> Self {
        Properties {
            world: axes
                .into_iter()
                .map(|(name, value)| (name, to_f64(value)))
                .collect(),
            ..Self::default()
        }
    }

    /// Begins the list of user values with the world's, for samples that have none of their own.
    pub(crate) fn of_world(&self, samples: &mut Samples) {
        samples.user.push(self.world.iter().cloned().collect());
    }

    /// Sets the properties of a collider.
    pub(crate) fn set(
        &mut self,
        collider: ColliderHandle,
        properties: ColliderProperties,
    ) -> Result<(), PropertyError> {
        properties.validate(collider)?;
        for (name, value) in &properties.axes {
            self.check_axis(name, *value)?;
        }
        if self.get(collider).is_none() {
            self.listed.push(collider);
        }
        let user = self.values(&properties);
        self.entries
            .insert(collider.0, Some(Entry { properties, user }));
        Ok(())
    }

    /// Sets the world's value along one of the user's axes.
    pub(crate) fn set_axis(&mut self, name: &str, value: Real) -> Result<(), PropertyError> {
        self.check_axis(name, value)?;
        for (known, current) in &mut self.world {
            if **known == *name {
                *current = to_f64(value);
            }
        }
        for collider in self.listed.clone() {
            let entry = self.entries.get(collider.0).cloned().flatten();
            if let Some(Entry { properties, .. }) = entry {
                let user = self.values(&properties);
                self.entries
                    .insert(collider.0, Some(Entry { properties, user }));
            }
        }
        Ok(())
    }

    /// Sets what sampling a body asks for, if any.
    pub(crate) fn set_sampling(
        &mut self,
        body: RigidBodyHandle,
        sampling: Option<Sampling>,
    ) -> Result<(), PropertyError> {
        let own = sampling.filter(|sampling| *sampling != Sampling::Auto);
        if let Some(tolerance) = own.and_then(Sampling::tolerance)
            && !(tolerance > 0.0 && tolerance.is_finite())
        {
            return Err(PropertyError::Tolerance { body, tolerance });
        }
        self.sampled.retain(|known| *known != body);
        self.sampled.extend(own.map(|_| body));
        self.samplings.insert(body.0, own);
        Ok(())
    }

    /// All that bodies ask for, those of bodies that were removed since included.
    pub(crate) fn overrides(&self) -> Vec<Sampling> {
        let mut overrides: Vec<Sampling> = Vec::new();
        for body in &self.sampled {
            let own = self.sampling(*body);
            overrides.extend(own.filter(|own| !overrides.contains(own)));
        }
        overrides
    }

    pub(crate) fn sampling(&self, body: RigidBodyHandle) -> Option<Sampling> {
        *self.samplings.get(body.0)?
    }

    /// The user's axes, with the world's values.
    pub(crate) fn world_values(&self) -> impl Iterator<Item = &(Arc<str>, f64)> {
        self.world.iter()
    }

    /// The properties of all colliders that have some.
    pub(crate) fn properties(&self) -> impl Iterator<Item = (ColliderHandle, &ColliderProperties)> {
        let listed = self.listed.iter();
        listed.filter_map(|handle| Some((*handle, &self.get(*handle)?.properties)))
    }

    /// What bodies ask for, those that were removed since included.
    pub(crate) fn samplings(&self) -> impl Iterator<Item = (RigidBodyHandle, Sampling)> {
        let sampled = self.sampled.iter();
        sampled.filter_map(|body| Some((*body, self.sampling(*body)?)))
    }

    fn check_axis(&self, name: &str, value: Real) -> Result<(), PropertyError> {
        let axis = name.to_owned();
        if !self.world.iter().any(|(known, _)| **known == *name) {
            return Err(PropertyError::UnknownAxis { axis });
        }
        if !value.is_finite() {
            return Err(PropertyError::AxisValue { axis, value });
        }
        Ok(())
    }

    fn values(&self, properties: &ColliderProperties) -> UserValues {
        let value = |(name, world): &(Arc<str>, f64)| {
            let own = properties
                .axes
                .iter()
                .rev()
                .find(|(known, _)| known == name);
            (
                name.clone(),
                own.map_or(*world, |(_, value)| to_f64(*value)),
            )
        };
        self.world.iter().map(value).collect()
    }

    pub(crate) fn get(&self, collider: ColliderHandle) -> Option<&Entry> {
        self.entries.get(collider.0)?.as_ref()
    }
}
