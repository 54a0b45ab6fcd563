//! Updates the fields of contexts from the components of entities, before Rapier's steps.

use std::error::Error;

use bevy::ecs::entity::EntityHashMap;
use bevy::prelude::*;
use bevy_rapier3d::prelude::{RapierColliderHandle, RapierContextColliders, RapierRigidBodyHandle};
use rapier3d_fields::pipeline::{FieldSettings, FieldState};
use rapier3d_fields::{Anchor, Axis, ColliderProperties, FieldSet, Fields, Sampling, StepError};

use crate::carrier::{Carrier, Carriers};
use crate::components::{FieldProperties, FieldSampling, WithinCollider};
use crate::context::RapierContextFields;
use crate::force_field::ForceField;
use crate::place::Spot;
use crate::settings::RapierFieldsSettings;

/// Copies changed settings to all contexts, and the current settings to new contexts.
pub(crate) fn sync_settings(
    settings: Res<RapierFieldsSettings>,
    mut contexts: Query<(Entity, &mut RapierContextFields)>,
) {
    let is_changed = settings.is_changed();
    let mut valid = None;
    for (entity, mut context) in &mut contexts {
        if !is_changed && !context.is_added() {
            continue;
        }
        match valid.get_or_insert_with(|| check(&settings.fields)) {
            Ok(()) => context.settings = settings.fields.clone(),
            Err(error) => log::error!("the settings of fields are refused: {error}"),
        }
        // Refused fields may read an axis that is declared now.
        context.refused.clear();
        context.listen(settings.zone_events, settings.contact_events);
        for (name, value) in &settings.axes {
            if let Err(error) = set_axis(&mut context.set, name, *value) {
                log::error!("an axis of context {entity} is refused: {error}");
            }
        }
    }
}

/// Declares an axis, or sets the value of one that is declared.
fn set_axis(set: &mut FieldSet, name: &str, value: f32) -> Result<(), Box<dyn Error>> {
    let declared = set.axes().any(|(axis, _)| axis == Axis::from(name));
    if declared {
        set.set_axis(name, value)?;
    } else {
        set.declare_axis(name, value)?;
    }
    Ok(())
}

/// Returns an error if the settings are not valid, by making fields of an empty set with them.
fn check(settings: &FieldSettings) -> Result<(), StepError> {
    let (set, state) = (FieldSet::new(), FieldState::default());
    Fields::from_parts(set, settings.clone(), state).map(drop)
}

type FieldEntity = (
    Entity,
    Ref<'static, ForceField>,
    Option<&'static RapierColliderHandle>,
    Has<WithinCollider>,
);

/// Adds, moves, changes and removes the fields of entities.
pub(crate) fn sync_force_fields(
    entities: Query<FieldEntity>,
    carriers: Carriers,
    mut contexts: Query<(Entity, &mut RapierContextFields, &RapierContextColliders)>,
) {
    let found = entities.iter().map(|it| (it.0, carriers.of(it.0)));
    let found: Vec<(Entity, Carrier)> = found.collect();
    let homes = found.iter().map(|it| (it.0, it.1.context));
    let homes: EntityHashMap<Option<Entity>> = homes.collect();
    for (at, mut context, colliders) in &mut contexts {
        if found.is_empty() && context.placed.is_empty() && context.refused.is_empty() {
            continue;
        }
        let context = &mut *context;
        context.keep(|entity| homes.get(&entity) == Some(&Some(at)));
        for (entity, carrier) in found.iter().filter(|it| it.1.context == Some(at)) {
            let Ok((_, field, collider, is_within)) = entities.get(*entity) else {
                continue;
            };
            let collider = collider.and_then(|it| colliders.colliders.get(it.0));
            if is_within && collider.is_none() {
                if field.is_changed() {
                    log::warn!("entity {entity} has no collider yet: within it there is no field");
                }
                context.remove(*entity);
                continue;
            }
            let still = collider.filter(|it| it.parent().is_none());
            let spot = Spot {
                contacts: carrier.anchor,
                others: still.map_or(carrier.anchor, |it| Anchor::from(*it.position())),
                zone: collider
                    .filter(|_| is_within)
                    .map(|it| it.shared_shape().clone()),
            };
            if let Err(error) = context.place(*entity, &field, spot) {
                log::error!("the fields of entity {entity} are refused: {error}");
            }
        }
    }
}

/// Copies the properties of colliders to the fields of their contexts.
pub(crate) fn sync_properties(
    entities: Query<(Entity, Ref<FieldProperties>, &RapierColliderHandle)>,
    carriers: Carriers,
    mut contexts: Query<(Entity, &mut RapierContextFields, &RapierContextColliders)>,
) {
    for (at, mut context, colliders) in &mut contexts {
        if entities.is_empty() && context.properties.is_empty() {
            continue;
        }
        let context = &mut *context;
        let set = &mut context.fields.set;
        let here = |entity| carriers.context_of(entity) == Some(at);
        let now = |entity| Some(entities.get(entity).ok()?.2.0).filter(|_| here(entity));
        for handle in take_stale(&mut context.properties, now) {
            let nothing = ColliderProperties::new();
            set.set_properties(handle, nothing)
                .expect("no properties are valid");
        }
        for (entity, properties, handle) in &entities {
            let known = context.properties.get(&entity) == Some(&handle.0);
            if known && !properties.is_changed() || !here(entity) {
                continue;
            }
            let (handle, colliders) = (handle.0, &colliders.colliders);
            let result = context
                .fields
                .set_properties(handle, properties.0.clone(), colliders);
            if let Err(error) = result {
                log::error!("the properties of entity {entity} are refused: {error}");
            }
            context.properties.insert(entity, handle);
        }
    }
}

/// Copies the samplings of bodies to the fields of their contexts.
pub(crate) fn sync_samplings(
    entities: Query<(Entity, Ref<FieldSampling>, &RapierRigidBodyHandle)>,
    carriers: Carriers,
    mut contexts: Query<(Entity, &mut RapierContextFields)>,
) {
    for (at, mut context) in &mut contexts {
        if entities.is_empty() && context.samplings.is_empty() {
            continue;
        }
        let context = &mut *context;
        let set = &mut context.fields.set;
        let here = |entity| carriers.context_of(entity) == Some(at);
        let now = |entity| Some(entities.get(entity).ok()?.2.0).filter(|_| here(entity));
        for handle in take_stale(&mut context.samplings, now) {
            set.set_sampling(handle, None::<Sampling>);
        }
        for (entity, sampling, handle) in &entities {
            let known = context.samplings.get(&entity) == Some(&handle.0);
            if known && !sampling.is_changed() || !here(entity) {
                continue;
            }
            context.fields.set.set_sampling(handle.0, sampling.0);
            context.samplings.insert(entity, handle.0);
        }
    }
}

/// Removes the entities whose handle has changed from a list, and returns their old handles.
fn take_stale<H: Copy + PartialEq>(
    list: &mut EntityHashMap<H>,
    now: impl Fn(Entity) -> Option<H>,
) -> Vec<H> {
    let is_stale = |entity: &Entity, handle: &mut H| now(*entity) != Some(*handle);
    list.extract_if(is_stale).map(|it| it.1).collect()
}
