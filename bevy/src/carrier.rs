//! The frame of an entity with fields: a collider, a body, or the world.

use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy_rapier3d::prelude::{
    DefaultRapierContext, RapierColliderHandle, RapierContextEntityLink, RapierRigidBodyHandle,
};
use rapier3d_fields::Anchor;
use rapier3d_fields::rapier::prelude::Pose;

/// The components from which the frame of an entity is found.
type InRapier = (
    Option<&'static RapierContextEntityLink>,
    Option<&'static RapierRigidBodyHandle>,
    Option<&'static RapierColliderHandle>,
    Option<&'static Transform>,
    Option<&'static ChildOf>,
);

/// Finds the frames of entities.
#[derive(SystemParam)]
pub(crate) struct Carriers<'w, 's> {
    entities: Query<'w, 's, InRapier>,
    globals: Query<'w, 's, &'static GlobalTransform>,
    default_context: Query<'w, 's, Entity, With<DefaultRapierContext>>,
}

/// The frame of an entity.
pub(crate) struct Carrier {
    pub anchor: Anchor,
    /// The context that the entity belongs to; `None` if there is none.
    pub context: Option<Entity>,
}

impl Carriers<'_, '_> {
    /// The frame of an entity: its collider, else the nearest body among itself and its ancestors, else the world.
    pub fn of(&self, entity: Entity) -> Carrier {
        let mut context = None;
        let mut within = Transform::IDENTITY;
        let mut next = Some(entity);
        while let Some(at) = next {
            let Ok((link, body, collider, transform, parent)) = self.entities.get(at) else {
                break;
            };
            context = context.or(link.map(|link| link.0));
            let anchor = match (collider, body) {
                (Some(collider), _) if at == entity => Some(Anchor::from(collider.0)),
                (_, Some(body)) => Some(Anchor::from(body.0).with_local_pose(pose_of(&within))),
                _ => None,
            };
            if let Some(anchor) = anchor {
                return Carrier {
                    anchor,
                    context: context.or_else(|| self.default_context()),
                };
            }
            within = transform.map_or(within, |transform| transform.mul_transform(within));
            next = parent.map(ChildOf::parent);
        }
        let in_world = self
            .globals
            .get(entity)
            .map(GlobalTransform::compute_transform);
        let local_pose = in_world.map_or(Pose::IDENTITY, |transform| pose_of(&transform));
        Carrier {
            anchor: Anchor::World { local_pose },
            context: context.or_else(|| self.default_context()),
        }
    }

    /// The context of an entity with a body or a collider of Rapier.
    pub fn context_of(&self, entity: Entity) -> Option<Entity> {
        let link = self.entities.get(entity).ok().and_then(|it| it.0);
        link.map(|link| link.0).or_else(|| self.default_context())
    }

    fn default_context(&self) -> Option<Entity> {
        self.default_context.single().ok()
    }
}

fn pose_of(transform: &Transform) -> Pose {
    Pose::from_parts(transform.translation, transform.rotation.normalize())
}
