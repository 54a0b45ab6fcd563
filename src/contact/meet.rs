//! Prediction of the next touch of two colliders, for detection fields that act only in parts of space.

use super::field_mask::NextTouch;
use super::hooks::velocity_at;
use super::overlap::distance;
use super::starts::Starts;
use crate::math::{ColliderHandle, Vector};
use crate::rapier::geometry::Collider;
use crate::rapier::parry::query::{ShapeCastOptions, cast_shapes};
use crate::rigid::{Lookup, local_pose};

/// The next touch of two colliders within two steps, if nothing else hits them. Rotation is ignored.
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
    let options = ShapeCastOptions {
        // Two steps, because rounding decides in which of two steps a touch falls.
        max_time_of_impact: 2.0 * starts.dt(),
        target_distance: skins,
        stop_at_penetration: false,
        compute_impact_geometry_on_penetration: true,
    };
    let far = skins + 0.25 * starts.rebound();
    let shapes = [one.shared_shape(), two.shared_shape()];
    let apart = distance(shapes, &here.inv_mul(&there), far);
    let time = if apart.is_some_and(|apart| apart < far) {
        0.0
    } else {
        let (one, two) = (one.shape(), two.shape());
        let hit = cast_shapes(&here, first, one, &there, second, two, options);
        hit.ok().flatten()?.time_of_impact
    };
    Some(NextTouch {
        pair,
        time,
        ways: [first * time, second * time],
        into: (first - second).normalize_or_zero() * (0.5 * starts.rebound()),
    })
}
