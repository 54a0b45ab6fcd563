//! The properties that users give to colliders and bodies, in tables for a fast look-up by handle.

use std::collections::HashMap;

use super::point::UserValues;
use super::samples::Samples;
use crate::field::{Change, ColliderProperties, FieldSet, Sampling};
use crate::math::{ColliderHandle, RigidBodyHandle, to_f64};
use crate::rapier::data::Index;

/// Handles of larger indices are looked up in a map, since a file may hold any index, and memory must not grow
/// with it.
const DENSE: u32 = 1 << 20;

/// The properties of all colliders that have some, by handle. It follows a [`FieldSet`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Properties {
    /// The revision of the set that it was made from.
    revision: u64,
    /// The number of changes.
    pub(super) changes: u64,
    world: UserValues,
    entries: ByHandle<Entry>,
    /// The sampling that a body asks for, by body.
    samplings: ByHandle<Sampling>,
    /// True if any body asks for a sampling of its own.
    any_sampling: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) properties: ColliderProperties,
    pub(crate) user: UserValues,
}

impl Properties {
    /// Takes the changes of the set since the last call.
    pub(crate) fn update(&mut self, set: &FieldSet) {
        if self.revision == set.revision() {
            return;
        }
        let concerns = |change: &Change| !matches!(change, Change::Term(_));
        let of_collider = |change: &Change| match change {
            Change::Collider(collider) => Some(*collider),
            _ => None,
        };
        let changes = set.changes_since(self.revision);
        self.revision = set.revision();
        let Some(changes) = changes else {
            self.changes += 1;
            return self.take_up_all(set);
        };
        let changes: Vec<Change> = changes.filter(concerns).collect();
        self.changes += u64::from(!changes.is_empty());
        let colliders: Option<Vec<ColliderHandle>> = changes.iter().map(of_collider).collect();
        match colliders {
            Some(colliders) => colliders.into_iter().for_each(|c| self.take_up(set, c)),
            None => self.take_up_all(set),
        }
    }

    fn take_up_all(&mut self, set: &FieldSet) {
        let data = set.data();
        *self = Properties {
            revision: self.revision,
            changes: self.changes,
            world: data.axes().iter().cloned().collect(),
            any_sampling: !data.samplings().is_empty(),
            ..Properties::default()
        };
        for (collider, _) in data.colliders() {
            self.take_up(set, *collider);
        }
        for (body, own) in data.samplings() {
            self.samplings.insert(body.0, *own);
        }
    }

    fn take_up(&mut self, set: &FieldSet, collider: ColliderHandle) {
        if let Some(properties) = set.data().get(collider) {
            let entry = Entry {
                properties: properties.clone(),
                user: self.values(properties),
            };
            self.entries.insert(collider.0, entry);
        }
    }

    /// Begins the list of user values with the world's, for samples without values of their own.
    pub(crate) fn of_world(&self, samples: &mut Samples) {
        samples.user.push(self.world.clone());
    }

    /// Returns true if any body asks for a sampling of its own.
    pub(crate) fn any_sampling(&self) -> bool {
        self.any_sampling
    }

    pub(crate) fn sampling(&self, body: RigidBodyHandle) -> Option<Sampling> {
        self.samplings.get(body.0).copied()
    }

    pub(crate) fn get(&self, collider: ColliderHandle) -> Option<&Entry> {
        self.entries.get(collider.0)
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

/// Values by the index and generation of a handle.
#[derive(Clone, Debug)]
struct ByHandle<T> {
    values: Vec<(Index, T)>,
    /// For indices below [`DENSE`]: the number of the value plus one, or zero.
    dense: Vec<u32>,
    /// The same for larger indices.
    sparse: HashMap<u32, u32>,
}

impl<T> Default for ByHandle<T> {
    fn default() -> Self {
        ByHandle {
            values: Vec::new(),
            dense: Vec::new(),
            sparse: HashMap::new(),
        }
    }
}

impl<T> ByHandle<T> {
    fn number(&self, index: u32) -> Option<usize> {
        let dense = self.dense.get(index as usize);
        let number = dense.or_else(|| self.sparse.get(&index))?;
        (*number as usize).checked_sub(1)
    }

    fn get(&self, handle: Index) -> Option<&T> {
        let (known, value) = &self.values[self.number(handle.into_raw_parts().0)?];
        (*known == handle).then_some(value)
    }

    /// Of two handles with the same index the last one inserted stays.
    fn insert(&mut self, handle: Index, value: T) {
        let (index, _) = handle.into_raw_parts();
        if let Some(number) = self.number(index) {
            self.values[number] = (handle, value);
            return;
        }
        self.values.push((handle, value));
        let number = self.values.len() as u32;
        if index >= DENSE {
            self.sparse.insert(index, number);
            return;
        }
        if self.dense.len() <= index as usize {
            self.dense.resize(index as usize + 1, 0);
        }
        self.dense[index as usize] = number;
    }
}
