//! Tests of recorders, without the program `simulate`.

use super::files::{Pace, Recorder};
use super::lab::fields::Fields;
use super::lab::fields::math::{from_f64, to_f64};
use super::lab::fields::prelude::*;
use rapier3d_fields_scene::page::{ContactKind, DrawnShape, Page, Replay};

/// A world without gravity.
fn empty() -> PhysicsWorld {
    PhysicsWorld {
        gravity: Vector::ZERO,
        ..PhysicsWorld::default()
    }
}

fn put(world: &mut PhysicsWorld, shape: SharedShape, at: Vector) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic().translation(at);
    world.insert(body, ColliderBuilder::new(shape)).0
}

/// Runs a world under some fields.
fn record(world: &mut PhysicsWorld, tree: impl Into<Tree>, pace: Pace) -> Replay {
    let mut fields = Fields::new(tree).expect("valid fields");
    let mut recorder = Recorder::new(world, &fields, pace);
    for _ in 0..pace.steps {
        fields.step(world).expect("a step");
        recorder.after_step(world, &fields);
    }
    recorder.finish(world)
}

/// A field that gives no force.
fn nothing() -> Tree {
    Field::uniform(Vector::ZERO).into()
}

fn steps(steps: usize) -> Pace {
    Pace { steps, every: None }
}

/// Place and attitude of all bodies at the last frame, in counts and thousandths.
fn last_places(replay: &Replay) -> Vec<[i64; 7]> {
    let mut places = vec![[0; 7]; replay.bodies.len()];
    for frame in &replay.frames {
        let mut numbers = frame.iter();
        while let Some(body) = numbers.next() {
            let body = *body as usize;
            let shown = if replay.bodies[body].turns { 7 } else { 3 };
            for place in &mut places[body][..shown] {
                *place += numbers.next().expect("as many numbers as are shown");
            }
        }
    }
    places
}

/// One of each of Rapier's shapes.
fn every_shape() -> Vec<SharedShape> {
    let corners = [Vector::ZERO, Vector::X, Vector::Y, Vector::Z];
    let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let heights = Array2::new(2, 2, vec![0.0, 0.1, 0.2, 0.3]);
    let [half, thin] = [0.5, 0.1].map(from_f64);
    vec![
        SharedShape::ball(half),
        SharedShape::cuboid(half, 0.4, 0.3),
        SharedShape::capsule_y(half, 0.2),
        SharedShape::cylinder(half, 0.2),
        SharedShape::cone(half, 0.2),
        SharedShape::segment(Vector::ZERO, Vector::X),
        SharedShape::triangle(Vector::ZERO, Vector::X, Vector::Y),
        SharedShape::convex_hull(&corners).expect("a hull"),
        SharedShape::trimesh(corners.to_vec(), faces).expect("a mesh"),
        SharedShape::polyline(corners.to_vec(), None),
        SharedShape::heightfield(heights, Vector::ONE),
        SharedShape::compound(vec![
            (Pose::translation(1.0, 0.0, 0.0), SharedShape::ball(half)),
            (Pose::IDENTITY, SharedShape::cuboid(half, half, half)),
        ]),
        SharedShape::halfspace(Vector::Y),
        SharedShape::voxels_from_points(Vector::splat(0.2), &corners),
        SharedShape::round_cuboid(half, half, half, thin),
        SharedShape::round_cylinder(half, half, thin),
        SharedShape::round_cone(half, half, thin),
        SharedShape::round_triangle(Vector::ZERO, Vector::X, Vector::Y, thin),
        SharedShape::round_convex_hull(&corners, thin).expect("a hull"),
    ]
}

#[test]
fn each_shape_is_drawn_and_stored_once() {
    for (number, shape) in every_shape().into_iter().enumerate() {
        let kind = shape.shape_type();
        let parts = if kind == ShapeType::Compound { 2 } else { 1 };
        let mut world = empty();
        for x in [-2.0, 2.0] {
            put(&mut world, shape.clone(), Vector::X * from_f64(x));
        }
        let replay = record(&mut world, nothing(), steps(2));
        assert_eq!(replay.bodies.len(), 2, "{kind:?}");
        assert_eq!(replay.bodies[0].parts.len(), parts, "{kind:?}");
        // The patch of each half-space is around its point nearest to the middle of the view.
        if kind != ShapeType::HalfSpace {
            assert_eq!(replay.shapes.len(), parts, "{kind:?}");
        }
        for shape in &replay.shapes {
            match shape {
                DrawnShape::Ball { radius } => assert!(*radius > 0.0),
                DrawnShape::Mesh { points, faces, .. } => {
                    assert!(points.len() >= 9 && faces.len() >= 4, "{kind:?}");
                    let corners = faces.chunks(4).flat_map(|face| &face[..3]);
                    let most = corners.max().expect("a corner");
                    assert!((*most as usize) < points.len() / 3, "{kind:?}");
                }
                DrawnShape::Lines { points, lines, .. } => {
                    assert!(points.len() >= 6 && lines.len() >= 2, "{kind:?}");
                }
            }
        }
        assert!(number < 19);
    }
}

#[test]
fn a_cuboid_has_its_twelve_edges() {
    let mut world = empty();
    put(&mut world, SharedShape::cuboid(1.0, 2.0, 3.0), Vector::ZERO);
    let replay = record(&mut world, nothing(), steps(1));
    let [
        DrawnShape::Mesh {
            faces,
            points,
            convex: true,
            ..
        },
    ] = &replay.shapes[..]
    else {
        panic!("{:?}", replay.shapes)
    };
    let creases: u32 = faces.chunks(4).map(|face| face[3].count_ones()).sum();
    // Each edge belongs to two faces; the diagonals are no creases.
    assert_eq!((points.len(), faces.len(), creases), (24, 48, 24));
}

#[test]
fn the_last_frame_has_the_poses_of_the_world() {
    let mut world = empty();
    let body = put(
        &mut world,
        SharedShape::cuboid(0.5, 0.2, 0.3),
        Vector::X * 3.0,
    );
    world.bodies[body].set_angvel(Vector::new(1.0, 2.0, 3.0), true);
    let replay = record(&mut world, Field::spring(2.0), steps(77));
    assert_eq!(replay.frames.len(), 78);
    let found = last_places(&replay)[0];
    let pose = world.bodies[body].position();
    for (found, expected) in found[..3].iter().zip(pose.translation.to_array()) {
        let off = *found as f64 * replay.unit - to_f64(expected);
        assert!(off.abs() <= replay.unit, "{off}");
    }
    let turn = pose.rotation.to_array().map(|it| 1e3 * to_f64(it));
    let along: f64 = (0..4).map(|it| turn[it] * found[3 + it] as f64).sum();
    assert!(along.abs() > 0.999e6, "{along}");
}

#[test]
fn frames_are_limited_unless_their_period_is_given() {
    let frames = |pace: Pace| {
        let mut world = empty();
        put(&mut world, SharedShape::ball(0.5), Vector::X);
        record(&mut world, Field::spring(2.0), pace)
    };
    let few = frames(steps(1000));
    assert_eq!(few.frames.len(), 251);
    assert!((few.times[250] - 1000.0 / 60.0).abs() < 1e-3);
    let every = Some(3);
    // The last step is a frame, too.
    assert_eq!(frames(Pace { steps: 100, every }).frames.len(), 35);
}

#[test]
fn an_outlier_does_not_widen_the_view() {
    let mut world = empty();
    for x in 0..9 {
        put(
            &mut world,
            SharedShape::ball(0.5),
            Vector::X * from_f64(2.0 * f64::from(x)),
        );
    }
    let astray = put(&mut world, SharedShape::ball(0.5), Vector::ZERO);
    world.bodies[astray].set_translation(Vector::Y * 1e9, true);
    let replay = record(&mut world, nothing(), steps(3));
    let half = replay.half.map(|it| it as f64 * replay.unit);
    assert!(half[0] > 8.0 && half[0] < 10.0, "{half:?}");
    assert!(half[1] < 2.0, "{half:?}");
}

/// A ball in a closed box.
fn boxed() -> PhysicsWorld {
    let mut world = empty();
    let walls = [
        Vector::X,
        Vector::Y,
        Vector::Z,
        -Vector::X,
        -Vector::Y,
        -Vector::Z,
    ];
    for outward in walls {
        let half = Vector::splat(9.0) - outward.abs() * 6.0;
        let wall = ColliderBuilder::cuboid(half.x, half.y, half.z);
        world.colliders.insert(wall.translation(outward * 8.0));
    }
    let ball = put(&mut world, SharedShape::ball(0.5), Vector::ZERO);
    world.bodies[ball].set_linvel(Vector::new(9.0, 14.0, 11.0), true);
    for part in world.bodies[ball].colliders().to_vec() {
        world.colliders[part].set_restitution(1.0);
    }
    world
}

#[test]
fn walls_of_a_closed_box_end_where_they_meet() {
    let replay = record(&mut boxed(), nothing(), steps(600));
    assert_eq!(replay.walls.len(), 6);
    for corner in replay.walls.iter().flatten() {
        for number in corner {
            assert_eq!((*number as f64 * replay.unit).abs().round(), 5.0);
        }
    }
    assert!(replay.bodies[1].parts.is_empty(), "walls are no parts");
    assert!(replay.contacts.iter().flatten().count() > 0, "it bounces");
}

#[test]
fn arrows_are_drawn_where_and_when_fields_act() {
    let recorded = |tree: Tree| {
        let mut world = empty();
        for x in [-3.0, 3.0] {
            put(&mut world, SharedShape::ball(0.5), Vector::X * from_f64(x));
        }
        record(&mut world, tree, steps(120))
    };
    assert!(recorded(nothing()).arrows.is_none());
    let wind = Field::uniform(Vector::Y * 0.1).within(Region::ball(2.0));
    let replay = recorded(wind.into());
    let arrows = replay.arrows.expect("some");
    assert_eq!(arrows.moments.len(), 1, "nothing changes");
    assert!((arrows.longest - 0.1).abs() < 1e-6);
    for arrow in arrows.moments[0].arrows.chunks(6) {
        let at: Vec<f64> = arrow.iter().map(|it| *it as f64 * replay.unit).collect();
        assert!(at[0].hypot(at[1]).hypot(at[2]) < 2.01, "{at:?}");
        assert!(at[3] == 0.0 && at[4] > 0.0 && at[5] == 0.0, "{at:?}");
    }
    let later = Region::interval(Axis::Time, 1.0, 9.0);
    let moments = recorded(Field::uniform(Vector::Y).within(later).into());
    let moments = moments.arrows.expect("some").moments;
    assert_eq!(moments.len(), 2);
    assert!(moments[0].arrows.is_empty() && !moments[1].arrows.is_empty());
    assert!(moments[1].frame >= 60 && moments[1].frame <= 66);
}

#[test]
fn sleeping_bodies_are_recorded() {
    let mut world = empty();
    let body = put(&mut world, SharedShape::ball(0.5), Vector::ZERO);
    world.bodies[body].sleep();
    put(&mut world, SharedShape::ball(0.5), Vector::X * 5.0);
    let replay = record(&mut world, nothing(), steps(2));
    assert_eq!(replay.asleep[0], [0]);
}

#[test]
fn contacts_that_only_the_fields_find_are_marked() {
    let recorded = |unseen: bool| {
        let mut world = empty();
        let balls = [0.0, 0.9].map(|x| {
            let at = Vector::X * from_f64(x);
            put(&mut world, SharedShape::ball(0.5), at)
        });
        for (_, part) in world.colliders.iter_mut().filter(|_| unseen) {
            part.set_active_collision_types(ActiveCollisionTypes::empty());
        }
        let field = |body: RigidBodyHandle| {
            let part = world.bodies[body].colliders()[0];
            Field::contact(ContactLaw::Observe).at(part)
        };
        let tree = balls.map(field);
        let [one, other] = tree;
        let fields = Fields::builder(one.sum_union(other)).cross_check(true);
        let mut fields = fields.build().expect("valid fields");
        let mut recorder = Recorder::new(&world, &fields, steps(5));
        for _ in 0..5 {
            fields.step(&mut world).expect("a step");
            recorder.after_step(&world, &fields);
        }
        let rows = recorder.finish(&world).contacts;
        let kinds = rows.iter().flat_map(|row| row.chunks(4).map(|it| it[3]));
        kinds.collect::<Vec<i64>>()
    };
    let only = ContactKind::OnlyFields as i64;
    assert_eq!(recorded(true), [only; 5], "in each frame again");
    assert_eq!(
        recorded(false),
        [ContactKind::Agreed as i64],
        "when it begins"
    );
}

#[test]
fn a_page_of_a_thousand_bodies_takes_a_few_megabytes() {
    let mut world = empty();
    let mut bodies = Vec::new();
    for number in 0..1000 {
        let [x, y, z] = [number % 10, number / 10 % 10, number / 100].map(f64::from);
        let at = Vector::new(from_f64(x), from_f64(y), from_f64(z)) * 2.0;
        bodies.push(put(&mut world, SharedShape::cuboid(0.5, 0.5, 0.5), at));
    }
    let fields = Fields::new(nothing()).expect("valid fields");
    let mut recorder = Recorder::new(&world, &fields, steps(600));
    for step in 0..600 {
        let angle = from_f64(0.02 * f64::from(step));
        for (number, body) in bodies.iter().enumerate() {
            let turn = Rotation::from_rotation_y(angle * (number % 7) as Real);
            let body = &mut world.bodies[*body];
            body.set_translation(body.translation() + turn * Vector::X * 0.05, false);
            body.set_rotation(turn, false);
        }
        recorder.after_step(&world, &fields);
    }
    let page = Page {
        title: "many".to_owned(),
        facts: String::new(),
        replay: recorder.finish(&world),
    };
    let size = page.html().expect("a page").len();
    assert!(size < 6_000_000, "{size} bytes");
}
