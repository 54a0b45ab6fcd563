//! The fields of entities in the set of their context.

use bevy::prelude::*;
use bevy_rapier3d::rapier::geometry::SharedShape;
use rapier3d_fields::field::Formula;
use rapier3d_fields::{
    Anchor, BuildError, Field, FieldHandle, FieldSet, Lifetime, Region, Tree, TreeHandle,
};

use crate::context::RapierContextFields;
use crate::force_field::ForceField;

/// Where an entity is: the frame of its fields, and the shape that they are limited to.
#[derive(Clone)]
pub(crate) struct Spot {
    /// The anchor of contact fields.
    pub contacts: Anchor,
    /// The anchor of all other fields: the same frame, but a pose in the world if no body carries it, which is faster.
    pub others: Anchor,
    pub zone: Option<SharedShape>,
}

/// The fields of an entity as they are in the set.
#[derive(Clone)]
pub(crate) struct PlacedField {
    tree: TreeHandle,
    /// The fields in the order of a walk, each with the lifetime that the component gave it.
    leaves: Vec<(FieldHandle, Lifetime)>,
    structure: u64,
    spot: Spot,
}

impl RapierContextFields {
    /// Removes the fields of an entity.
    pub(crate) fn remove(&mut self, entity: Entity) {
        self.refused.remove(&entity);
        if let Some(placed) = self.placed.remove(&entity) {
            self.fields.set.remove(placed.tree);
        }
    }

    /// Removes the fields of all entities that are not kept.
    pub(crate) fn keep(&mut self, is_kept: impl Fn(Entity) -> bool) {
        self.refused.retain(|entity, _| is_kept(*entity));
        let set = &mut self.fields.set;
        self.placed.retain(|entity, placed| {
            let is_kept = is_kept(*entity);
            if !is_kept {
                set.remove(placed.tree);
            }
            is_kept
        });
    }

    /// Inserts the fields of an entity into the set, or updates them. If they are not valid, nothing changes, and they
    /// are not tried again before they are changed or moved.
    pub(crate) fn place(
        &mut self,
        entity: Entity,
        field: &Ref<ForceField>,
        spot: Spot,
    ) -> Result<(), BuildError> {
        let refused = self.refused.get(&entity);
        if !field.is_changed() && refused.is_some_and(|it| it.is_same(&spot)) {
            return Ok(());
        }
        let result = self.place_anew(entity, field, spot.clone());
        if result.is_err() {
            self.refused.insert(entity, spot);
        } else {
            self.refused.remove(&entity);
        }
        result
    }

    fn place_anew(
        &mut self,
        entity: Entity,
        field: &Ref<ForceField>,
        spot: Spot,
    ) -> Result<(), BuildError> {
        let old = self.placed.get_mut(&entity);
        let set = &mut self.fields.set;
        match old {
            Some(old) if !field.is_changed() && old.spot.is_same(&spot) => {}
            Some(old) if field.has_structure(old.structure) => {
                edit(set, &mut old.leaves, &field.placed(|leaf| spot.place(leaf)))?;
                old.spot = spot;
            }
            old => {
                let placed = field.placed(|leaf| spot.place(leaf));
                let (tree, leaves) = insert(set, placed.tree())?;
                if let Some(old) = old {
                    set.remove(old.tree);
                }
                self.owners
                    .extend(leaves.iter().map(|leaf| (leaf.0, entity)));
                let structure = field.structure();
                let new = PlacedField {
                    tree,
                    leaves,
                    structure,
                    spot,
                };
                self.placed.insert(entity, new);
            }
        }
        Ok(())
    }
}

impl Spot {
    fn is_same(&self, other: &Spot) -> bool {
        let same_zone = match (&self.zone, &other.zone) {
            (Some(old), Some(new)) => std::sync::Arc::ptr_eq(&old.0, &new.0),
            (old, new) => old.is_none() && new.is_none(),
        };
        same_zone && self.contacts == other.contacts && self.others == other.others
    }

    /// A field of the entity as it enters the set.
    fn place(&self, field: &Field) -> Field {
        let mut leaf = field.clone();
        let Anchor::World { local_pose } = field.anchor else {
            return leaf;
        };
        let anchor = match field.formula {
            Formula::Contact(_) => &self.contacts,
            _ => &self.others,
        };
        leaf.anchor = anchor.with_local_pose(*anchor.local_pose() * local_pose);
        if let Some(shape) = &self.zone {
            // The region is in the field's own frame, the shape in that of the entity.
            let shape = Region::shape(shape.clone()).at(local_pose.inverse());
            leaf.region = if leaf.region == Region::everywhere() {
                shape
            } else {
                shape.intersection(leaf.region)
            };
        }
        leaf
    }
}

/// Inserts a tree, unless it is not valid.
fn insert(
    set: &mut FieldSet,
    tree: Tree,
) -> Result<(TreeHandle, Vec<(FieldHandle, Lifetime)>), BuildError> {
    let tree = set.insert(tree);
    if let Err(error) = set.validate_changes() {
        set.remove(tree);
        return Err(error);
    }
    let fields = set.fields_of(tree).into_iter();
    let leaves = fields.filter_map(|field| Some((field, set.get(field)?.lifetime)));
    Ok((tree, leaves.collect()))
}

/// Changes fields in place, unless one of them is not valid. Fields whose lifetime is over are not inserted again.
fn edit(
    set: &mut FieldSet,
    leaves: &mut [(FieldHandle, Lifetime)],
    placed: &ForceField,
) -> Result<(), BuildError> {
    let mut before = Vec::new();
    let mut lifetimes = Vec::new();
    for ((handle, lifetime), field) in leaves.iter().zip(placed.iter()) {
        let mut field = field.clone();
        lifetimes.push(field.lifetime);
        let Some(leaf) = set.get_mut(*handle) else {
            continue;
        };
        if field.lifetime == *lifetime {
            // The set counts down the steps of its own copy.
            field.lifetime = leaf.lifetime;
        }
        before.push((*handle, std::mem::replace(leaf, field)));
    }
    if let Err(error) = set.validate_changes() {
        for (handle, field) in before {
            set[handle] = field;
        }
        return Err(error);
    }
    for ((_, old), new) in leaves.iter_mut().zip(lifetimes) {
        *old = new;
    }
    Ok(())
}
