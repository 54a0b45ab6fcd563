//! Touches within a step beside an independent time of impact: Parry's cast of two shapes that
//! move and turn steadily.
//!
//! How much the times may differ: a touch is told from a gap by a length, so a time by that length
//! over the speed of approach. The length is that of rounding in the parts' own frame (the cast is
//! made there), the gap at which swept detection takes shapes to touch, and that at which the cast
//! does, which for all but balls are no better than Parry's search for their distance. To this come the cast's own steps of time: it ends when one is shorter than ten units in
//! the last place, of a step here. It may end early, where its axis turns from step to step: a time
//! at which the parts are still apart by more than the length is none. Where the gap's second derivative could keep the parts apart by
//! that length, the touch is a graze, and is not judged.

use super::bands::Sizes;
use super::counts::{TouchCounts, TouchesNotComparable};
use super::disagreement::Difference;
use super::report::CrossCheckReport;
use crate::contact::{TouchRecord, Way};
use crate::math::{DPose3, DVec3, Pose, Real, Rotation, Vector, from_dvec3, from_f64, to_f64};
use crate::rapier::geometry::Collider;
use crate::rapier::parry::query::{self, NonlinearRigidMotion, ShapeCastHit, ShapeCastStatus};
use crate::rigid::Lookup;

/// Units in the last place of the size of the parts at which swept detection, and the cast, take
/// what is closer to touch.
const TAKEN_TO_TOUCH: f64 = 32.0;
const CAST: f64 = 10.0;
/// A way bent by less than this many half units in the last place of its length is straight.
const STRAIGHT: f64 = 32.0;

/// What came of a comparison.
#[derive(Debug)]
pub(super) struct Outcome {
    judged: Result<Judged, Reason>,
    missed_by_sampling: bool,
}

/// Why a touch cannot be compared.
type Reason = fn(&mut TouchesNotComparable) -> &mut u64;

#[derive(Debug)]
struct Judged {
    /// The time by the cast, if it finds a touch.
    cast: Option<f64>,
    /// The difference, as a share of the step.
    error: Option<f64>,
    /// How much it may be, a time.
    band: f64,
    agrees: bool,
}

impl Outcome {
    pub(super) fn count(&self, counts: &mut TouchCounts) {
        counts.missed_by_sampling += u64::from(self.missed_by_sampling);
        match &self.judged {
            Err(reason) => *reason(&mut counts.not_comparable) += 1,
            Ok(judged) => {
                counts.agreed += u64::from(judged.agrees);
                counts.disagreed += u64::from(!judged.agrees);
                let error = from_f64(judged.error.unwrap_or(0.0));
                counts.time_error = counts.time_error.max(error);
            }
        }
    }

    /// What differs, with its band.
    pub(super) fn difference(&self, record: &TouchRecord) -> Option<(Difference, Real)> {
        let judged = self.judged.as_ref().ok().filter(|judged| !judged.agrees)?;
        let difference = Difference::Time {
            field: record.time,
            cast: judged.cast,
        };
        Some((difference, from_f64(judged.band)))
    }
}

/// Compares a touch with a cast; `None` if a collider is gone.
pub(super) fn weigh(record: &TouchRecord, world: &impl Lookup, dt: f64) -> Option<Outcome> {
    let [one, two] = record.colliders.map(|handle| world.collider(handle));
    let colliders = [one?, two?];
    Some(Outcome {
        judged: judge(record, colliders, dt),
        // Who comes back within a step is another touch, of the same pair that sampling missed.
        missed_by_sampling: !record.again && !overlap_at_end(record, colliders),
    })
}

fn judge(record: &TouchRecord, colliders: [&Collider; 2], dt: f64) -> Result<Judged, Reason> {
    let [length, band] = bands(record, colliders, dt)?;
    let motions = motions(record, dt);
    let shapes = colliders.map(|collider| &*collider.shared_shape().0);
    let share = |time: f64| from_f64((time - record.from) / dt);
    let gap = |share: Real| {
        let [one, two] = [&motions[0], &motions[1]].map(|it| it.position_at_time(share));
        let near = from_f64(4.0 * length);
        let contact = query::contact(&one, shapes[0], &two, shapes[1], near);
        let found = contact.ok().flatten();
        found.map_or(f64::INFINITY, |contact| to_f64(contact.dist))
    };
    let [one, two] = &motions;
    let hit = query::cast_shapes_nonlinear(one, shapes[0], two, shapes[1], 0.0, share(dt), true);
    let hit = hit.map_err(|_| no_cast as Reason)?;
    let inside = |hit: &ShapeCastHit| hit.status == ShapeCastStatus::PenetratingOrWithinTargetDist;
    if record.time <= record.from + band && gap(0.0) <= 2.0 * length {
        return Err(|it| &mut it.graze);
    }
    let at_first = hit.as_ref().is_some_and(inside) || gap(0.0) <= length;
    if at_first && record.time > record.from + band {
        return Err(|it| &mut it.overlapping);
    }
    let field = share(record.time);
    let settled = hit.filter(|hit| gap(hit.time_of_impact) <= length);
    let Some(hit) = settled else {
        // If they touch, the cast has missed it or not come to it.
        return match gap(field) <= 2.0 * length {
            true => Err(|it| &mut it.unsettled),
            false => Ok(Judged::new(None, record, [band, dt])),
        };
    };
    let cast = record.from + to_f64(hit.time_of_impact) * dt;
    let judged = Judged::new(Some(cast), record, [band, dt]);
    // Parts that stay in touch from one time to the other, no deeper than rounding, first graze.
    let between = (hit.time_of_impact + field) * 0.5;
    let grazes = |share| gap(share).abs() <= 2.0 * length;
    if !judged.agrees && grazes(between) && grazes(field) {
        return Err(|it| &mut it.graze);
    }
    Ok(judged)
}

impl Judged {
    fn new(cast: Option<f64>, record: &TouchRecord, [band, dt]: [f64; 2]) -> Self {
        let error = cast.map(|cast| (cast - record.time).abs());
        Judged {
            cast,
            error: error.map(|error| error / dt),
            band,
            agrees: error.is_some_and(|error| error <= band),
        }
    }
}

fn no_cast(counts: &mut TouchesNotComparable) -> &mut u64 {
    &mut counts.no_cast
}

/// Whether the parts overlap where their ways end, as if nothing had answered them.
fn overlap_at_end(record: &TouchRecord, colliders: [&Collider; 2]) -> bool {
    let [one, two] = [0, 1].map(|which: usize| record.ways[which].end);
    let relative = rounded(&one.inverse(), &two);
    let [a, b] = colliders.map(|collider| &*collider.shared_shape().0);
    let skins = colliders[0].contact_skin() + colliders[1].contact_skin();
    let apart = query::distance(&Pose::IDENTITY, a, &relative, b);
    // What Parry cannot tell was not shown to be missed.
    !apart.is_ok_and(|apart| apart.distance > skins)
}

/// The product of two poses, rounded.
fn rounded(one: &DPose3, two: &DPose3) -> Pose {
    let product = *one * *two;
    let [x, y, z, w] = product.rotation.to_array().map(from_f64);
    let rotation = Rotation::from_xyzw(x, y, z, w).normalize();
    Pose::from_parts(from_dvec3(product.translation), rotation)
}

/// The length that is not told from a touch, and how much times may differ by it; or why the cast
/// could not tell.
fn bands(record: &TouchRecord, colliders: [&Collider; 2], dt: f64) -> Result<[f64; 2], Reason> {
    let bend = |way: &Way| 0.5 * way.acceleration.length() * dt * dt > rounding_of(way, dt);
    if record.again {
        return Err(|it| &mut it.again);
    }
    if colliders.iter().any(|it| it.contact_skin() > 0.0) {
        return Err(no_cast);
    }
    if record.ways.iter().any(|way| way.angvel.is_none()) {
        return Err(|it| &mut it.tumbling);
    }
    if record.ways.iter().any(bend) {
        return Err(|it| &mut it.bent);
    }
    let sizes = Sizes::of_colliders(colliders);
    let size = to_f64(sizes.own());
    let way: f64 = record.ways.iter().map(|way| way.linvel.length() * dt).sum();
    let unit = to_f64(Real::EPSILON);
    // In the frame of the first part: what is far from the origin costs nothing.
    let rounding = to_f64(CrossCheckReport::band(Vector::ZERO, from_f64(size + way)));
    let search = to_f64(sizes.search()) * size;
    let length = rounding + search + TAKEN_TO_TOUCH * unit * size + CAST * unit * size.max(1.0);
    let turns = record.ways.iter().filter_map(|way| way.angvel);
    let bend: f64 = turns.map(|angvel| angvel.length_squared() * size).sum();
    let speed = record.approach_speed.max(0.0);
    let inside = speed * speed - 2.0 * bend * length;
    let late = 2.0 * length / (speed + inside.max(0.0).sqrt());
    let band = late + 2.0 * CAST * unit * dt;
    // Else rounding decides whether they touch in this step.
    if inside > 0.0 && band < dt - record.time {
        Ok([length, band])
    } else {
        Err(|it| &mut it.graze)
    }
}

fn rounding_of(way: &Way, dt: f64) -> f64 {
    let unit = 0.5 * to_f64(Real::EPSILON);
    STRAIGHT * unit * (way.start.translation.length() + way.linvel.length() * dt)
}

/// The motions of both parts about the place where the first begins, in units of the step.
fn motions(record: &TouchRecord, dt: f64) -> [NonlinearRigidMotion; 2] {
    let origin = record.ways[0].start.translation;
    [0, 1].map(|which: usize| {
        let way = &record.ways[which];
        let start = DPose3::from_parts(way.start.translation - origin, way.start.rotation);
        NonlinearRigidMotion {
            local_center: from_dvec3(start.inverse_transform_point(way.centre - origin)),
            start: rounded(&start, &DPose3::IDENTITY),
            linvel: from_dvec3(way.linvel * dt),
            angvel: from_dvec3(way.angvel.unwrap_or(DVec3::ZERO) * dt),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{ColliderHandle, DQuat};
    use crate::rapier::geometry::ColliderBuilder;

    /// Two parts that meet head-on after 0.6 of a step.
    fn head_on(shape: &Collider, turning: Option<DVec3>) -> (TouchRecord, f64) {
        let way = |x: f64, speed: f64, angvel| {
            let start = DPose3::from_parts(DVec3::new(x, 0.0, 0.0), DQuat::IDENTITY);
            let end = DVec3::new(x + speed * 0.1, 0.0, 0.0);
            Way {
                start,
                end: DPose3::from_parts(end, DQuat::IDENTITY),
                centre: start.translation,
                linvel: DVec3::new(speed, 0.0, 0.0),
                acceleration: DVec3::ZERO,
                angvel,
            }
        };
        let half = to_f64(shape.compute_aabb().half_extents().x);
        let apart = 2.0 * half + 0.6;
        let record = TouchRecord {
            colliders: [0, 1].map(|index| ColliderHandle::from_raw_parts(index, 0)),
            world_point: from_dvec3(DVec3::new(half, 0.0, 0.0)),
            time: 0.06,
            from: 0.0,
            approach_speed: 10.0,
            ways: [way(0.0, 7.0, Some(DVec3::ZERO)), way(apart, -3.0, turning)],
            again: false,
        };
        (record, 0.1)
    }

    fn shapes() -> [Collider; 3] {
        let corners = to_corners();
        let hull = ColliderBuilder::convex_hull(&corners).expect("a hull");
        [
            ColliderBuilder::ball(0.5).build(),
            ColliderBuilder::cuboid(0.5, 0.3, 0.4).build(),
            hull.build(),
        ]
    }

    fn to_corners() -> Vec<Vector> {
        let signs = [-1.0, 1.0];
        let all = signs.iter().flat_map(|x| signs.map(|y| (*x, y)));
        let all = all.flat_map(|(x, y)| signs.map(|z| Vector::new(x * 0.5, y * 0.3, z * 0.2)));
        all.collect()
    }

    fn judged(record: &TouchRecord, shape: &Collider, dt: f64) -> Option<bool> {
        let judged = judge(record, [shape, shape], dt).ok();
        judged.map(|judged| judged.agrees)
    }

    #[test]
    fn the_right_time_agrees_and_a_wrong_one_does_not() {
        for shape in shapes() {
            let (record, dt) = head_on(&shape, Some(DVec3::ZERO));
            assert_eq!(judged(&record, &shape, dt), Some(true), "{shape:?}");
            for wrong in [0.0606, 0.0594, 0.0] {
                let late = TouchRecord {
                    time: wrong,
                    ..record.clone()
                };
                assert_eq!(judged(&late, &shape, dt), Some(false), "{wrong}");
            }
        }
    }

    #[test]
    fn a_touch_that_is_not_there_is_a_disagreement() {
        for shape in shapes() {
            let (mut record, dt) = head_on(&shape, Some(DVec3::ZERO));
            record.ways[1].start.translation.y = 3.0;
            record.ways[1].centre.y = 3.0;
            assert_eq!(judged(&record, &shape, dt), Some(false));
        }
    }

    #[test]
    fn what_tumbles_is_bent_or_grazes_is_not_judged() {
        for shape in shapes() {
            let (tumbling, dt) = head_on(&shape, None);
            assert_eq!(judged(&tumbling, &shape, dt), None);
            let (mut bent, _) = head_on(&shape, Some(DVec3::ZERO));
            bent.ways[0].acceleration = DVec3::Y;
            assert_eq!(judged(&bent, &shape, dt), None);
            let (mut again, _) = head_on(&shape, Some(DVec3::ZERO));
            again.again = true;
            assert_eq!(judged(&again, &shape, dt), None);
            let (mut graze, _) = head_on(&shape, Some(DVec3::ZERO));
            graze.approach_speed = 1e-18;
            assert_eq!(judged(&graze, &shape, dt), None);
        }
    }

    #[test]
    fn what_passes_through_within_the_step_is_missed_by_sampling() {
        for shape in shapes() {
            let colliders = [&shape, &shape];
            let (mut record, _) = head_on(&shape, Some(DVec3::ZERO));
            assert!(overlap_at_end(&record, colliders));
            record.ways[1].end.translation.x = -3.0;
            assert!(!overlap_at_end(&record, colliders));
            let place = record.ways[0].end.translation;
            record.ways[1].end.translation = place;
            assert!(overlap_at_end(&record, colliders), "one in the other");
        }
    }
}
