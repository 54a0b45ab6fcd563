//! Prediction of the next touch of two colliders, for detection fields that act only in parts of space.

use super::field_mask::NextTouch;
use super::hooks::velocity_at;
use super::overlap::{distance, nearest};
use super::starts::Starts;
use crate::math::{ColliderHandle, Vector};
use crate::rapier::geometry::Collider;
use crate::rapier::parry::query::{ShapeCastOptions, cast_shapes};
use crate::rigid::{Lookup, local_pose};

/// The next touch of two colliders within two steps, if nothing else hits them, or the place where they are nearest if
/// they pass by closely. Rotation is ignored, and so is the curvature of Rapier's paths within a step.
pub(super) fn next_touch(
    starts: &Starts,
    pair: [ColliderHandle; 2],
    world: &impl Lookup,
) -> Option<NextTouch> {
    let colliders = pair.map(|handle| world.collider(handle));
    let [Some(one), Some(two)] = colliders else {
        return None;
    };
    let place = |collider: &Collider| {
        let body = collider.parent().and_then(|it| Some((it, world.body(it)?)));
        let Some((handle, body)) = body else {
            return (*collider.position(), Vector::ZERO);
        };
        let pose = *body.position() * local_pose(collider);
        let velocity = velocity_at(body, pose.translation, starts.dt());
        (pose, velocity + starts.gained(handle))
    };
    let [(here, first), (there, second)] = [one, two].map(place);
    let skins = one.contact_skin().max(0.0) + two.contact_skin().max(0.0);
    let far = skins + 0.25 * starts.rebound();
    let shapes = [one.shared_shape(), two.shared_shape()];
    let relative = here.inv_mul(&there);
    let depth = 0.5 * starts.rebound();
    let along = (first - second).normalize_or_zero() * depth;
    if distance(shapes, &relative, far).is_some_and(|apart| apart < far) {
        let near = nearest(shapes, &relative, far).ok().flatten();
        let normal = near.map_or(Vector::ZERO, |near| here.rotation * near.normal1);
        return Some(NextTouch {
            pair,
            time: 0.0,
            ways: [Vector::ZERO; 2],
            into: [along, normal * depth],
        });
    }
    let options = ShapeCastOptions {
        // Two steps, because rounding decides in which of two steps a touch falls.
        max_time_of_impact: 2.0 * starts.dt(),
        target_distance: skins,
        stop_at_penetration: false,
        compute_impact_geometry_on_penetration: true,
    };
    let (one, two) = (one.shape(), two.shape());
    let hit = cast_shapes(&here, first, one, &there, second, two, options);
    let Some(hit) = hit.ok().flatten() else {
        // Rapier's solver treats surfaces as planes until the next step, so it also pushes parts that pass by closely.
        // Such a pair belongs to the side that would answer a touch here.
        let reach = (first - second).length() * starts.dt() + far + 4.0 * starts.rebound();
        let near = nearest(shapes, &relative, reach).ok().flatten()?;
        let across = here.rotation * near.normal1 * (near.dist + depth);
        return Some(NextTouch {
            pair,
            time: 0.0,
            ways: [Vector::ZERO; 2],
            into: [across; 2],
        });
    };
    let normal = (here.rotation * hit.normal1).normalize_or_zero();
    Some(NextTouch {
        pair,
        time: hit.time_of_impact,
        ways: [first, second].map(|velocity| velocity * hit.time_of_impact),
        into: [along, normal * depth],
    })
}
