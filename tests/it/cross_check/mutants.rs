//! The cross-check reports fields that see another world than Rapier, and only those.

use rapier3d_fields::cross_check::{CrossCheckReport, Difference};
use rapier3d_fields::math::{Real, SharedShape, Vector, from_f64};
use rapier3d_fields::prelude::*;

use super::report;
use crate::support::collide::*;

/// A step in which the world changes after the fields have looked at it, and before Rapier does.
pub fn step_changed(
    fields: &mut Fields,
    world: &mut PhysicsWorld,
    change: impl FnOnce(&mut PhysicsWorld),
) {
    let open = fields
        .begin(WorldMut::from(&mut *world))
        .expect("a beginning");
    change(world);
    world.step_with_events(&open.hooks(&()), &());
    fields.finish(open, WorldMut::from(world)).expect("an end");
}

/// The kinds of parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Made {
    Ball,
    Cuboid,
    Hull,
}

pub const MADE: [Made; 3] = [Made::Ball, Made::Cuboid, Made::Hull];

impl Made {
    pub fn shape(self, scale: Real) -> SharedShape {
        let corners = [
            Vector::new(0.6, 0.1, 0.0),
            Vector::new(-0.5, 0.45, 0.1),
            Vector::new(-0.4, -0.55, 0.2),
            Vector::new(0.1, 0.0, -0.6),
            Vector::new(0.0, 0.15, 0.7),
            Vector::new(0.3, -0.45, -0.2),
        ];
        match self {
            Made::Ball => SharedShape::ball(0.5 * scale),
            Made::Cuboid => SharedShape::cuboid(0.5 * scale, 0.4 * scale, 0.3 * scale),
            Made::Hull => {
                let scaled = corners.map(|corner| corner * scale);
                SharedShape::convex_hull(&scaled).expect("a hull")
            }
        }
    }

    pub fn insert(self, world: &mut PhysicsWorld, place: Vector, turn: Vector) -> Thing {
        let body = RigidBodyBuilder::dynamic().pose(Pose::new(place, turn));
        let body = body.can_sleep(false).allow_fast_rotation(true);
        let part = ColliderBuilder::new(self.shape(1.0))
            .mass(1.0)
            .friction(0.0);
        insert(world, body, [part])
    }
}

const LAWS: [ContactLaw; 4] = [
    ContactLaw::Observe,
    ELASTIC,
    ContactLaw::Paper,
    ContactLaw::Penalty {
        stiffness: 10.0,
        damping: 0.1,
    },
];

/// Two parts that overlap, at rest, under each law and detection.
fn scenes(made: Made) -> impl Iterator<Item = (PhysicsWorld, [Thing; 2], Fields)> {
    let detections = [Detection::Discrete, Detection::Swept];
    let each = detections
        .into_iter()
        .flat_map(|it| LAWS.map(|law| (it, law)));
    each.map(move |(detection, law)| {
        let mut world = still_arena();
        let turn = Vector::new(0.2, -0.1, 0.3);
        let places = [Vector::ZERO, Vector::new(0.6, 0.1, 0.05)];
        let things = [0, 1].map(|i| made.insert(&mut world, places[i], turn * i as Real));
        let builder = Fields::builder(touch(parts(&[&things[0], &things[1]]), law));
        let builder = builder.detection(detection).cross_check(true);
        let fields = builder.build().expect("a valid tree");
        (world, things, fields)
    })
}

/// Fails unless what the fields see at one scale and Rapier at another differs in some way.
#[track_caller]
fn assert_seen(scales: [Real; 2], is_kind: fn(&Difference) -> bool) {
    for made in MADE {
        for (mut world, [first, _], mut fields) in scenes(made) {
            let part = first.parts[0];
            world.colliders[part].set_shape(made.shape(scales[0]));
            step_changed(&mut fields, &mut world, |world| {
                world.colliders[part].set_shape(made.shape(scales[1]));
            });
            let found = &report(&fields).disagreements;
            let kinds = found.iter().filter(|it| is_kind(&it.difference));
            assert_eq!(kinds.count(), 1, "{made:?}: {:?}", report(&fields));
            assert!(report(&fields).disagreed() > 0);
        }
    }
}

#[test]
fn the_same_world_is_no_disagreement() {
    for made in MADE {
        for (mut world, _, mut fields) in scenes(made) {
            step_changed(&mut fields, &mut world, |_| {});
            let report = report(&fields);
            assert_eq!(report.disagreed(), 0, "{made:?}: {report:?}");
            assert_eq!(report.total.both, 1, "{made:?}");
            assert_eq!(report.total.not_comparable.total(), 0, "{made:?}");
        }
    }
}

#[test]
fn a_part_that_is_a_hundredth_too_large_or_too_small_is_reported() {
    for scale in [1.01, 0.99] {
        assert_seen([from_f64(scale), 1.0], |it| {
            matches!(it, Difference::Depth { .. })
        });
    }
}

#[test]
fn a_pair_that_the_fields_miss_is_reported() {
    assert_seen([0.1, 1.0], |it| matches!(it, Difference::OnlyRapier { .. }));
}

#[test]
fn a_pair_that_the_fields_invent_is_reported() {
    assert_seen([1.0, 0.1], |it| matches!(it, Difference::OnlyField { .. }));
}

#[test]
fn a_part_that_rapier_does_not_see_is_reported() {
    for made in MADE {
        for (mut world, [first, _], mut fields) in scenes(made) {
            step_changed(&mut fields, &mut world, |world| {
                world.colliders[first.parts[0]].set_enabled(false);
            });
            assert_eq!(report(&fields).total.only_field, 1, "{made:?}");
        }
    }
}

/// A heap of tops that fly into each other and on. Every third has one scale for the fields, and one for Rapier.
fn fly(
    made: Made,
    law: ContactLaw,
    detection: Detection,
    steps: usize,
    scales: [Real; 2],
) -> CrossCheckReport {
    let mut world = arena(from_f64(1.0 / 240.0));
    // Rapier's default: the check itself keeps contacts from being recycled.
    world.integration_parameters.contact_recycling = true;
    let mut things = Vec::new();
    for i in 0..27 {
        let side = |i: i32| from_f64(f64::from(i - 1) * 1.6);
        let place = Vector::new(side(i % 3), side(i / 3 % 3), side(i / 9));
        let turn = Vector::new(1.0, -0.7, 0.4) * from_f64(f64::from(i % 5 - 2));
        let thing = made.insert(&mut world, place, turn);
        let body = &mut world.bodies[thing.body];
        body.set_linvel(place * -1.0, true);
        body.set_angvel(Vector::new(2.0, 3.0, -1.0) + turn, true);
        things.push(thing);
    }
    let walls =
        crate::lab::scenes::insert_box(&mut world.bodies, &mut world.colliders, Vector::splat(3.0));
    let all = things.iter().flat_map(|thing| thing.parts.clone());
    let builder = Fields::builder(touch(all.chain(walls), law)).detection(detection);
    let mut fields = builder.cross_check(true).build().expect("a valid tree");
    let resize = |world: &mut PhysicsWorld, scale: Real| {
        if scales[0] == scales[1] {
            return;
        }
        for thing in things.iter().step_by(3) {
            world.colliders[thing.parts[0]].set_shape(made.shape(scale));
        }
    };
    for _ in 0..steps {
        resize(&mut world, scales[0]);
        let open = fields
            .begin(WorldMut::from(&mut world))
            .expect("a beginning");
        resize(&mut world, scales[1]);
        world.step_with_events(&open.hooks(&()), &());
        resize(&mut world, scales[0]);
        fields
            .finish(open, WorldMut::from(&mut world))
            .expect("an end");
    }
    report(&fields).clone()
}

#[test]
fn tops_of_any_shape_that_fly_into_each_other_agree() {
    for made in MADE {
        for law in [ContactLaw::Observe, ELASTIC] {
            for detection in [Detection::Discrete, Detection::Swept] {
                let report = fly(made, law, detection, 480, [1.0; 2]);
                println!("{made:?} {law:?} {detection:?}\n{report}");
                assert_eq!(
                    report.disagreed(),
                    0,
                    "{made:?} {law:?} {detection:?}\n{report}"
                );
                let counts = &report.total;
                // A pair that is answered when it touches does not overlap when the step ends.
                let seen = counts.both + report.touches.total();
                assert!(seen > 80, "{made:?} {law:?} {detection:?}\n{report}");
                let touches = &report.touches;
                let overlapping = touches.not_comparable.overlapping;
                assert_eq!(touches.agreed + overlapping, touches.total(), "{report}");
                assert!(counts.ambiguous * 20 <= counts.both, "{report}");
                assert_eq!(counts.not_comparable.total(), 0, "{report}");
            }
        }
    }
}

/// Swept detection of spinning tops: a part that the fields see too small is found under each law. A part that they see
/// too large is found where Rapier answers; where fields answer, the pair has parted before Rapier could see it.
#[test]
fn tops_of_another_size_are_reported_in_flight() {
    let by_fields = |size: f64| [from_f64(size), 1.0];
    let (too_little, too_much) = (
        [by_fields(0.1), by_fields(0.99)],
        [by_fields(1.01), [1.0, 0.1]],
    );
    for made in MADE {
        for law in [ContactLaw::Observe, ELASTIC] {
            let too_much = too_much.iter().filter(|_| law == ContactLaw::Observe);
            for scales in too_little.iter().chain(too_much) {
                let report = fly(made, law, Detection::Swept, 160, *scales);
                let found = report.disagreed();
                assert!(found > 5, "{made:?} {law:?} {scales:?}\n{report}");
            }
        }
    }
}
