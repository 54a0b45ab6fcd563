//! Bodies that enter and leave zones, and when: closed forms of the times, edits, and random worlds against the
//! distances after each step.

use std::collections::HashSet;
use std::sync::mpsc::{Receiver, channel};

use rapier3d_fields::diagnose::ZoneEvent;
use rapier3d_fields::math::{DVec3, Real, from_dvec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::faults::own_step;
use crate::support::bits::bits;
use crate::support::numbers::Numbers;
use crate::support::{assert_close, build, either, weightless};

const DT: f64 = 1.0 / 60.0;

/// An event without the handles.
#[derive(Debug, PartialEq)]
struct Seen {
    enters: bool,
    time: f64,
}

fn seen(event: ZoneEvent) -> Seen {
    Seen {
        enters: event.has_entered(),
        time: event.time(),
    }
}

fn watched(tree: impl Into<Tree>) -> (Fields, Receiver<ZoneEvent>) {
    let mut fields = build(tree, Scheme::KickDriftKick);
    let (sender, events) = channel();
    fields.set_zone_events(sender);
    (fields, events)
}

/// A field without force.
fn still(region: Region) -> Field {
    Field::uniform(Vector::ZERO).within(region)
}

fn thrown(world: &mut PhysicsWorld, from: DVec3, linvel: DVec3) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(from_dvec3(from))
        .linvel(from_dvec3(linvel))
        .can_sleep(false);
    world.insert(body, ColliderBuilder::ball(0.1)).0
}

fn steps(fields: &mut Fields, world: &mut PhysicsWorld, count: usize) {
    for _ in 0..count {
        fields.step(world).expect("a step");
    }
}

fn assert_times(events: &Receiver<ZoneEvent>, expected: &[(bool, f64)], what: &str) {
    let found: Vec<Seen> = events.try_iter().map(seen).collect();
    assert_eq!(found.len(), expected.len(), "{what}: {found:?}");
    for (found, (enters, time)) in found.iter().zip(expected) {
        assert_eq!(found.enters, *enters, "{what}: {found:?}");
        assert_close(found.time, *time, either(2e-5, 1e-12), what);
    }
}

/// A chord of a ball, crossed within one step or over many.
#[test]
fn times_are_those_of_the_crossings() {
    for (speed, count, lasts) in [
        (1.7, 200, f64::INFINITY),
        (40.0, 10, f64::INFINITY),
        (900.0, 2, f64::INFINITY),
        (900.0, 2, 60.0),
        (9000.0, 2, 60.0),
    ] {
        let mut world = weightless(from_f64(DT));
        world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
        thrown(&mut world, DVec3::new(-3.0, 0.6, 0.0), DVec3::X * speed);
        // The depth in a field that does not last forever is evaluated more often.
        let field = still(Region::ball(1.0)).lifetime(Lifetime::between(-1.0, lasts));
        let (mut fields, events) = watched(field);
        steps(&mut fields, &mut world, count);
        let expected = [(true, 2.2 / speed), (false, 3.8 / speed)];
        assert_times(&events, &expected, &format!("{speed} m/s"));
    }
}

/// A zone on a carrier reaches a body; then the body is moved away.
#[test]
fn bodies_enter_and_leave_zones_that_move() {
    let mut world = weightless(from_f64(DT));
    let resting = thrown(&mut world, DVec3::ZERO, DVec3::ZERO);
    let carrier = RigidBodyBuilder::kinematic_velocity_based()
        .translation(Vector::X * -5.0)
        .linvel(Vector::X * 2.0);
    let carrier = world.bodies.insert(carrier);
    let (mut fields, events) = watched(still(Region::cuboid(Vector::splat(0.75))).at(carrier));
    steps(&mut fields, &mut world, 150);
    assert_times(&events, &[(true, 2.125)], "a carrier");
    // The zone is around the body now.
    world.bodies[carrier].set_linvel(Vector::ZERO, true);
    let time = fields.time();
    world.bodies[resting].set_translation(Vector::Y * 9.0, true);
    steps(&mut fields, &mut world, 3);
    assert_times(&events, &[(false, time)], "carried away by hand");
}

fn group(members: Group) -> InteractionGroups {
    InteractionGroups::new(members, members, InteractionTestMode::default())
}

#[test]
fn edits_let_bodies_in_and_out() {
    let mut world = weightless(from_f64(DT));
    let body = thrown(&mut world, DVec3::ZERO, DVec3::ZERO);
    let zone = still(Region::ball(1.0)).lifetime(Lifetime::between(0.1, 2.03));
    let zone = zone.groups(group(Group::GROUP_1));
    let (mut fields, events) = watched(zone.named("zone"));
    steps(&mut fields, &mut world, 30);
    assert_times(&events, &[(true, 0.1)], "it begins");

    let mut time = fields.time();
    fields.set.get_mut("zone").expect("it").enabled = false;
    steps(&mut fields, &mut world, 2);
    assert_times(&events, &[(false, time)], "disabled");
    time = fields.time();
    fields.set.get_mut("zone").expect("it").enabled = true;
    steps(&mut fields, &mut world, 2);
    assert_times(&events, &[(true, time)], "enabled");

    time = fields.time();
    world.bodies[body].set_enabled(false);
    steps(&mut fields, &mut world, 2);
    assert_times(&events, &[(false, time)], "a disabled body");
    time = fields.time();
    world.bodies[body].set_enabled(true);
    steps(&mut fields, &mut world, 2);
    assert_times(&events, &[(true, time)], "an enabled body");

    time = fields.time();
    let part = world.bodies[body].colliders()[0];
    world.colliders[part].set_collision_groups(group(Group::GROUP_3));
    steps(&mut fields, &mut world, 2);
    assert_times(&events, &[(false, time)], "other groups");
    time = fields.time();
    world.colliders[part].set_collision_groups(InteractionGroups::all());
    steps(&mut fields, &mut world, 2);
    assert_times(&events, &[(true, time)], "all groups");

    steps(&mut fields, &mut world, 100);
    assert_times(&events, &[(false, 2.03)], "it ends");
    assert!(fields.set.is_empty(), "it has left its set");
}

#[test]
fn removed_bodies_and_fields_cause_events() {
    let mut world = weightless(from_f64(DT));
    let bodies = [0.0, 0.5].map(|x| thrown(&mut world, DVec3::X * x, DVec3::ZERO));
    let (mut fields, events) = watched(still(Region::ball(1.0)).named("zone"));
    steps(&mut fields, &mut world, 2);
    assert_times(&events, &[(true, 0.0); 2], "both");
    let time = fields.time();
    world.remove_body(bodies[0]);
    steps(&mut fields, &mut world, 2);
    let left: Vec<_> = events.try_iter().collect();
    let zone = fields.set.handle("zone").expect("it");
    assert!(
        matches!(left[..], [ZoneEvent::Left { field, body, time: at, .. }]
            if field == zone && body == bodies[0] && at == time),
        "{left:?}"
    );
    let time = fields.time();
    fields.set.remove_field(zone);
    steps(&mut fields, &mut world, 2);
    assert_times(&events, &[(false, time)], "the field");
}

/// Prototypes of instances, contact fields and fields everywhere are no zones; carriers are not in their own.
#[test]
fn some_fields_are_no_zones() {
    let mut world = weightless(from_f64(DT));
    let body = thrown(&mut world, DVec3::ZERO, DVec3::ZERO);
    let part = world.bodies[body].colliders()[0];
    let copied = Tree::instances(still(Region::ball(1.0)), [Vector::ZERO]);
    let tree = copied
        .sum_union(still(Region::ball(1.0)).at(body))
        .sum_union(Field::uniform(Vector::ZERO))
        .sum_union(still(Region::interval(Axis::Charge, -1.0, 1.0)))
        .sum_union(Field::contact(ContactLaw::Observe).at(part));
    let (mut fields, events) = watched(tree);
    steps(&mut fields, &mut world, 3);
    assert_times(&events, &[], "no zones");
}

/// Balls that fly about, and the generator for more numbers.
fn swarm(number: u64) -> (PhysicsWorld, Numbers) {
    let mut random = Numbers::new(number);
    let mut world = weightless(from_f64(DT));
    for _ in 0..30 {
        let (place, linvel) = (random.vector() * 2.0, random.vector() * 20.0);
        let body = thrown(&mut world, place, linvel);
        world.bodies[body].set_linear_damping(from_f64(random.perhaps(0.5)));
    }
    (world, random)
}

#[test]
fn events_agree_with_distances_after_each_step() {
    for number in 0..8 {
        let (mut world, mut random) = swarm(number);
        let centres: Vec<DVec3> = (0..4).map(|_| random.vector() * 1.5).collect();
        let balls = centres.iter().map(|centre| {
            let ball = still(Region::ball(1.0)).at(from_dvec3(*centre));
            Tree::from(ball)
        });
        let trees = balls.chain([Field::spring(90.0).into()]);
        let tree = Tree::fold(Operator::SumUnion, trees);
        let (mut fields, events) = watched(tree.clone());
        let mut unwatched = (build(tree, Scheme::KickDriftKick), swarm(number).0);
        let handles: Vec<FieldHandle> = fields.set.iter().map(|it| it.0).collect();
        let mut inside: HashSet<(FieldHandle, RigidBodyHandle)> = HashSet::new();
        let mut count = 0;
        for _ in 0..120 {
            let began = fields.time();
            steps(&mut fields, &mut world, 1);
            steps(&mut unwatched.0, &mut unwatched.1, 1);
            let mut last = began;
            for event in events.try_iter() {
                let time = event.time();
                assert!(last <= time && time <= fields.time(), "{event:?}");
                last = time;
                count += 1;
                let changed = match event {
                    ZoneEvent::Entered { field, body, .. } => inside.insert((field, body)),
                    ZoneEvent::Left { field, body, .. } => inside.remove(&(field, body)),
                    _ => false,
                };
                assert!(changed, "{event:?} twice");
            }
            for (handle, centre) in handles.iter().zip(&centres) {
                for (body, it) in world.bodies.iter() {
                    let away = to_dvec3(it.center_of_mass()).distance(*centre);
                    let is = inside.contains(&(*handle, body));
                    let unsure = (away - 1.0).abs() < 1e-5;
                    assert!(unsure || is == (away <= 1.0), "{number}: {away}, {is}");
                }
            }
        }
        assert!(count > 500, "{number}: {count} events");
        assert_eq!(bits(&world), bits(&unwatched.1), "events change nothing");
    }
}

/// A saved state holds which bodies are inside.
#[test]
fn states_keep_which_bodies_are_inside() {
    let mut world = weightless(from_f64(DT));
    thrown(&mut world, DVec3::ZERO, DVec3::X);
    let (mut fields, events) = watched(still(Region::ball(1.0)));
    steps(&mut fields, &mut world, 10);
    assert_times(&events, &[(true, 0.0)], "before");
    let parts = (fields.set.clone(), fields.settings.clone());
    let saved = serde_json::to_string(&fields.state).expect("text");
    let state: FieldState = serde_json::from_str(&saved).expect("a state");
    let mut again = Fields::from_parts(parts.0, parts.1, state).expect("sound parts");
    let (sender, events) = channel();
    again.set_zone_events(sender);
    steps(&mut again, &mut world, 60);
    assert_times(&events, &[(false, 1.0)], "after");
    // Without a receiver a state keeps no zones.
    again.set_zone_events(None);
    steps(&mut again, &mut world, 1);
    let state = serde_json::to_string(&again.state).expect("text");
    assert!(state.contains(r#""zones":[]"#), "{state}");
    assert_eq!(
        to_f64(world.bodies.iter().next().expect("it").1.linvel().x),
        1.0
    );
}

/// A heap of mixed shapes falls into a tray through a zone and comes to rest in it, stepped by the fields and around a
/// pipeline of one's own: the events are the same and agree with the positions of bodies, awake or asleep.
#[test]
fn heaps_come_to_rest_in_zones_on_every_route() {
    let heap = || {
        let mut world = PhysicsWorld::new();
        let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
        world.insert(floor, ColliderBuilder::cuboid(20.0, 0.5, 20.0));
        // Walls keep rolling bodies in the zone, which is wider than they are.
        for side in [-2.0, 2.0] {
            let across = ColliderBuilder::cuboid(0.1, 5.0, 2.0);
            world.insert_collider(across.translation(Vector::new(side, 5.0, 0.0)), None);
            let along = ColliderBuilder::cuboid(2.0, 5.0, 0.1);
            world.insert_collider(along.translation(Vector::new(0.0, 5.0, side)), None);
        }
        for number in 0..12 {
            let place = Vector::new((number % 3) as Real * 0.7, 1.0 + number as Real * 0.5, 0.1);
            let body = RigidBodyBuilder::dynamic().translation(place);
            let shape = match number % 3 {
                0 => ColliderBuilder::ball(0.3),
                1 => ColliderBuilder::cuboid(0.3, 0.2, 0.25),
                _ => ColliderBuilder::capsule_y(0.15, 0.2),
            };
            world.insert(body, shape);
        }
        world
    };
    let slab = || still(Region::cuboid(Vector::new(3.0, 0.6, 3.0))).at(Vector::Y * 0.6);
    let (mut easy, mut own) = (heap(), heap());
    let (mut by_step, events) = watched(slab());
    let (mut by_halves, same_events) = watched(slab());
    let mut pipeline = PhysicsPipeline::new();
    let mut inside = HashSet::new();
    for step in 0..600 {
        steps(&mut by_step, &mut easy, 1);
        own_step(&mut by_halves, &mut own, &mut pipeline);
        let found: Vec<_> = events.try_iter().collect();
        assert_eq!(found, same_events.try_iter().collect::<Vec<_>>(), "{step}");
        for event in found {
            match event {
                ZoneEvent::Entered { body, .. } => assert!(inside.insert(body), "{event:?}"),
                ZoneEvent::Left { body, .. } => assert!(inside.remove(&body), "{event:?}"),
                _ => unreachable!("no other event"),
            }
        }
        for (handle, body) in easy.bodies.iter().filter(|it| it.1.is_dynamic()) {
            let place = to_dvec3(body.center_of_mass()) - DVec3::Y * 0.6;
            let depth = (DVec3::new(3.0, 0.6, 3.0) - place.abs()).min_element();
            let unsure = depth.abs() < 1e-5;
            assert!(
                unsure || inside.contains(&handle) == (depth > 0.0),
                "{step}: {depth}"
            );
        }
    }
    assert!(inside.len() > 6, "{} inside", inside.len());
    let asleep = |it: &RigidBodyHandle| easy.bodies[*it].is_sleeping();
    assert!(inside.iter().any(asleep), "nobody sleeps in the zone");
}
