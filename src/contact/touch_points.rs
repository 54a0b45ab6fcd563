//! The points at which two parts touch.

use super::moving_shape::{SweptPair, skins};
use super::overlap::manifold_points;
use super::shape_gap::{contact, relative};
use super::solve::ContactPoint;
use super::swept_parts::Form;
use crate::math::{DVec3, Real, from_f64, to_dvec3, to_f64};

/// Corners whose gaps differ by less than this share of the size of the parts touch at once, so that a box that falls
/// flat does not roll from corner to corner.
const FLAT: f64 = 1e-3;

/// All points at which two touching parts touch at a moment; the first one is the deepest.
pub(super) fn spots(parts: SweptPair<'_>, time: f64) -> Vec<ContactPoint> {
    let first: Vec<_> = spot(parts, time).into_iter().collect();
    let Some(depth) = first.first().map(|spot| spot.depth) else {
        return first;
    };
    if parts.iter().any(|part| part.member.is_ball()) {
        return first;
    }
    let [a, b] = parts;
    let flat = FLAT * (a.member.finite_reach() + b.member.finite_reach());
    let relative = relative(parts, time, DVec3::ZERO);
    let (origin, rotation) = (a.place(time), a.frame(time).rotation);
    let margin = from_f64((flat - depth).max(0.0) + skins(parts));
    let all = manifold_points([&a.member.shape, &b.member.shape], &relative, margin);
    let all = all.iter().filter_map(|point| {
        let point = point.placed(&relative);
        let normal = (rotation * to_dvec3(point.world_normal)).try_normalize()?;
        let middle = origin + rotation * to_dvec3(point.world_point);
        Some(ContactPoint {
            point: middle + normal * between_skins(parts),
            normal,
            depth: to_f64(point.depth) + skins(parts),
        })
    });
    let mut all: Vec<_> = all.filter(|point| point.point.is_finite()).collect();
    let deepest = (0..all.len()).max_by(|a, b| all[*a].depth.total_cmp(&all[*b].depth));
    if let Some(deepest) = deepest {
        all.swap(0, deepest);
    }
    if all.len() > 1 { all } else { first }
}

/// The point at which two touching parts touch at a moment.
fn spot([a, b]: SweptPair<'_>, time: f64) -> Option<ContactPoint> {
    match [a.member.form, b.member.form] {
        [Form::Ball { radius }, Form::Ball { radius: other }] => {
            let (from, to) = (a.place(time), b.place(time));
            // With equal centres any direction is valid; Rapier takes +y too.
            let normal = (to - from).try_normalize().unwrap_or(DVec3::Y);
            let depth = radius + other - (to - from).length();
            Some(ContactPoint {
                point: from + normal * (radius - depth * 0.5),
                normal,
                depth,
            })
        }
        [Form::Plane { normal }, Form::Ball { radius }] if !a.turns() => {
            Some(on_plane([a, b], normal, radius, time))
        }
        [Form::Ball { radius }, Form::Plane { normal }] if !b.turns() => {
            let spot = on_plane([b, a], normal, radius, time);
            Some(ContactPoint {
                normal: -spot.normal,
                ..spot
            })
        }
        _ => of_shapes([a, b], time),
    }
}

/// The point at which any two shapes touch, by Parry.
fn of_shapes([a, b]: SweptPair<'_>, time: f64) -> Option<ContactPoint> {
    let size = a.member.finite_reach() + b.member.finite_reach();
    let apart = to_f64(Real::EPSILON).sqrt() * size;
    let near = 16.0 * apart + skins([a, b]);
    let found = contact([a, b], time, near, DVec3::ZERO)?;
    // For parts that touch, the normal is dominated by rounding. A little way back it is precise to the square root of
    // a rounding, which is about the best possible.
    let closing = b.track.path.velocity(time) - a.track.path.velocity(time);
    let back = closing.normalize_or_zero() * -apart;
    let before = contact([a, b], time, near, back).filter(|c| c.dist > 0.0);
    let normal = before.map_or(found.normal1, |before| before.normal1);
    let rotation = a.frame(time).rotation;
    let middle = (to_dvec3(found.point1) + to_dvec3(found.point2)) * 0.5;
    let normal = (rotation * to_dvec3(normal)).try_normalize()?;
    Some(ContactPoint {
        point: a.place(time) + rotation * middle + normal * between_skins([a, b]),
        normal,
        depth: skins([a, b]) - to_f64(found.dist),
    })
}

fn on_plane([a, b]: SweptPair<'_>, normal: DVec3, radius: f64, time: f64) -> ContactPoint {
    let normal = a.track.path.attitude(time) * normal;
    let centre = b.place(time);
    let depth = radius + a.member.skin - (centre - a.place(time)).dot(normal);
    ContactPoint {
        point: centre - normal * (radius - depth * 0.5),
        normal,
        depth,
    }
}

/// The offset, along the normal, from the middle between two surfaces to that between their skins.
fn between_skins([a, b]: SweptPair<'_>) -> f64 {
    0.5 * (a.member.skin - b.member.skin)
}
