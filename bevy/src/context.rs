//! `RapierContextFields`: the fields of one of Rapier's contexts.

use std::collections::HashMap;

use bevy::ecs::entity::EntityHashMap;
use bevy::prelude::*;
use rapier3d_fields::pipeline::{FieldSettings, FieldState};
use rapier3d_fields::rapier::prelude::{ColliderHandle, RigidBodyHandle};
use rapier3d_fields::{FieldHandle, FieldSet, Fields};

use crate::place::{PlacedField, Spot};
use crate::reports::Reports;

/// The fields of a Rapier context: a component beside its `RapierContextSimulation`, which requires it.
///
/// It dereferences to [`Fields`], for contacts, warnings, timings, the energy account, or the wrench on a body. Its set
/// holds the fields of all [`ForceField`](crate::ForceField)s of the context, and those that you insert yourself.
/// To remove the fields of an entity, remove its component: a field that you take out of the set stays out.
///
/// A clone continues like the original, bit for bit, so a snapshot of a context is a copy of its components.
#[derive(Component, Deref, DerefMut)]
pub struct RapierContextFields {
    #[deref]
    pub(crate) fields: Fields,
    pub(crate) placed: EntityHashMap<PlacedField>,
    /// The spots at which the fields of entities were refused: they are not tried again until something changes.
    pub(crate) refused: EntityHashMap<Spot>,
    /// The entity of each field that is in the set, or left it in the last step.
    pub(crate) owners: HashMap<FieldHandle, Entity>,
    pub(crate) properties: EntityHashMap<ColliderHandle>,
    pub(crate) samplings: EntityHashMap<RigidBodyHandle>,
    pub(crate) reports: Reports,
}

impl RapierContextFields {
    /// The fields, for functions that take a [`Fields`].
    pub fn fields(&self) -> &Fields {
        &self.fields
    }

    /// The entity with the [`ForceField`](crate::ForceField) to which a field belongs; `None` if there is none.
    pub fn entity_of(&self, field: FieldHandle) -> Option<Entity> {
        self.owners.get(&field).copied()
    }
}

impl RapierContextFields {
    /// Logs the warnings of a step.
    pub(crate) fn log_warnings(&mut self) {
        self.reports.log_warnings(&self.fields);
    }

    /// Opens and closes the channels of events.
    pub(crate) fn listen(&mut self, zones: bool, contacts: bool) {
        self.reports.listen(&mut self.fields, zones, contacts);
    }

    /// Forgets the entities of fields that left the set, after their last events were sent.
    pub(crate) fn forget_removed(&mut self) {
        if self.owners.len() > self.fields.set.len() {
            let set = &self.fields.set;
            self.owners.retain(|field, _| set.get(*field).is_some());
        }
    }
}

impl Default for RapierContextFields {
    fn default() -> Self {
        let (set, settings) = (FieldSet::new(), FieldSettings::default());
        let fields = Fields::from_parts(set, settings, FieldState::default());
        RapierContextFields {
            fields: fields.expect("nothing is valid"),
            placed: Default::default(),
            refused: Default::default(),
            owners: HashMap::new(),
            properties: Default::default(),
            samplings: Default::default(),
            reports: Reports::default(),
        }
    }
}

impl Clone for RapierContextFields {
    fn clone(&self) -> Self {
        let mut copy = RapierContextFields {
            fields: self.fields.clone(),
            placed: self.placed.clone(),
            refused: self.refused.clone(),
            owners: self.owners.clone(),
            properties: self.properties.clone(),
            samplings: self.samplings.clone(),
            reports: Reports::default(),
        };
        copy.reports = self.reports.for_copy(&mut copy.fields);
        copy
    }
}
