//! Fixed bodies that would hide a scene, such as the walls of a closed box: they are drawn like glass.

use kiss3d::color::Color;
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::parry::bounding_volume::{Aabb, BoundingVolume};

pub const GLASS: Color = Color::new(0.5, 0.55, 0.6, 0.12);

/// The box around all dynamic bodies; `None` if there are none.
pub fn around_dynamic(world: &PhysicsWorld) -> Option<Aabb> {
    let dynamic = world.colliders.iter().filter(|(_, collider)| {
        let parent = collider.parent().and_then(|body| world.bodies.get(body));
        parent.is_some_and(RigidBody::is_dynamic)
    });
    let boxes = dynamic.map(|(_, collider)| collider.compute_aabb());
    boxes.reduce(|all, one| all.merged(&one))
}

/// The fixed bodies that are as large as the scene and rise above its middle.
pub fn hiding(world: &PhysicsWorld) -> Vec<RigidBodyHandle> {
    let Some(scene) = around_dynamic(world) else {
        return Vec::new();
    };
    let hides = |collider: &Collider| {
        let wall = collider.compute_aabb();
        let is_large = wall.extents().max_element() >= scene.extents().max_element();
        is_large && wall.maxs.y > scene.center().y
    };
    let fixed = world.bodies.iter().filter(|(_, body)| body.is_fixed());
    let walls = fixed.filter(|(_, body)| {
        let colliders = body.colliders().iter();
        colliders
            .filter_map(|it| world.colliders.get(*it))
            .any(hides)
    });
    walls.map(|(handle, _)| handle).collect()
}
