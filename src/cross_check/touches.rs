//! Touches within a step, judged by the gap: both parts are put where their paths have them at the time of the touch,
//! and Parry measures their distance there. No cast is needed, so it works for any path: bent, spinning or tumbling.
//!
//! - **Gap**: it should vanish at that time, and no earlier sample should show an overlap, except one in which the
//!   parts began.
//! - **Normal**: a part that is moved away along it should be nearest along it. Only true normals of the touch have
//!   this property; edges and corners have several.
//! - **Point**: it should lie on both surfaces.
//! - **Path**: it should carry the point from the body's pose before Rapier's step to its pose after it. A path that
//!   begins with an impact should begin where the previous path ended.
//!
//! The tolerance of a touch is a length: rounding in the parts' own frame, the gap that swept detection takes for a
//! touch and, for all but balls and cuboids, the error of Parry's search for their distance. A time may be
//! wrong by that length divided by the speed of approach.

#[cfg(test)]
mod mutants;

use std::collections::{HashMap, HashSet};

use super::bands::Sizes;
use super::counts::{TouchCounts, TouchesNotComparable};
use super::disagreement::Difference;
use super::report::CrossCheckReport;
use super::sighting::angle;
use crate::contact::{TouchRecord, TouchWay, has_voxels};
use crate::math::{
    ColliderHandle, DPose3, DVec3, Pose, Real, RigidBodyHandle, Vector, from_dvec3, from_f64,
    relative_pose, to_dpose3, to_dvec3, to_f64,
};
use crate::rapier::geometry::{Collider, Shape};
use crate::rapier::parry::query::{
    self, ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher, Unsupported,
};
use crate::rapier::parry::utils::PoseOpt;

/// Swept detection takes a gap of this number of units in the last place of the parts' size for a touch.
const TAKEN_TO_TOUCH: f64 = 32.0;
/// The same for places in world space, in 64 bits, and for the times at which they are reached.
const IN_THE_WORLD: f64 = 64.0;
/// The number of moments before a touch at which the gap is measured.
const SAMPLES: u32 = 16;

/// The result of judging one touch.
#[derive(Debug, Default)]
pub(super) struct TouchOutcome {
    pub differences: Vec<(Difference, Real)>,
    /// The touch as it counts for the report.
    pub counts: TouchCounts,
}

/// The counter in [`TouchesNotComparable`] of the reason why a touch cannot be judged.
type Reason = fn(&mut TouchesNotComparable) -> &mut u64;

/// The largest error of one kind in [`TouchCounts`].
type Largest = fn(&mut TouchCounts) -> &mut Real;

impl TouchOutcome {
    /// Records an error, and a difference if it exceeds its band.
    fn judge(&mut self, largest: Largest, [error, band]: [Real; 2], difference: Difference) {
        let largest = largest(&mut self.counts);
        *largest = largest.max(error);
        self.counts.worst = self.counts.worst.max(error / band);
        if error > band || error.is_nan() {
            self.differences.push((difference, band));
        }
    }
}

/// Judges the touches of a step, in the order of time.
pub(super) struct TouchJudge {
    dt: f64,
    /// For each body, the path up to its last touch, and the time of that touch.
    before: HashMap<RigidBodyHandle, (TouchWay, f64)>,
    met: HashSet<[ColliderHandle; 2]>,
}

impl TouchJudge {
    pub(super) fn new(dt: f64) -> Self {
        TouchJudge {
            dt,
            before: HashMap::new(),
            met: HashSet::new(),
        }
    }

    /// Judges the next touch. `ends` are, for each collider, its poses in Rapier's world when the step began and ended.
    pub(super) fn weigh(
        &mut self,
        record: &TouchRecord,
        colliders: [&Collider; 2],
        ends: [[Option<Pose>; 2]; 2],
    ) -> TouchOutcome {
        let parts = Parts::new(record, colliders);
        // A pair that touches again within a step counts as missed only once.
        let missed = self.met.insert(record.colliders) && !parts.overlap(self.dt);
        let mut outcome = TouchOutcome::default();
        let obstacle: Option<Reason> = match parts.judge(&mut outcome) {
            Ok(obstacle) => obstacle,
            Err(_) => Some(|it| &mut it.no_distance),
        };
        for (which, ends) in ends.into_iter().enumerate() {
            self.judge_way(&parts, which, ends, &mut outcome);
        }
        let TouchOutcome {
            differences,
            counts,
        } = &mut outcome;
        match obstacle {
            Some(reason) => {
                *counts = TouchCounts::default();
                *reason(&mut counts.not_comparable) = 1;
            }
            None if differences.is_empty() => counts.agreed = 1,
            None => counts.disagreed = 1,
        }
        counts.missed_by_sampling = u64::from(missed);
        outcome
    }

    /// Judges the beginning of a path and, if it is that of Rapier's step, its end.
    fn judge_way(
        &mut self,
        parts: &Parts<'_>,
        which: usize,
        ends: [Option<Pose>; 2],
        outcome: &mut TouchOutcome,
    ) {
        let (record, way) = (parts.record, &parts.record.ways[which]);
        // A ball has no visible rotation, so only its centre is compared.
        let round = parts.shapes[which].as_ball().is_some();
        let seen = |frame: DPose3| {
            let point = to_dvec3(record.world_point);
            let point = frame.inverse_transform_point(point);
            if round { DVec3::ZERO } else { point }
        };
        let local = seen(way.frame(record.time));
        let mut off = |time: f64, [ours, theirs]: [DVec3; 2]| {
            // Twice, for the place and for the attitude.
            let band = 2.0 * CrossCheckReport::band(from_dvec3(theirs), from_f64(parts.size));
            let error = from_f64(ours.distance(theirs));
            let difference = Difference::Way { time, error };
            outcome.judge(|it| &mut it.way_error, [error, band], difference);
        };
        if way.whole {
            for (time, pose) in [0.0, self.dt].into_iter().zip(ends) {
                let Some(pose) = pose else { continue };
                let ours = way.frame(time).transform_point(local);
                off(time, [ours, to_dpose3(&pose).transform_point(local)]);
            }
        }
        let Some(body) = way.body else { return };
        if let Some((before, ended)) = self.before.get(&body)
            && *ended == way.from()
        {
            let frame = way.body_frame(record.time);
            let local = frame.inverse_transform_point(way.frame(record.time) * local);
            let [theirs, ours] = [before, way].map(|it| it.body_frame(*ended) * local);
            off(*ended, [ours, theirs]);
        }
        self.before.insert(body, (way.clone(), record.time));
    }
}

/// Two parts on their paths.
struct Parts<'a> {
    record: &'a TouchRecord,
    shapes: [&'a dyn Shape; 2],
    /// The sum of the distances from the bodies' origins to the farthest points of the parts.
    size: f64,
    /// Rounding of the place of one part relative to the other.
    rounding: f64,
    /// A gap below this length counts as a touch.
    length: f64,
    /// The relative error of Parry's search for distances.
    search: f64,
    skins: [Real; 2],
}

/// The nearest points of two shapes.
struct NearestPoints {
    dist: Real,
    /// Unit vector from the first shape to the second, in the frame of the first.
    normal: Vector,
}

impl<'a> Parts<'a> {
    fn new(record: &'a TouchRecord, colliders: [&'a Collider; 2]) -> Self {
        let sizes = Sizes::of_colliders(colliders);
        let [size, own, search] = [
            sizes.reach + sizes.skins,
            sizes.own + sizes.skins,
            sizes.search(),
        ]
        .map(to_f64);
        let unit = to_f64(Real::EPSILON);
        // In the frame of the first part, so a large distance from the origin costs no precision.
        let rounding = to_f64(CrossCheckReport::band(Vector::ZERO, from_f64(own)));
        // Except that of 64 bits.
        let place = to_f64(record.world_point.length()) + size;
        let rounding = rounding + IN_THE_WORLD * f64::EPSILON * place;
        Parts {
            record,
            shapes: colliders.map(|it| it.shape()),
            size,
            rounding,
            length: rounding + TAKEN_TO_TOUCH * unit * size + search * own,
            search,
            skins: colliders.map(|it| it.contact_skin().max(0.0)),
        }
    }

    /// The pose of the second part relative to the first at a moment, with the second moved by `away` along the normal.
    fn relative(&self, time: f64, away: f64) -> Pose {
        let [one, mut two] = [0, 1].map(|which: usize| self.record.ways[which].frame(time));
        two.translation += to_dvec3(self.record.world_normal) * away;
        relative_pose(&one, &two)
    }

    /// Returns true if the parts overlap at a moment on their paths to the touch, as if it had not been answered.
    fn overlap(&self, time: f64) -> bool {
        // If Parry finds no distance, a miss is not proved.
        let apart = self.gap(time, 0.0);
        apart.map_or(true, |gap| gap <= 0.0)
    }

    /// The distance of the skins at a moment; `near` if it is larger.
    fn gap(&self, time: f64, near: f64) -> Result<Real, Unsupported> {
        let (near, skins) = (from_f64(near), self.skins[0] + self.skins[1]);
        let found = nearest(self.shapes, &self.relative(time, 0.0), near + skins)?;
        let apart = |found: NearestPoints| found.dist - skins;
        Ok(found.map_or(near.max(Real::MIN_POSITIVE), apart))
    }

    /// Judges all but the paths, or returns the reason why it cannot.
    fn judge(&self, outcome: &mut TouchOutcome) -> Result<Option<Reason>, Unsupported> {
        let TouchRecord {
            time,
            world_normal,
            world_point,
            ..
        } = *self.record;
        let length = from_f64(self.length);
        let gap = self.gap(time, self.size)?;
        let before = self.gaps_before(2.0 * self.length)?;
        if gap < -length && before.iter().all(|(_, gap)| *gap <= length) {
            // Parts that have overlapped all the way have no time of touch.
            return Ok(Some(|it| &mut it.overlapping));
        }
        let difference = Difference::Gap { time, gap };
        outcome.judge(|it| &mut it.gap_error, [gap.abs(), length], difference);
        if let Some((earlier, depth)) = first_overlap(&before, 2.0 * length) {
            let difference = Difference::Late {
                time,
                earlier,
                depth,
            };
            outcome.differences.push((difference, 2.0 * length));
        }
        self.judge_normal(world_normal, outcome)?;
        let far = CrossCheckReport::band(world_point, length);
        for (which, way) in self.record.ways.iter().enumerate() {
            let (shape, skin) = (self.shapes[which], self.skins[which]);
            let frame = way.frame(time);
            let local = from_dvec3(frame.inverse_transform_point(to_dvec3(world_point)));
            let surface = shape.project_local_point(local, false).point;
            let difference = Difference::Point {
                field: world_point,
                rapier: from_dvec3(frame.transform_point(to_dvec3(surface))),
            };
            let error = (local.distance(surface) - skin).abs();
            outcome.judge(|it| &mut it.point_error, [error, length + far], difference);
        }
        Ok(None)
    }

    /// The distances of the skins at moments from the beginning of the paths until shortly before the touch.
    fn gaps_before(&self, near: f64) -> Result<Vec<(f64, Real)>, Unsupported> {
        let (from, to) = (self.record.from(), self.record.time);
        let moments =
            (0..SAMPLES).map(|it| from + (to - from) * (f64::from(it) / f64::from(SAMPLES)));
        moments
            .map(|time| Ok((time, self.gap(time, near)?)))
            .collect()
    }

    fn judge_normal(&self, normal: Vector, outcome: &mut TouchOutcome) -> Result<(), Unsupported> {
        let away = (self.length * self.size).sqrt();
        let relative = self.relative(self.record.time, away);
        let near = from_f64(self.size) + self.skins[0] + self.skins[1];
        let found = nearest(self.shapes, &relative, near)?;
        let mut normals: Vec<Vector> = found.iter().map(|found| found.normal).collect();
        if !self.shapes.iter().all(|shape| shape.is_convex()) {
            // There may be another place where they touch.
            let relative = self.relative(self.record.time, 0.0);
            let near = from_f64(2.0 * self.length) + self.skins[0] + self.skins[1];
            let touching = manifolds(self.shapes, &relative, near)?;
            normals.extend(touching.iter().map(|it| it.normal));
        }
        let to_world = self.record.ways[0].frame(self.record.time).rotation;
        let normals = normals
            .iter()
            .map(|it| from_dvec3(to_world * to_dvec3(*it)));
        let turned = |other: &Vector| angle(normal, *other);
        let theirs = normals.min_by(|a, b| turned(a).total_cmp(&turned(b)));
        let theirs = theirs.unwrap_or(Vector::ZERO);
        let unit = to_f64(Real::EPSILON);
        let band = self.rounding / away + TAKEN_TO_TOUCH * unit.sqrt() + (2.0 * self.search).sqrt();
        let difference = Difference::Normal {
            field: normal,
            rapier: theirs,
        };
        let error = turned(&theirs);
        outcome.judge(
            |it| &mut it.normal_error,
            [error, from_f64(band)],
            difference,
        );
        Ok(())
    }
}

/// The first time at which the parts overlap by more than `depth`, and that overlap; an initial overlap is skipped.
fn first_overlap(gaps: &[(f64, Real)], depth: Real) -> Option<(f64, Real)> {
    let mut later = gaps.iter().skip_while(|(_, gap)| *gap < -depth);
    let overlap = later.find(|(_, gap)| *gap < -depth)?;
    Some((overlap.0, -overlap.1))
}

/// The nearest points of two shapes, or `None` if they are farther apart than `near`. `relative` is the pose of the
/// second relative to the first.
fn nearest(
    shapes: [&dyn Shape; 2],
    relative: &Pose,
    near: Real,
) -> Result<Option<NearestPoints>, Unsupported> {
    let [one, two] = shapes;
    let is_plane = |shape: &dyn Shape| shape.as_halfspace().is_some();
    if is_plane(two) && !is_plane(one) {
        // Parry applies the pose in the wrong direction if the half-space is second.
        let found = nearest([two, one], &relative.inverse(), near)?;
        return Ok(found.map(|found| NearestPoints {
            normal: relative.rotation * -found.normal,
            ..found
        }));
    }
    // The same happens for shapes made of pieces; and inside these, Parry treats shapes that it does not support as far
    // away.
    let unknown =
        shapes.into_iter().any(has_voxels) || is_plane(one) && two.as_composite_shape().is_some();
    if unknown {
        let found = manifolds(shapes, relative, near)?.into_iter();
        return Ok(found.min_by(|a, b| a.dist.total_cmp(&b.dist)));
    }
    let found = query::contact(&Pose::IDENTITY, one, relative, two, near)?;
    Ok(found.map(|found| NearestPoints {
        dist: found.dist,
        normal: found.normal1,
    }))
}

/// The points of Parry's manifolds at which two shapes are nearer than `near`.
fn manifolds(
    [one, two]: [&dyn Shape; 2],
    relative: &Pose,
    near: Real,
) -> Result<Vec<NearestPoints>, Unsupported> {
    let mut found: Vec<ContactManifold<(), ()>> = Vec::new();
    DefaultQueryDispatcher.contact_manifolds(relative, one, two, near, &mut found, &mut None)?;
    let all = found.iter().flat_map(|manifold| {
        let one = manifold.subshape_pos1().prepend_to(&Pose::IDENTITY);
        let normal = one.rotation * manifold.local_n1;
        manifold.points.iter().map(move |point| NearestPoints {
            dist: point.dist,
            normal,
        })
    });
    Ok(all.filter(|point| point.dist <= near).collect())
}
