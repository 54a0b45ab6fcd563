//! The time and the points of the first touch of two parts on their paths.

use std::cell::Cell;

use super::conservative_advancement::{GapBound, first_touch, first_touch_of_distance};
use super::overlap::{distance, manifold_points, nearest};
use super::separation::Separations;
use super::solve::ContactPoint;
use super::swept_body::SweptBody;
use super::swept_parts::{Form, SweptPart};
use crate::math::{DPose3, DVec3, Pose, Real, from_f64, relative_pose, to_dvec3, to_f64};
use crate::rapier::geometry::Aabb;
use crate::rapier::parry::bounding_volume::BoundingVolume;
use crate::rapier::parry::query::{Contact, Unsupported};

/// A gap below this share of the coordinates, some roundings in 64 bits, counts as touching.
const EXACT: f64 = 16.0 * f64::EPSILON;

/// The work of a look at a shape made of pieces, such as a mesh.
const LOOK_AT_PIECES: u64 = 16;

/// A part of a body, on the body's path.
#[derive(Clone, Copy)]
pub(super) struct MovingShape<'a> {
    pub track: &'a SweptBody,
    pub member: &'a SweptPart,
}

/// Two parts that may touch.
type SweptPair<'a> = [MovingShape<'a>; 2];

impl MovingShape<'_> {
    /// The pose of the collider's frame, in world space.
    fn frame(&self, time: f64) -> DPose3 {
        let (arm, own) = (self.member.arm, self.member.rotation);
        self.track.path.frame(time, arm, own)
    }

    /// The vector from the centre of mass to the collider's frame, and its velocity relative to the centre.
    fn arm(&self, time: f64) -> [DVec3; 2] {
        if self.member.arm == DVec3::ZERO {
            return [DVec3::ZERO; 2];
        }
        let attitude = self.track.path.attitude(time);
        let arm = attitude * self.member.arm;
        [arm, self.track.path.angvel(time, attitude).cross(arm)]
    }

    /// The origin of the collider's frame, in world space.
    pub(super) fn place(&self, time: f64) -> DVec3 {
        self.track.path.com(time) + self.arm(time)[0]
    }

    /// Returns true if it stands still outside of `bounds`, for example a wall of a body that has several.
    pub(super) fn stands_clear_of(&self, bounds: &Aabb) -> bool {
        let own = self.member.bounds.filter(|_| self.track.is_still());
        // A half-space has no bounds.
        own.is_some_and(|own| self.member.reach.is_finite() && !own.intersects(bounds))
    }

    fn turns(&self) -> bool {
        self.track.path.bounds().angvel > 0.0
    }

    fn is_plane(&self) -> bool {
        matches!(self.member.form, Form::Plane { .. })
    }

    fn is_solid(&self) -> bool {
        matches!(self.member.form, Form::Other)
    }

    /// An upper bound of the distance of its points from the centre of mass; of the distance of its frame for a
    /// half-space.
    fn size(&self) -> f64 {
        self.member.arm.length() + self.member.finite_reach()
    }

    /// An upper bound of the distance from the centre of mass at which rotation moves its surface.
    fn swinging(&self) -> f64 {
        match self.member.form {
            Form::Ball { .. } => self.member.arm.length(),
            Form::Plane { .. } | Form::Other => self.size(),
        }
    }

    /// An upper bound of the way of its surface by rotation in Rapier's step, from the angular speeds before and after.
    pub(super) fn swing_in(&self, dt: f64) -> f64 {
        self.track.spin * self.swinging() * dt
    }
}

/// The first moment in `span` at which two parts overlap by `depth` and approach. Adds its work to `looks`.
pub(super) fn time_of_impact(
    [a, b]: SweptPair<'_>,
    depth: f64,
    span: [f64; 2],
    looks: &Cell<u64>,
) -> Option<f64> {
    match [a.member.form, b.member.form] {
        [Form::Ball { radius: r }, Form::Ball { radius: s }] => balls([a, b], r + s - depth, span),
        [Form::Plane { normal }, Form::Ball { radius }] if !a.turns() => {
            plane([a, b], normal, radius - depth, span)
        }
        [Form::Ball { radius }, Form::Plane { normal }] if !b.turns() => {
            plane([b, a], normal, radius - depth, span)
        }
        _ => shapes([a, b], depth, span, looks),
    }
}

/// The relative motion of two centres of mass over a span, with velocity and acceleration at its start. `pull` is an
/// upper bound of the acceleration.
struct Approach {
    from: f64,
    velocity: DVec3,
    acceleration: DVec3,
    jerk: DVec3,
    pull: f64,
}

impl Approach {
    fn new([a, b]: SweptPair<'_>, [from, to]: [f64; 2]) -> Self {
        let (one, two) = (&a.track.path, &b.track.path);
        let acceleration = two.acceleration(from) - one.acceleration(from);
        let jerk = two.jerk - one.jerk;
        let last = acceleration + jerk * (to - from);
        Approach {
            from,
            velocity: two.velocity(from) - one.velocity(from),
            acceleration,
            jerk,
            pull: acceleration.length().max(last.length()),
        }
    }

    fn velocity(&self, time: f64) -> DVec3 {
        let since = time - self.from;
        self.velocity + (self.acceleration + self.jerk * (0.5 * since)) * since
    }

    /// An upper bound of the speed over a duration.
    fn fastest(&self, duration: f64) -> f64 {
        self.velocity.length() + self.pull * duration
    }
}

/// Two balls. The value is the square of the distance minus that of `reach`, which is smooth even at equal centres.
fn balls([a, b]: SweptPair<'_>, reach: f64, span: [f64; 2]) -> Option<f64> {
    let (one, two) = (&a.track.path, &b.track.path);
    let approach = Approach::new([a, b], span);
    let (turn_a, turn_b) = (one.bounds(), two.bounds());
    let [arm_a, arm_b] = [a, b].map(|part| part.member.arm.length());
    let swing = turn_a.angvel * arm_a + turn_b.angvel * arm_b;
    let pull = approach.pull;
    let bend = turn_a.acceleration * arm_a + turn_b.acceleration * arm_b + pull;
    // An early exit for pairs that cannot meet in the span, which are most.
    let apart = (b.place(span[0]) - a.place(span[0])).length();
    let duration = span[1] - span[0];
    if apart - reach > (approach.fastest(duration) + swing) * duration {
        return None;
    }
    let scale = one.com.length() + two.com.length() + arm_a + arm_b + reach;
    let tolerance = EXACT * scale * 2.0 * reach;
    first_touch(span, tolerance, |time| {
        let ([at_a, swing_a], [at_b, swing_b]) = (a.arm(time), b.arm(time));
        let between = (two.com(time) - one.com(time)) + (at_b - at_a);
        let closing = approach.velocity(time);
        let rate = closing + (swing_b - swing_a);
        let distance = between.length();
        let left = span[1] - time;
        let farthest = distance + (closing.length() + pull * left + swing) * left;
        let slowest = (rate.length() - bend * left).max(0.0);
        GapBound {
            value: (distance - reach) * (distance + reach),
            slope: 2.0 * between.dot(rate),
            curvature: (2.0 * (farthest * bend - slowest * slowest)).max(0.0),
        }
    })
}

/// A half-space that does not rotate, and a ball.
fn plane([a, b]: SweptPair<'_>, normal: DVec3, radius: f64, span: [f64; 2]) -> Option<f64> {
    let normal = a.track.path.attitude(span[0]) * normal;
    let radius = radius + a.member.skin;
    let path = &b.track.path;
    let approach = Approach::new([a, b], span);
    let arm = b.member.arm.length();
    let bend = path.bounds().acceleration * arm + approach.pull;
    // An early exit for balls that cannot reach the half-space in the span, which are most.
    let gap = (b.place(span[0]) - a.place(span[0])).dot(normal) - radius;
    let duration = span[1] - span[0];
    if gap > (approach.fastest(duration) + path.bounds().angvel * arm) * duration {
        return None;
    }
    let scale = path.com.length() + a.place(span[0]).length() + arm + radius;
    first_touch(span, EXACT * scale, |time| {
        let [at, swing] = b.arm(time);
        GapBound {
            value: (path.com(time) + at - a.place(time)).dot(normal) - radius,
            slope: (approach.velocity(time) + swing).dot(normal),
            curvature: bend,
        }
    })
}

/// Returns true if two parts may touch in `span`, by the distance kept for the pair. Distances are kept only for pairs
/// of which [`time_of_impact`] needs Parry's distance.
pub(super) fn may_touch([a, b]: SweptPair<'_>, span: [f64; 2], known: &mut Separations) -> bool {
    if !a.is_solid() && !b.is_solid() {
        return true;
    }
    // A shape without bounds goes first, because even a small rotation moves some of its points far.
    let [a, b] = if b.is_plane() { [b, a] } else { [a, b] };
    let pair = [a, b].map(|part| part.member.part.collider);
    let shapes = [&a.member.shape, &b.member.shape];
    let relative = relative([a, b], span[0], DVec3::ZERO);
    let near = within_reach([a, b], span).near;
    let measure = |reach: Real| {
        let far = near + 0.25 * to_f64(reach);
        if a.is_solid() && b.is_solid() {
            return distance(shapes, &relative, from_f64(far));
        }
        let found = contact([a, b], span[0], far, DVec3::ZERO);
        Some(found.map_or(from_f64(far), |contact| contact.dist))
    };
    !known.are_apart(pair, shapes, &relative, from_f64(near), measure)
}

/// An upper bound of the speed at which two points of the parts approach in `span`.
pub(super) fn fastest_approach([a, b]: SweptPair<'_>, span: [f64; 2]) -> f64 {
    let swing = |part: MovingShape<'_>| part.track.path.bounds().angvel * part.swinging();
    let approach = Approach::new([a, b], span);
    approach.fastest(span[1] - span[0]) + swing(a) + swing(b)
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
    /// A smaller gap counts as touching.
    tolerance: f64,
    near: f64,
}

fn within_reach([a, b]: SweptPair<'_>, span: [f64; 2]) -> WithinReach {
    let speed = fastest_approach([a, b], span);
    let tolerance = 32.0 * to_f64(Real::EPSILON) * (a.size() + b.size());
    WithinReach {
        speed,
        tolerance,
        near: speed * (span[1] - span[0]) * 1.01 + tolerance + skins([a, b]),
    }
}

/// Any two shapes, by Parry's distance in [`Real`].
fn shapes(parts: SweptPair<'_>, depth: f64, span: [f64; 2], looks: &Cell<u64>) -> Option<f64> {
    let WithinReach {
        speed,
        tolerance,
        near,
    } = within_reach(parts, span);
    let look = work_of_look(parts);
    let [a, b] = parts.map(|part| part.member.thickness);
    let thin = 0.5 * a.min(b);
    first_touch_of_distance(span, tolerance, speed, thin, |time| {
        looks.set(looks.get() + look);
        let dist = contact(parts, time, near, DVec3::ZERO)?.dist;
        Some(to_f64(dist) - skins(parts) + depth)
    })
}

/// The work of a look at the gap between two parts.
fn work_of_look(parts: SweptPair<'_>) -> u64 {
    let pieces = parts.iter().any(|part| part.member.has_pieces());
    if pieces { LOOK_AT_PIECES } else { 1 }
}

/// The sum of the skins of two parts.
fn skins([a, b]: SweptPair<'_>) -> f64 {
    a.member.skin + b.member.skin
}

/// The offset, along the normal, from the middle between two surfaces to that between their skins.
fn between_skins([a, b]: SweptPair<'_>) -> f64 {
    0.5 * (a.member.skin - b.member.skin)
}

/// The pose of the second part relative to the first at a moment, with the second moved by `back`.
fn relative(parts: SweptPair<'_>, time: f64, back: DVec3) -> Pose {
    let [one, mut two] = parts.map(|part| part.frame(time));
    two.translation += back;
    relative_pose(&one, &two)
}

/// Parry's contact at a moment, in the frame of the first part, with the second moved by `back`; `None` if they are
/// farther apart than `near`.
fn contact([a, b]: SweptPair<'_>, time: f64, near: f64, back: DVec3) -> Option<Contact> {
    let relative = relative([a, b], time, back);
    let near = from_f64(near);
    if !(near >= 0.0 && near.is_finite()) {
        return None;
    }
    if b.is_plane() && !a.is_plane() {
        // Parry applies the pose in the wrong direction if the half-space is second.
        let found = contact([b, a], time, to_f64(near), -back)?;
        return Some(Contact {
            point1: relative.transform_point(found.point2),
            point2: relative.transform_point(found.point1),
            normal1: relative.rotation * found.normal2,
            normal2: relative.rotation * found.normal1,
            ..found
        });
    }
    let shapes = [&a.member.shape, &b.member.shape];
    let found = if a.is_plane() && shapes[1].as_support_map().is_none() {
        // The same happens for shapes made of pieces.
        Err(Unsupported)
    } else {
        nearest(shapes, &relative, near)
    };
    found.unwrap_or_else(|_| {
        // For some shapes Parry has manifolds only.
        let points = manifold_points(shapes, &relative, near);
        let points = points.iter().map(|point| point.placed(&relative));
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
