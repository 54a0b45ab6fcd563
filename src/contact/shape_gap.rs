//! The gap between two parts of any shape, by Parry: whether it may close, when it does, and how deep they overlap.

use std::cell::{Cell, OnceCell};

use super::conservative_advancement::{CLEARLY, Chord, Gap, ValueSearch};
use super::moving_shape::{Approach, MovingShape, SweptPair, fastest_approach, skins};
use super::overlap::{distance, manifold_points, nearest};
use super::separation::Separations;
use crate::math::{
    DPose3, DVec3, Pose, Real, Vector, from_dvec3, from_f64, relative_pose, to_dvec3, to_f64,
};
use crate::rapier::parry::query::{Contact, Unsupported};

/// The most refinements of a touch along a direction; the last one leaves at most this share of the gap.
const REFINEMENTS: usize = 4;
const NEARLY: f64 = 0.1;

/// The work of a look at a shape made of pieces, such as a mesh.
const LOOK_AT_PIECES: u64 = 16;

/// The depth at which two parts touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct TouchDepth {
    pub depth: f64,
    /// The further depth that rest explains.
    pub bearable: f64,
}

/// Returns true if two parts may touch in `span`, by the distance kept for the pair. Distances are kept only for pairs of
/// which [`touch_of_shapes`] needs Parry's distance; a half-space needs none.
pub(super) fn may_touch([a, b]: SweptPair<'_>, span: [f64; 2], known: &mut Separations) -> bool {
    if !a.is_solid() && !b.is_solid() {
        return true;
    }
    let facing = Facing::new([a, b], span);
    let [a, b] = facing.parts;
    let frames = facing.frames(span[0]);
    if let Some(plane) = a.member.shape.as_halfspace() {
        let axis = frames[0].rotation * to_dvec3(plane.normal);
        let clear = CLEARLY * tolerance([a, b]);
        return facing.stays_above(clear, axis, &frames, span[0]) < f64::INFINITY;
    }
    let pair = [a, b].map(|part| part.member.part.collider);
    let shapes = [&a.member.shape, &b.member.shape];
    let relative = relative_pose(&frames[0], &frames[1]);
    let near = within_reach([a, b], span).near;
    let measure = |reach: Real| {
        let far = near + 0.25 * to_f64(reach);
        distance(shapes, &relative, from_f64(far))
    };
    !known.are_apart(pair, shapes, &relative, from_f64(near), measure)
}

/// Two parts in a span, by the gap between them along some direction.
struct Facing<'a> {
    /// A half-space is the first.
    parts: SweptPair<'a>,
    approach: Approach,
    /// The frames of the parts at the end of the span, once they were needed.
    at_end: OnceCell<[DPose3; 2]>,
}

impl<'a> Facing<'a> {
    fn new([a, b]: SweptPair<'a>, span: [f64; 2]) -> Self {
        let parts = if b.is_plane() { [b, a] } else { [a, b] };
        Facing {
            parts,
            approach: Approach::new(parts, span),
            at_end: OnceCell::new(),
        }
    }

    /// The poses of the colliders' frames, in world space.
    fn frames(&self, time: f64) -> [DPose3; 2] {
        self.parts.map(|part| part.frame(time))
    }

    /// The moment until which the gap along a unit vector in world space, from the first part to the second, stays above
    /// a level; infinite if it does so to the end of the span. `frames` are those at `from`.
    fn stays_above(&self, level: f64, axis: DVec3, frames: &[DPose3; 2], from: f64) -> f64 {
        let end = self.approach.to;
        let Some(last) = self.gap_along(axis, self.at_end.get_or_init(|| self.frames(end))) else {
            return from;
        };
        let curvature = self.curvature(axis);
        let gap = |frames: &_| self.gap_along(axis, frames).unwrap_or(f64::NAN) - level;
        let first = gap(frames);
        if first.is_nan() || first <= 0.0 {
            return from;
        }
        let (mut time, mut now) = (from, first);
        for _ in 0..REFINEMENTS {
            let chord = |gaps, duration| Chord {
                gaps,
                duration,
                curvature,
            };
            let free = chord([now, last - level], end - time).stays_positive();
            // A shorter chord is nearer to the gap.
            let ahead = 4.0 * free;
            if free == f64::INFINITY {
                return free;
            }
            let near = if time + ahead < end {
                let soon = gap(&self.frames(time + ahead));
                chord([now, soon], ahead).stays_positive().min(ahead)
            } else {
                free
            };
            time += near.max(free);
            now = gap(&self.frames(time));
            if now.is_nan() || now <= NEARLY * first {
                break;
            }
        }
        time
    }

    /// An upper bound of the acceleration of the second part's points relative to the first part's along a unit vector;
    /// infinite for a half-space that turns, because points far from its origin are fast then.
    fn curvature(&self, axis: DVec3) -> f64 {
        let [a, b] = self.parts;
        if a.is_plane() && a.turns() {
            return f64::INFINITY;
        }
        let bend = |part: MovingShape<'_>| part.track.path.bounds().acceleration * part.swinging();
        self.approach.acceleration_along(axis) + bend(a) + bend(b)
    }

    /// The gap along a unit vector, which is never above the distance, nor above minus the depth. `None` unless both
    /// parts are convex.
    fn gap_along(&self, axis: DVec3, [one, two]: &[DPose3; 2]) -> Option<f64> {
        let [a, b] = self.parts.map(|part| part.member.shape.as_support_map());
        let second = b?;
        let along = from_dvec3(one.rotation.inverse() * axis);
        let reached = if self.parts[0].is_plane() {
            Vector::ZERO
        } else {
            a?.local_support_point(along)
        };
        let reaching = second.support_point(&relative_pose(one, two), -along);
        Some(to_f64((reaching - reached).dot(along)) - skins(self.parts))
    }
}

/// The overlap of two parts at a moment; zero if they do not overlap. Adds its work to `looks`.
pub(super) fn overlap_at(parts: SweptPair<'_>, time: f64, looks: &Cell<u64>) -> f64 {
    looks.set(looks.get() + work_of_look(parts));
    let found = contact(parts, time, skins(parts), DVec3::ZERO);
    found.map_or(0.0, |it| (skins(parts) - to_f64(it.dist)).max(0.0))
}

/// The distances and speeds that decide a touch by Parry's distance.
struct WithinReach {
    /// As of [`fastest_approach`].
    speed: f64,
    /// As of [`tolerance`].
    tolerance: f64,
    near: f64,
}

/// A smaller gap between two parts counts as touching.
fn tolerance([a, b]: SweptPair<'_>) -> f64 {
    32.0 * to_f64(Real::EPSILON) * (a.size() + b.size())
}

fn within_reach([a, b]: SweptPair<'_>, span: [f64; 2]) -> WithinReach {
    let speed = fastest_approach([a, b], span);
    let tolerance = tolerance([a, b]);
    WithinReach {
        speed,
        tolerance,
        near: speed * (span[1] - span[0]) * 1.01 + tolerance + skins([a, b]),
    }
}

/// The first moment in `span` at which two parts of any shapes overlap by a depth and approach, by Parry's distance in
/// [`Real`]. Adds its work to `looks`.
pub(super) fn touch_of_shapes(
    parts: SweptPair<'_>,
    touch: TouchDepth,
    span: [f64; 2],
    looks: &Cell<u64>,
) -> Option<f64> {
    let WithinReach {
        speed,
        tolerance,
        near,
    } = within_reach(parts, span);
    let look = work_of_look(parts);
    let [a, b] = parts.map(|part| part.member.thickness);
    let search = ValueSearch {
        span,
        tolerance,
        speed,
        thin: 0.5 * a.min(b),
        bearable: touch.bearable,
    };
    let facing = &Facing::new(parts, span);
    let parts = facing.parts;
    search.first_touch(|time| {
        looks.set(looks.get() + look);
        let frames = facing.frames(time);
        let found = contact_at(parts, &relative_pose(&frames[0], &frames[1]), near)?;
        let axis = frames[0].rotation * to_dvec3(found.normal1);
        let value = to_f64(found.dist) - skins(parts) + touch.depth;
        let stays_above =
            move |level: f64| facing.stays_above(level - touch.depth, axis, &frames, time);
        Some(Gap { value, stays_above })
    })
}

/// The work of a look at the gap between two parts.
fn work_of_look(parts: SweptPair<'_>) -> u64 {
    let pieces = parts.iter().any(|part| part.member.has_pieces());
    if pieces { LOOK_AT_PIECES } else { 1 }
}

/// The pose of the second part relative to the first at a moment, with the second moved by `back`.
pub(super) fn relative(parts: SweptPair<'_>, time: f64, back: DVec3) -> Pose {
    let [one, mut two] = parts.map(|part| part.frame(time));
    two.translation += back;
    relative_pose(&one, &two)
}

/// Parry's contact at a moment, in the frame of the first part, with the second moved by `back`; `None` if they are
/// farther apart than `near`.
pub(super) fn contact([a, b]: SweptPair<'_>, time: f64, near: f64, back: DVec3) -> Option<Contact> {
    let relative_to_first = relative([a, b], time, back);
    if !b.is_plane() || a.is_plane() {
        return contact_at([a, b], &relative_to_first, near);
    }
    // Parry applies the pose in the wrong direction if the half-space is second.
    let found = contact_at([b, a], &relative([b, a], time, -back), near)?;
    Some(Contact {
        point1: relative_to_first.transform_point(found.point2),
        point2: relative_to_first.transform_point(found.point1),
        normal1: relative_to_first.rotation * found.normal2,
        normal2: relative_to_first.rotation * found.normal1,
        ..found
    })
}

/// As [`contact`], for a pose of the second part relative to the first; a half-space must be the first.
fn contact_at([a, b]: SweptPair<'_>, relative: &Pose, near: f64) -> Option<Contact> {
    let near = from_f64(near);
    if !(near >= 0.0 && near.is_finite()) {
        return None;
    }
    let shapes = [&a.member.shape, &b.member.shape];
    let found = if a.is_plane() && shapes[1].as_support_map().is_none() {
        // The same happens for shapes made of pieces.
        Err(Unsupported)
    } else {
        nearest(shapes, relative, near)
    };
    found.unwrap_or_else(|_| {
        // For some shapes Parry has manifolds only.
        let points = manifold_points(shapes, relative, near);
        let points = points.iter().map(|point| point.placed(relative));
        let deepest = points.reduce(|a, b| if b.depth > a.depth { b } else { a })?;
        Some(Contact {
            point1: deepest.world_point,
            point2: deepest.world_point,
            normal1: deepest.world_normal,
            normal2: -(relative.rotation.inverse() * deepest.world_normal),
            dist: -deepest.depth,
            subshape1: 0,
            subshape2: 0,
        })
    })
}
