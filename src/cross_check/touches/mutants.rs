//! Tests that altered touches are reported: touches of parts that tumble and fall, at the time when Parry's distance
//! first vanishes.

use super::*;
use crate::math::{ColliderHandle, DQuat, Rotation, bisect, from_dpose3};
use crate::rapier::geometry::ColliderBuilder;
use crate::rigid::Rotor;

const DT: f64 = 0.1;

/// Two parts on their paths, their poses at both ends of the step, and their touch.
struct Scene {
    name: &'static str,
    colliders: [Collider; 2],
    record: TouchRecord,
    ends: [[Option<Pose>; 2]; 2],
}

fn colliders(scale: Real) -> [(&'static str, Collider); 3] {
    let corners = [
        [0.6, 0.1, 0.0],
        [-0.5, 0.45, 0.1],
        [-0.4, -0.55, 0.2],
        [0.1, 0.0, -0.6],
        [0.0, 0.15, 0.7],
        [0.3, -0.45, -0.2],
    ];
    let corners = corners.map(|at: [f64; 3]| Vector::from_array(at.map(from_f64)) * scale);
    let half = Vector::new(0.5, 0.4, 0.3) * scale;
    let hull = ColliderBuilder::convex_hull(&corners).expect("a hull");
    [
        ("balls", ColliderBuilder::ball(0.5 * scale).build()),
        (
            "cuboids",
            ColliderBuilder::cuboid(half.x, half.y, half.z).build(),
        ),
        ("hulls", hull.build()),
    ]
}

/// The path of a part at an arm on a body that tumbles and falls.
fn way(which: u32, number: f64) -> TouchWay {
    let side = f64::from(which);
    let rotor = Rotor {
        inverse_moments: DVec3::new(1.0, 0.6, 0.4),
        principal_to_body: DQuat::IDENTITY,
    };
    let attitude = DQuat::from_scaled_axis(DVec3::new(0.3, -0.2, 0.4) * (number + side));
    let angvel = DVec3::new(4.0 - number, 3.0 * (1.0 - 2.0 * side), 2.0 + 0.5 * number);
    let centre = DVec3::new(3.0 + 1.9 * side, 0.1 * number, 0.2 * side);
    let linvel = DVec3::new(6.0 - 20.0 * side, 0.5, -0.3 * number);
    let fall = DVec3::new(0.0, -9.81 * side, 1.0);
    let body = RigidBodyHandle::from_raw_parts(which, 0);
    let arm = DVec3::new(0.1, 0.2 - 0.3 * side, 0.15);
    TouchWay::tumbling(
        Some(body),
        [centre, linvel, fall],
        (rotor, attitude, angvel),
        arm,
        DT,
    )
}

impl Scene {
    /// `None` if the parts do not meet within the step.
    fn new(name: &'static str, collider: &Collider, number: f64) -> Option<Self> {
        let mut record = TouchRecord {
            colliders: [0, 1].map(|index| ColliderHandle::from_raw_parts(index, 0)),
            world_point: Vector::ZERO,
            world_normal: Vector::X,
            time: 0.0,
            ways: [way(0, number), way(1, number)],
        };
        let colliders = [collider.clone(), collider.clone()];
        let parts = Parts::new(&record, [&colliders[0], &colliders[1]]);
        let gap = |time| parts.gap(time, 5.0).expect("a distance");
        let steps = (0..2000).map(|step| DT * f64::from(step) / 2000.0);
        let after = steps.clone().find(|time| gap(*time) <= 0.0)?;
        let time = bisect([after - DT / 2000.0, after], 60, |time| gap(time) > 0.0);
        // The normal is taken a little before the touch, while it has hardly turned.
        let near = 1.5 * to_f64(Real::EPSILON).sqrt();
        let shapes = colliders.each_ref().map(|it| it.shape());
        let [one, two] = shapes;
        let relative = parts.relative(time - near, 0.0);
        let found = query::contact(&Pose::IDENTITY, one, &relative, two, 1.0);
        let found = found.expect("a contact").expect("a near one");
        let frame = record.ways[0].frame(time);
        let ends = [0, 1].map(|which: usize| {
            [0.0, DT].map(|time| Some(from_dpose3(&record.ways[which].frame(time))))
        });
        let relative = parts.relative(time, 0.0);
        let contact = query::contact(&Pose::IDENTITY, one, &relative, two, 1.0);
        let contact = contact.expect("a contact").expect("a touch");
        let point = frame.transform_point(to_dvec3(contact.point1));
        record.time = time;
        record.world_point = from_dvec3(point);
        record.world_normal = from_dvec3(frame.rotation * to_dvec3(found.normal1));
        Some(Scene {
            name,
            colliders,
            record,
            ends,
        })
    }

    fn judge(&self, record: &TouchRecord, colliders: [&Collider; 2]) -> Vec<&'static str> {
        let outcome = TouchJudge::new(DT).weigh(record, colliders, self.ends);
        let kind = |(difference, _): &(Difference, Real)| match difference {
            Difference::Gap { .. } => "gap",
            Difference::Late { .. } => "late",
            Difference::Normal { .. } => "normal",
            Difference::Point { .. } => "point",
            Difference::Way { .. } => "way",
            _ => "of Rapier",
        };
        println!("{}: {outcome:?}", self.name);
        outcome.differences.iter().map(kind).collect()
    }
}

fn scenes() -> Vec<Scene> {
    let numbers = (0..8).map(f64::from);
    let each = numbers.flat_map(|number| {
        let each = colliders(1.0).into_iter();
        each.filter_map(move |(name, collider)| Scene::new(name, &collider, number))
    });
    each.collect()
}

/// Fails unless each altered touch shows the expected difference.
#[track_caller]
fn assert_reported(expected: &str, alter: impl Fn(&mut TouchRecord)) {
    let scenes = scenes();
    assert!(scenes.len() >= 18, "{} meet", scenes.len());
    for scene in &scenes {
        let mut record = scene.record.clone();
        alter(&mut record);
        let found = scene.judge(&record, scene.colliders.each_ref());
        assert!(found.contains(&expected), "{}: {found:?}", scene.name);
    }
}

#[test]
fn a_correct_touch_is_not_reported() {
    for scene in scenes() {
        let found = scene.judge(&scene.record, scene.colliders.each_ref());
        assert!(found.is_empty(), "{}: {found:?}", scene.name);
    }
}

#[test]
fn a_time_that_is_wrong_by_a_hundredth_of_a_step_is_reported() {
    assert_reported("gap", |it| it.time += 0.01 * DT);
    assert_reported("gap", |it| it.time -= 0.01 * DT);
}

/// The gap may vanish once more, where the parts separate again.
#[test]
fn an_overlap_before_the_touch_is_found() {
    for scene in scenes() {
        let mut record = scene.record.clone();
        let time = record.time;
        record.time = DT;
        let parts = Parts::new(&record, scene.colliders.each_ref());
        let before = parts.gaps_before(0.0).expect("distances");
        let overlap = first_overlap(&before, from_f64(2.0 * parts.length));
        let (when, _) = overlap.expect("an overlap");
        assert!(when >= time - 1e-9, "{when} {time}");
    }
}

#[test]
fn a_part_that_is_a_hundredth_too_large_or_too_small_is_reported() {
    for scale in [1.01, 0.99] {
        let others = colliders(from_f64(scale));
        for scene in scenes() {
            let same = |(name, _): &&(&str, Collider)| *name == scene.name;
            let (_, other) = others.iter().find(same).expect("the same");
            let found = scene.judge(&scene.record, [other, &scene.colliders[1]]);
            assert!(found.contains(&"gap"), "{}: {found:?}", scene.name);
        }
    }
}

#[test]
fn a_normal_that_is_flipped_or_turned_by_five_degrees_is_reported() {
    assert_reported("normal", |it| it.world_normal = -it.world_normal);
    assert_reported("normal", |it| {
        let across = it.world_normal.any_orthonormal_vector();
        let turn = Rotation::from_axis_angle(across, (5.0 as Real).to_radians());
        it.world_normal = turn * it.world_normal;
    });
}

#[test]
fn a_point_that_is_moved_by_a_tenth_of_a_radius_is_reported() {
    assert_reported("point", |it| {
        let across = it.world_normal.any_orthonormal_vector();
        it.world_point += across * 0.05;
    });
    assert_reported("point", |it| it.world_point += it.world_normal * 0.05);
}

/// The touch fits the wrong path, but the path does not join the poses of the body.
#[test]
fn a_path_that_is_not_that_of_the_body_is_reported() {
    let altered: [fn(&mut TouchWay); 4] = [
        |way| way.shift(DVec3::X * 1e-3, DVec3::ZERO, DVec3::ZERO),
        |way| way.shift(DVec3::ZERO, DVec3::X * 0.06, DVec3::ZERO),
        |way| way.shift(DVec3::ZERO, DVec3::ZERO, DVec3::Y * 0.4),
        |way| way.straighten(),
    ];
    for alter in altered {
        assert_reported("way", |it| alter(&mut it.ways[1]));
    }
}

/// A path that begins with an impact must begin at the end of the previous path.
#[test]
fn a_path_that_leaps_at_an_impact_is_reported() {
    for scene in scenes() {
        let record = &scene.record;
        let half = 0.5 * record.time;
        let first = TouchRecord {
            time: half,
            ..record.clone()
        };
        for leap in [0.0, 1e-3] {
            let mut then = record.clone();
            then.ways = then.ways.map(|way| way.anew(half, DVec3::Y * leap));
            let mut judge = TouchJudge::new(DT);
            let colliders = scene.colliders.each_ref();
            judge.weigh(&first, colliders, scene.ends);
            let outcome = judge.weigh(&then, colliders, [[None; 2]; 2]);
            let is_way = |(it, _): &(Difference, Real)| matches!(it, Difference::Way { .. });
            let leaps = outcome.differences.iter().any(is_way);
            assert_eq!(leaps, leap > 0.0, "{}: {outcome:?}", scene.name);
        }
    }
}

#[test]
fn an_overlap_in_which_the_parts_begin_is_not_the_first_one() {
    let gaps = [
        (0.0, -0.5),
        (0.1, -0.01),
        (0.2, 0.3),
        (0.3, -0.1),
        (0.4, -0.2),
    ];
    assert_eq!(first_overlap(&gaps, 0.05), Some((0.3, 0.1)));
    assert_eq!(first_overlap(&gaps[1..], 0.005), Some((0.3, 0.1)));
    assert_eq!(first_overlap(&gaps[..3], 0.005), None);
}
