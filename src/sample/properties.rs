//! The properties that users give to colliders and bodies, in tables for a fast look-up by handle.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use super::point::UserValues;
use super::samples::Samples;
use crate::field::{Change, ColliderProperties, FieldSet, Fingerprint, Sampling};
use crate::math::{ColliderHandle, RigidBodyHandle, to_f64};

/// Values by handle. Not a list by index, since a file may hold any index, and memory must not grow with it.
type ByHandle<Handle, Value> = HashMap<Handle, Value, BuildHasherDefault<Fingerprint>>;

/// The properties of all colliders that have some, by handle. It follows a [`FieldSet`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Properties {
    /// The revision of the set that it was made from.
    revision: u64,
    /// The number of changes.
    pub(super) changes: u64,
    world: UserValues,
    entries: ByHandle<ColliderHandle, Entry>,
    /// The samplings that were set for bodies.
    samplings: ByHandle<RigidBodyHandle, Sampling>,
}

#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) properties: ColliderProperties,
    pub(crate) user: UserValues,
}

impl Properties {
    /// Follows the changes of the set since the last call.
    pub(crate) fn update(&mut self, set: &FieldSet) {
        if self.revision == set.revision() {
            return;
        }
        let changes = set.changes_since(self.revision);
        self.revision = set.revision();
        let concerns = |change: Change| !matches!(change, Change::Term(_));
        if !changes.is_none_or(|mut changes| changes.any(concerns)) {
            return;
        }
        self.changes += 1;
        let data = set.data();
        self.world = data.axes().iter().cloned().collect();
        let entries = data.colliders().iter().map(|(collider, properties)| {
            let entry = Entry {
                properties: properties.clone(),
                user: self.values(properties),
            };
            (*collider, entry)
        });
        self.entries = entries.collect();
        self.samplings = data.samplings().iter().copied().collect();
    }

    /// Begins the list of user values with the world's, for samples without values of their own.
    pub(crate) fn of_world(&self, samples: &mut Samples) {
        samples.user.push(self.world.clone());
    }

    /// Returns true if a sampling was set for any body.
    pub(crate) fn any_sampling(&self) -> bool {
        !self.samplings.is_empty()
    }

    pub(crate) fn sampling(&self, body: RigidBodyHandle) -> Option<Sampling> {
        self.samplings.get(&body).copied()
    }

    pub(crate) fn get(&self, collider: ColliderHandle) -> Option<&Entry> {
        self.entries.get(&collider)
    }

    fn values(&self, properties: &ColliderProperties) -> UserValues {
        let value = |(name, world): &(std::sync::Arc<str>, f64)| {
            let mut own = properties.axes.iter().rev();
            let own = own.find(|(known, _)| known == name);
            let value = own.map_or(*world, |(_, value)| to_f64(*value));
            (name.clone(), value)
        };
        self.world.iter().map(value).collect()
    }
}
