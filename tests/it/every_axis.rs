//! Regions over each axis, with and without groups, under every sampling.
//!
//! For the expected wrench, coordinates of samples follow the definitions of the axes, and `Reference` for the law
//! alone is summed over the samples inside; where bodies are cut at a border, over the shares of boxes.

use std::f64::consts::FRAC_PI_2;

use rapier3d_fields::field::Query;
use rapier3d_fields::math::{
    DQuat, DVec3, Rotation, from_dvec3, from_f64, to_dpose3, to_dvec3, to_f64,
};
use rapier3d_fields::pipeline::BodySample;
use rapier3d_fields::prelude::*;

use crate::support::{assert_at_most, build, weightless};

use super::each_collider::{
    IRON, SAMPLINGS, agree, dumbbell, fields, groups, kind, laws, literal, only_iron, within,
};

/// The axes, with the index of those that are coordinates in space.
const AXES: [(&str, Option<usize>); 16] = [
    ("x", Some(0)),
    ("y", Some(1)),
    ("z", Some(2)),
    ("time", None),
    ("speed", None),
    ("vx", None),
    ("vy", None),
    ("vz", None),
    ("distance", None),
    ("closing_speed", None),
    ("time_to_closest", None),
    ("closest_distance", None),
    ("radius", None),
    ("mass", None),
    ("charge", None),
    ("delta", None),
];
const OF_PARTS: [&str; 4] = ["radius", "mass", "charge", "delta"];
const FAR: f64 = 1e6;

/// The parts of a dumbbell: middle, half extent and mass.
const PARTS: [([f64; 3], f64, f64); 2] = [
    ([-0.5, 2.0, -0.25], 0.25, 1.0),
    ([1.5, 2.0, -0.25], 0.5, 3.0),
];

/// The frame of the field: away from the body, and turned, so that its axes are not those of the world.
fn frame() -> Pose {
    let turn = Rotation::from_rotation_z(from_f64(FRAC_PI_2));
    Pose::from_parts(Vector::new(-2.0, 0.5, 0.125), turn)
}

/// The field's origin, and the rotation into its axes.
fn from_frame() -> (DVec3, DQuat) {
    let pose = to_dpose3(&frame());
    (pose.translation, pose.rotation.inverse())
}

/// The coordinate of a sample along an axis, by its definition.
fn coordinate(axis: &str, query: &Query) -> f64 {
    let (origin, turn) = from_frame();
    let place = turn * (query.world_point - origin);
    let velocity = turn * query.world_velocity;
    let iron = query.groups == groups(IRON);
    let of_part = |of_iron, of_wood| if iron { of_iron } else { of_wood };
    match axis {
        "time" => query.time,
        "radius" => query.radius,
        "mass" => of_part(1.0, 3.0),
        "charge" => of_part(1.0, -1.0),
        "delta" => of_part(1.0, 5.0),
        _ => of_motion(axis, place, velocity),
    }
}

/// The coordinate of a point that moves, by the definition of the axis.
fn of_motion(axis: &str, place: DVec3, velocity: DVec3) -> f64 {
    match axis {
        "x" => place.x,
        "y" => place.y,
        "z" => place.z,
        "speed" => velocity.length(),
        "vx" => velocity.x,
        "vy" => velocity.y,
        "vz" => velocity.z,
        "distance" => place.length(),
        "closing_speed" => -place.dot(velocity) / place.length(),
        "time_to_closest" => -place.dot(velocity) / velocity.length_squared(),
        "closest_distance" => place.cross(velocity).length() / velocity.length(),
        _ => unreachable!("{axis}"),
    }
}

/// Two intervals with a border in the widest gap between the coordinates; if there is none, one with all and
/// one with none of them.
fn intervals(mut coordinates: Vec<f64>) -> [[f64; 2]; 2] {
    coordinates.sort_by(f64::total_cmp);
    let gaps = coordinates
        .windows(2)
        .map(|pair| (pair[1] - pair[0], pair[0]));
    let (gap, from) = gaps.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
    let first = coordinates[0];
    match gap > 1e-2 {
        true => [[-FAR, from + 0.5 * gap], [from + 0.5 * gap, FAR]],
        false => [[first - 0.5, first + 0.5], [first + 0.5, first + 1.5]],
    }
}

fn region(axis: &str, [from, until]: [f64; 2]) -> Region {
    Region::interval(axis, from_f64(from), from_f64(until))
}

/// Force and torque on the parts of the boxes that are between two planes across a coordinate of the frame,
/// under a force on the whole of each part.
fn between(
    coordinate: usize,
    [from, until]: [f64; 2],
    whole: impl Fn(usize) -> DVec3,
) -> [DVec3; 2] {
    let (origin, turn) = from_frame();
    let along = turn.inverse() * DVec3::AXES[coordinate];
    let com = DVec3::new(1.0, 2.0, -0.25);
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for (number, (middle, half, _)) in PARTS.into_iter().enumerate() {
        let middle = DVec3::from(middle);
        let at = (middle - origin).dot(along);
        let [low, high] = [from.max(at - half), until.min(at + half)];
        if low >= high {
            continue;
        }
        let one = whole(number) * ((high - low) / (2.0 * half));
        force += one;
        torque += (middle + along * (0.5 * (low + high) - at) - com).cross(one);
    }
    [force, torque]
}

fn is_iron(sample: &BodySample) -> bool {
    sample.query.groups == groups(IRON)
}

/// A law within an interval of any axis acts on the samples that are inside, of the colliders that its
/// groups admit, and on no others.
#[test]
fn intervals_of_every_axis_hold_for_each_sample() {
    let (world, body, parts) = dumbbell();
    // For each axis, whether an admitted sample was ever inside of its interval.
    let mut split = [false; AXES.len()];
    for (law, field) in laws() {
        let field = field.at(frame());
        for asked in SAMPLINGS {
            let is_uniform = matches!(law, "uniform" | "gravity zone");
            let plain = match asked {
                Sampling::Auto => field.clone(),
                asked => field.clone().sampled(asked),
            };
            let bare = Tree::from(plain.clone());
            for (number, (axis, spatial)) in AXES.into_iter().enumerate() {
                for grouped in [false, true] {
                    let only = |field| if grouped { only_iron(field) } else { field };
                    let limited = |limits| only(within(plain.clone(), region(axis, limits)));
                    let kind = match (law, asked) {
                        ("conveyor", Sampling::Auto) => Sampling::Centre,
                        // The parts themselves, or the whole body.
                        (_, Sampling::Auto) if is_uniform => {
                            match grouped || OF_PARTS.contains(&axis) {
                                true => Sampling::Parts,
                                false => Sampling::Centre,
                            }
                        }
                        _ => kind(law, asked),
                    };
                    let samples = fields(limited([-FAR, FAR]), parts).samples(body, &world);
                    let of_kind = samples.iter().filter(|sample| sample.sampling == kind);
                    let of_kind: Vec<_> = of_kind.collect();
                    let place = format!("{law}, {asked:?}, {axis}, groups: {grouped}");
                    let apart = grouped || OF_PARTS.contains(&axis);
                    if kind == Sampling::Centre && apart {
                        assert_eq!(of_kind.len(), 2, "{place}: each collider by itself");
                    }
                    let at = of_kind.iter().map(|it| coordinate(axis, &it.query));
                    for limits in intervals(at.collect()) {
                        let inside = |sample: &BodySample| {
                            let at = coordinate(axis, &sample.query);
                            limits[0] < at && at < limits[1]
                        };
                        let admitted = |sample: &BodySample| !grouped || is_iron(sample);
                        let expected = match spatial {
                            // Cut at the border.
                            Some(axis) if is_uniform && asked == Sampling::Auto => {
                                between(axis, limits, |part| {
                                    let mass = PARTS[part].2;
                                    let turned = to_dvec3(
                                        frame().rotation
                                            * from_dvec3(match law {
                                                "uniform" => DVec3::new(0.25, -0.5, 0.75),
                                                _ => DVec3::Y * 4.0,
                                            }),
                                    );
                                    let admits = !grouped || part == 0;
                                    turned * if admits { mass } else { 0.0 }
                                })
                            }
                            _ => {
                                let mut all = of_kind.iter().filter(|it| admitted(it));
                                split[number] |= all.any(|it| inside(it));
                                let felt = of_kind.iter().filter(|it| admitted(it) && inside(it));
                                literal(&bare, &world, body, felt.copied())
                            }
                        };
                        let fields = fields(limited(limits), parts);
                        let place = format!("{place}, {limits:?}");
                        let found = fields.sample(body, &world);
                        agree(found.expect("finite").expect("sampled"), expected, &place);
                        let told = fields.explain(body, &world).expect("sampled");
                        agree(told.wrench, expected, &format!("{place}, explained"));
                    }
                }
            }
        }
    }
    assert_eq!(split, [true; AXES.len()]);
}

/// The lift of a pool acts on each part that is inside, or on its piece inside; the drag on each sample of the volume.
#[test]
fn pools_end_at_intervals_of_every_axis() {
    let (world, body, parts) = dumbbell();
    let pool = Tree::pool(frame(), Vector::splat(50.0), 0.5, 8.0, 0.25);
    let submerged = pool.clone();
    for (axis, spatial) in AXES {
        for grouped in [false, true] {
            let limited = |limits| {
                let mut fields = fields(submerged.clone(), parts);
                let leaves: Vec<_> = fields.set.iter().map(|(leaf, _)| leaf).collect();
                assert_eq!(leaves.len(), 2);
                for leaf in leaves {
                    let field = &mut fields.set[leaf];
                    let limited = within(field.clone(), region(axis, limits));
                    *field = if grouped { only_iron(limited) } else { limited };
                }
                fields
            };
            let samples = limited([-FAR, FAR]).samples(body, &world);
            let volume = samples.iter().filter(|it| it.sampling == Sampling::Volume);
            let at = volume.map(|it| coordinate(axis, &it.query));
            for limits in intervals(at.collect()) {
                let inside = |sample: &&BodySample| {
                    let at = coordinate(axis, &sample.query);
                    limits[0] < at && at < limits[1] && (!grouped || is_iron(sample))
                };
                let lift = |part: usize| {
                    let volume = (2.0 * PARTS[part].1).powi(3);
                    let up = to_dvec3(frame().rotation * Vector::Y);
                    let admits = !grouped || part == 0;
                    up * if admits { 0.5 * 8.0 * volume } else { 0.0 }
                };
                let lifted = match spatial {
                    Some(axis) => between(axis, limits, lift),
                    None => {
                        let sites = samples.iter().filter(|it| it.sampling == Sampling::Parts);
                        let sites: Vec<_> = sites.filter(inside).collect();
                        let has = |part| sites.iter().any(|site| is_iron(site) == (part == 0));
                        let whole = |part| if has(part) { lift(part) } else { DVec3::ZERO };
                        between(0, [-FAR, FAR], whole)
                    }
                };
                let drag = Field::drag(0.25, 0.0).force_mode(ForceMode::Acceleration);
                let slowed = samples.iter().filter(|it| it.sampling == Sampling::Volume);
                let slowed = literal(&drag.into(), &world, body, slowed.filter(inside));
                let expected = [0, 1].map(|i| lifted[i] + slowed[i]);
                let place = format!("pool, {axis}, groups: {grouped}, {limits:?}");
                let found = limited(limits).sample(body, &world);
                agree(found.expect("finite").expect("sampled"), expected, &place);
            }
        }
    }
}

/// A velocity that is set between two steps counts in the next one: a body enters the region of a field by that
/// velocity alone, and moves on as with fields that know nothing of the step before.
#[test]
fn velocities_set_between_steps_count_for_every_axis() {
    let place = DVec3::new(3.0, 1.0, 0.5);
    let [before, after] = [DVec3::new(1.0, 0.5, -0.25), DVec3::new(-1.0, 2.0, 0.75)];
    let mut entered = 0;
    let of_others = |axis: &str| axis == "time" || OF_PARTS.contains(&axis);
    for (axis, _) in AXES.iter().filter(|it| !of_others(it.0)) {
        let [from, to] = [before, after].map(|velocity| of_motion(axis, place, velocity));
        let half = 0.4 * (to - from).abs() + 0.05;
        let near = Region::interval(*axis, from_f64(to - half), from_f64(to + half));
        let field = Field::uniform(Vector::Z).within(near);
        for scheme in [Scheme::KickDriftKick, Scheme::Kick, Scheme::auto(1e-3)] {
            let world_of = |place: Vector, velocity: DVec3| {
                let mut world = weightless(1e-3);
                let body = RigidBodyBuilder::dynamic()
                    .translation(place)
                    .linvel(from_dvec3(velocity));
                let (body, _) = world.insert(body, ColliderBuilder::ball(0.1));
                (world, body)
            };
            let (mut world, body) = world_of(from_dvec3(place), before);
            let mut fields = build(field.clone(), scheme);
            fields.step(&mut world).expect("a step");
            let (mut other, _) = world_of(world.bodies[body].translation(), after);
            world.bodies[body].set_linvel(from_dvec3(after), true);
            fields.step(&mut world).expect("a step");
            let mut fresh = build(field.clone(), scheme);
            fresh.step(&mut other).expect("a step");
            let [ours, theirs] = [&world, &other].map(|world| world.bodies[body].linvel());
            // The first step turns a ball that a border passes through.
            let off = to_f64((ours - theirs).length());
            assert_at_most(off, 1e-6, format!("{axis}, {scheme:?}"));
            entered += usize::from(ours.z != from_f64(after.z));
        }
    }
    assert!(entered >= 7 * 3, "only {entered} entered");
}
