//! Contacts of detection fields: which are found, and how they are resolved.

mod found;

use crate::lab::scenes::ammonia::{AmmoniaSettings, BoxOfAmmonia};
use crate::lab::scenes::insert_box;
use rapier3d_fields::math::{DVec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::collide::*;
use crate::support::{assert_at_most, assert_close, either};

fn newton(restitution: Real) -> ContactLaw {
    ContactLaw::restitution(restitution)
}

/// The impulses and angular impulses of contacts on fixed bodies during a run.
#[derive(Default)]
struct Walls {
    impulse: DVec3,
    twist: DVec3,
}

impl Walls {
    fn count(&mut self, fields: &Fields, world: &PhysicsWorld) {
        for contact in fields.contacts() {
            let point = to_dvec3(contact.world_point);
            for (body, impulse) in contact.bodies.iter().zip(contact.impulses) {
                if body.is_some_and(|body| world.bodies[body].is_fixed()) {
                    self.impulse += to_dvec3(impulse);
                    self.twist += point.cross(to_dvec3(impulse));
                }
            }
        }
    }
}

/// Steps a box of ammonia. Returns the largest drift of its energy, divided by the first kinetic energy.
fn run_job(scene: &mut BoxOfAmmonia, fields: &mut Fields, walls: &mut Walls, steps: usize) -> f64 {
    let kinetic = scene.kinetic_energy();
    let energy = |scene: &BoxOfAmmonia, fields: &mut Fields| {
        scene.kinetic_energy() + fields.potential_energy(&scene.world).total
    };
    let start = energy(scene, fields);
    let mut drifts = Vec::new();
    for _ in 0..steps {
        fields.step(&mut scene.world).expect("a step");
        walls.count(fields, &scene.world);
        drifts.push((energy(scene, fields) - start).abs() / kinetic);
    }
    crate::support::largest(drifts)
}

#[test]
fn a_box_of_ammonia_keeps_energy_and_momenta_and_agrees_with_rapier() {
    let mut scene = AmmoniaSettings::default().build().expect("a scene");
    let builder = Fields::builder(scene.tree(Some(10.0), ELASTIC)).cross_check(true);
    let mut fields = scene.fields(builder).expect("a valid tree");
    let start = Totals::of(&scene.world);
    let mut walls = Walls::default();
    let drift = run_job(&mut scene, &mut fields, &mut walls, 300);
    let mut end = Totals::of(&scene.world);
    end.momentum += walls.impulse;
    end.angular_momentum += walls.twist;
    let report = fields.cross_check().expect("it is on");
    println!("drift {drift:.2e}, {:?}", report.total);
    println!("walls {} {}", walls.impulse.length(), walls.twist.length());
    let linear = start.momentum.distance(end.momentum) / start.momentum_scale;
    let angular = start.angular_momentum.distance(end.angular_momentum) / start.angular_scale;
    println!("momentum {linear:.2e}, angular {angular:.2e}");
    assert_at_most(drift, 1e-3, "energy over the first kinetic energy");
    // 300 steps add about 3000 rounded forces to each body; they round independently.
    start.assert_momenta_kept(&end, 30.0);
    assert_eq!(report.total.disagreed(), 0, "{:?}", report.disagreements);
    assert!(report.total.both > 0 && report.steps == 300);
    assert!(report.total.within_band <= 2, "{:?}", report.total);
    assert!(walls.impulse.length() > 0.0, "none met a wall");
}

/// Tops that fly towards the origin from the corners of a lattice, spinning fast.
fn imploding(world: &mut PhysicsWorld) -> Vec<Thing> {
    let side = |i: usize| (i as Real - 1.0) * from_f64(3.4);
    (0..27)
        .map(|i| {
            let place = Vector::new(side(i % 3), side(i / 3 % 3), side(i / 9));
            let turn = Vector::new(1.0, -0.7, 0.4) * ((i % 5) as Real - 2.0);
            let spin = Vector::new(2.0, 3.0, -1.0) + turn;
            let body = RigidBodyBuilder::dynamic().pose(Pose::new(place, turn));
            let body = body.linvel(place * -0.5).angvel(spin);
            asymmetric(world, body, 1.0 + (i % 4) as Real)
        })
        .collect()
}

#[test]
fn spinning_bodies_of_many_balls_keep_momenta_and_agree_with_rapier() {
    let mut world = arena(from_f64(1.0 / 240.0));
    let things = imploding(&mut world);
    let PhysicsWorld {
        bodies, colliders, ..
    } = &mut world;
    let sides = insert_box(bodies, colliders, Vector::splat(from_f64(5.2)));
    let atoms = things.iter().flat_map(|thing| thing.parts.clone());
    let builder = Fields::builder(touch(atoms.chain(sides), ELASTIC)).cross_check(true);
    let mut fields = builder.build().expect("a valid tree");
    let start = Totals::of(&world);
    let mut walls = Walls::default();
    for _ in 0..1200 {
        step(&mut fields, &mut world);
        walls.count(&fields, &world);
    }
    let mut end = Totals::of(&world);
    end.momentum += walls.impulse;
    end.angular_momentum += walls.twist;
    let report = fields.cross_check().expect("it is on");
    println!("{report:?}\n{start:?}\n{end:?}");
    assert!(report.total.both > 300, "{:?}", report.total);
    assert_eq!(report.total.disagreed(), 0, "{:?}", report.disagreements);
    // The two sides round differently, some units in the last place of a coordinate up to 8.
    assert_at_most(to_f64(report.depth_error), either(4e-6, 1e-14), "depth");
    assert_at_most(to_f64(report.point_error), either(4e-6, 1e-14), "point");
    assert_at_most(to_f64(report.normal_error), either(8e-6, 2e-14), "normal");
    // A rounding every other step.
    start.assert_momenta_kept(&end, 600.0);
    let change = (end.energy / start.energy - 1.0).abs();
    // The free rotation of a top does not keep its energy exactly.
    assert_at_most(change, 1e-5, "energy of the tops");
}

#[test]
fn equal_balls_head_on_exchange_velocities() {
    let velocities = [Vector::X * 3.0, Vector::X * -1.0];
    let (mut world, [a, b]) = overlapping(velocities, [2.0; 2]);
    let mut fields = detect(&[&a, &b], ELASTIC);
    assert_eq!(step(&mut fields, &mut world), 1);
    assert_near(linvel(&world, &a), velocities[1], rounding(), "first");
    assert_near(linvel(&world, &b), velocities[0], rounding(), "second");
    let contact = fields.contacts()[0];
    assert_close(to_f64(contact.approach_speed), 4.0, rounding(), "approach");
    assert_eq!(contact.impulses[0], -contact.impulses[1]);
    assert_near(contact.impulses[1], Vector::X * 8.0, 4.0 * rounding(), "J");
    step(&mut fields, &mut world);
    let contact = fields.contacts()[0];
    assert!(contact.approach_speed < 0.0, "they part");
    assert_eq!(contact.impulses, [Vector::ZERO; 2]);
}

#[test]
fn masses_may_differ_by_any_ratio() {
    for ratio in [1e-3, 0.1, 7.0, 1e3] {
        let masses = [1.0, from_f64(ratio)];
        let (mut world, [a, b]) = overlapping([Vector::X, Vector::ZERO], masses);
        let mut fields = detect(&[&a, &b], ELASTIC);
        let start = Totals::of(&world);
        step(&mut fields, &mut world);
        start.assert_kept(&Totals::of(&world), 8.0);
        let expected = [(1.0 - ratio) / (1.0 + ratio), 2.0 / (1.0 + ratio)];
        for (thing, expected) in [&a, &b].into_iter().zip(expected) {
            let found = linvel(&world, thing);
            assert_near(found, Vector::X * from_f64(expected), rounding(), "after");
        }
    }
}

#[test]
fn restitution_is_the_ratio_of_the_speeds() {
    for restitution in [0.0, 0.5, 1.0] {
        let velocities = [Vector::new(2.0, 1.0, 0.0), Vector::new(-1.0, 0.5, 0.25)];
        let (mut world, [a, b]) = overlapping(velocities, [1.0, 3.0]);
        let mut fields = detect(&[&a, &b], newton(restitution));
        let start = Totals::of(&world);
        step(&mut fields, &mut world);
        start.assert_momenta_kept(&Totals::of(&world), 8.0);
        let after = linvel(&world, &a) - linvel(&world, &b);
        let expected = Vector::new(-3.0 * restitution, 0.5, -0.25);
        assert_near(after, expected, 2.0 * rounding(), "no friction either");
    }
}

#[test]
fn of_two_restitutions_the_larger_counts() {
    let (mut world, [a, b]) = overlapping([Vector::X, -Vector::X], [1.0; 2]);
    let tree = touch(a.parts.clone(), newton(0.25)).sum_union(touch(b.parts.clone(), newton(0.75)));
    let mut fields = Fields::new(tree).expect("a valid tree");
    step(&mut fields, &mut world);
    let found = linvel(&world, &a);
    assert_near(found, Vector::X * -0.75, rounding(), "after");
}

/// A ball hits a corner of a spinning top, far from the line of centres.
fn off_centre(restitution: Real) -> [Totals; 2] {
    let mut world = still_arena();
    let pose = Pose::new(Vector::new(3.0, -2.0, 1.0), Vector::new(0.3, 0.5, -0.2));
    let spinning = RigidBodyBuilder::dynamic().pose(pose);
    let spinning = spinning.linvel(Vector::Y).angvel(Vector::new(1., -2., 3.));
    let top = asymmetric(&mut world, spinning, 2.0);
    let corner = pose * Vector::new(1.0, 0.1, 0.0);
    let place = corner + Vector::new(0.6, 0.5, 0.4);
    let hit = ball(&mut world, 1.5, place, Vector::new(-4.0, -3.0, -5.0));
    let mut fields = detect(&[&top, &hit], newton(restitution));
    let start = Totals::of(&world);
    assert_eq!(step(&mut fields, &mut world), 1);
    assert!(fields.contacts()[0].impulses[0] != Vector::ZERO);
    assert!(world.bodies[hit.body].linvel().x > -4.0);
    [start, Totals::of(&world)]
}

#[test]
fn an_off_centre_hit_on_a_spinning_top_conserves_all() {
    let [start, end] = off_centre(1.0);
    start.assert_kept(&end, 16.0);
    let [start, end] = off_centre(0.0);
    start.assert_momenta_kept(&end, 16.0);
    assert!(end.energy < 0.99 * start.energy, "an inelastic hit");
}

/// Fails if some pair still approaches, by more than rounding.
#[track_caller]
fn assert_none_approaches(fields: &mut Fields, world: &mut PhysicsWorld) {
    step(fields, world);
    for contact in fields.contacts() {
        let approach = to_f64(contact.approach_speed);
        assert_at_most(approach, 8.0 * rounding(), "approach");
    }
}

#[test]
fn connected_contacts_are_all_resolved() {
    let row = [-0.9, 0.0, 0.9].map(|x| Vector::X * from_f64(x));
    let fork = [
        Vector::ZERO,
        Vector::new(0.8, 0.45, 0.0),
        Vector::new(0.8, -0.45, 0.0),
    ];
    let mut scattered = Vec::new();
    for (places, mover) in [(row, 0), (row, 2), (fork, 0)] {
        let mut world = still_arena();
        let things = [0, 1, 2].map(|i| {
            let speed = if i == mover { 2.0 } else { 0.0 };
            let towards = (places[1] - places[i]).normalize_or_zero();
            let towards = if places == fork { Vector::X } else { towards };
            ball(&mut world, 1.0, places[i], towards * speed)
        });
        let [a, b, c] = &things;
        let mut fields = detect(&[a, b, c], ELASTIC);
        let start = Totals::of(&world);
        step(&mut fields, &mut world);
        start.assert_kept(&Totals::of(&world), 16.0);
        scattered.push(things.map(|thing| linvel(&world, &thing)));
        assert_none_approaches(&mut fields, &mut world);
    }
    let cradle = [Vector::ZERO, Vector::ZERO, Vector::X * 2.0];
    for (found, expected) in scattered[0].iter().zip(cradle) {
        assert_near(*found, expected, 2.0 * rounding(), "Newton's cradle");
    }
    let back = [Vector::X * -2.0, Vector::ZERO, Vector::ZERO];
    for (found, expected) in scattered[1].iter().zip(back) {
        assert_near(*found, expected, 2.0 * rounding(), "the other way");
    }
    assert!(scattered[2][1].x > 0.5 && scattered[2][2].x > 0.5);
}

/// The velocity of a ball of unit speed along -x after it has hit the wall.
fn after_wall(wall: RigidBodyBuilder, law: ContactLaw) -> (Vector, Sides) {
    let mut world = still_arena();
    let slab = ColliderBuilder::cuboid(1.0, 5.0, 5.0).translation(Vector::X * -1.0);
    let wall = insert(&mut world, wall, [slab]);
    let met = ball(&mut world, 2.0, Vector::new(0.45, 0.5, 0.0), -Vector::X);
    let mut fields = detect(&[&wall, &met], law);
    assert_eq!(step(&mut fields, &mut world), 1);
    let contact = fields.contacts()[0];
    let sides = Sides {
        normal: contact.world_normal,
        impulses: contact.impulses,
        wall: linvel(&world, &wall),
    };
    (linvel(&world, &met), sides)
}

struct Sides {
    normal: Vector,
    impulses: [Vector; 2],
    wall: Vector,
}

#[test]
fn balls_bounce_off_fixed_and_moving_walls() {
    let (after, sides) = after_wall(RigidBodyBuilder::fixed(), ELASTIC);
    assert_near(after, Vector::X, rounding(), "off a fixed wall");
    assert_near(sides.normal, Vector::X, rounding(), "from wall to ball");
    let push = Vector::X * 4.0;
    assert_near(sides.impulses[1], push, 4.0 * rounding(), "on the ball");
    assert_eq!(sides.impulses[0], -sides.impulses[1]);

    let moving = || RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::X * 3.0);
    let (after, sides) = after_wall(moving(), ELASTIC);
    assert_near(after, Vector::X * 7.0, 4.0 * rounding(), "off a moving one");
    assert_eq!(sides.wall, Vector::X * 3.0);
    let (after, _) = after_wall(moving(), newton(0.0));
    assert_near(after, Vector::X * 3.0, 4.0 * rounding(), "carried along");
}

#[test]
fn locked_axes_stay_locked() {
    let mut world = still_arena();
    let locked = RigidBodyBuilder::dynamic().locked_axes(LockedAxes::TRANSLATION_LOCKED_X);
    let rail = insert_ball(&mut world, locked.can_sleep(false), 1.0);
    let place = Vector::new(-0.6, 0.6, 0.0);
    let hit = ball(&mut world, 1.0, place, Vector::new(2.0, -1.0, 0.0));
    let mut fields = detect(&[&rail, &hit], ELASTIC);
    let before = Totals::of(&world).energy;
    step(&mut fields, &mut world);
    let after = linvel(&world, &rail);
    assert!(after.x == 0.0 && after.y < 0.0, "{after}");
    assert_close(
        Totals::of(&world).energy,
        before,
        8.0 * rounding(),
        "energy",
    );
}

#[test]
fn a_body_held_in_place_is_turned() {
    let mut world = still_arena();
    let held = RigidBodyBuilder::dynamic().locked_axes(LockedAxes::TRANSLATION_LOCKED);
    let wheel = asymmetric(&mut world, held, 2.0);
    let place = Vector::new(1.2, 1.0, 0.0);
    let hit = ball(&mut world, 1.0, place, Vector::Y * -3.0);
    let mut fields = detect(&[&wheel, &hit], ELASTIC);
    let before = Totals::of(&world).energy;
    assert_eq!(step(&mut fields, &mut world), 1);
    let wheel = &world.bodies[wheel.body];
    assert!(wheel.angvel().z < -0.1, "{}", wheel.angvel());
    assert_eq!(wheel.linvel(), Vector::ZERO);
    assert_close(
        Totals::of(&world).energy,
        before,
        8.0 * rounding(),
        "energy",
    );
}

/// The velocities of two spheres after a step under the paper's rule, and the totals before and after it.
fn after_paper(velocities: [Vector; 2], masses: [Real; 2]) -> ([Vector; 2], [Totals; 2]) {
    let (mut world, [a, b]) = overlapping(velocities, masses);
    let mut fields = detect(&[&a, &b], ContactLaw::Paper);
    let start = Totals::of(&world);
    assert_eq!(step(&mut fields, &mut world), 1);
    let after = [linvel(&world, &a), linvel(&world, &b)];
    (after, [start, Totals::of(&world)])
}

#[test]
fn the_papers_rule_adds_a_bodys_own_speed_along_the_normal() {
    let oblique = [Vector::new(3.0, 4.0, 0.0), Vector::new(-1.0, 0.0, 2.0)];
    let (after, [start, end]) = after_paper(oblique, [1.0, 2.5]);
    for (i, outward) in [-Vector::X, Vector::X].into_iter().enumerate() {
        let expected = oblique[i] + outward * oblique[i].length();
        assert_near(after[i], expected, 4.0 * rounding(), "its own speed");
    }
    let lost = start.momentum.distance(end.momentum);
    assert_close(lost, 2.5 * 5_f64.sqrt() - 5.0, 1e-5, "momentum made");

    let (after, [start, end]) = after_paper([Vector::X, -Vector::X], [2.0; 2]);
    for after in after {
        assert_near(after, Vector::ZERO, rounding(), "mirrored balls stop dead");
    }
    start.assert_momenta_kept(&end, 8.0);

    let (after, _) = after_paper([Vector::X * 2.0, Vector::ZERO], [1.0; 2]);
    let none = "a ball that hits one at rest stops, and does not move it";
    assert!(after.iter().all(|v| v.length() < 1e-5), "{none}: {after:?}");
}

#[test]
fn observers_change_nothing() {
    let velocities = [Vector::new(1.0, 0.5, 0.0), -Vector::X];
    let (mut world, [a, b]) = overlapping(velocities, [1.0; 2]);
    let (mut alone, _) = overlapping(velocities, [1.0; 2]);
    let mut fields = detect(&[&a, &b], ContactLaw::Observe);
    for number in 0..10 {
        let outcome = fields.step(&mut world).expect("a step");
        alone.step();
        assert_eq!((outcome.contacts, outcome.written), (1, 0), "{number}");
        for thing in [&a, &b] {
            let (ours, theirs) = (&world.bodies[thing.body], &alone.bodies[thing.body]);
            assert_eq!(ours.position(), theirs.position(), "Rapier's answer stands");
            assert_eq!(ours.linvel(), theirs.linvel());
        }
        assert_eq!(fields.contacts()[0].impulses, [Vector::ZERO; 2]);
    }
}

/// The velocities along x after two elastic balls met, and the impulse of the fields.
fn answered_by(responder: Responder) -> ([f64; 2], f64) {
    let mut world = arena(from_f64(1.0 / 256.0));
    let things = [-1.0, 1.0].map(|side: Real| {
        let body = RigidBodyBuilder::dynamic().linvel(Vector::X * -side);
        let body = body.translation(Vector::X * side).can_sleep(false);
        let part = ColliderBuilder::ball(0.5).mass(1.0).restitution(1.0);
        insert(&mut world, body, [part])
    });
    let tree = touch(parts(&[&things[0], &things[1]]), newton(0.5));
    let mut fields = Fields::builder(tree).responder(responder).build().unwrap();
    let mut pushed = 0.0;
    for _ in 0..256 {
        step(&mut fields, &mut world);
        let contacts = fields.contacts().iter();
        pushed += contacts.map(|c| to_f64(c.impulses[1].x)).sum::<f64>();
    }
    let after = things.map(|thing| to_f64(linvel(&world, &thing).x));
    (after, pushed)
}

#[test]
fn only_the_chosen_responder_resolves_contacts() {
    let (after, pushed) = answered_by(Responder::Rapier);
    assert_eq!(pushed, 0.0);
    assert_close(after[1], 1.0, 1e-2, "Rapier's own restitution");
    let (after, pushed) = answered_by(Responder::Fields);
    assert_close(pushed, 1.5, 4.0 * rounding(), "only the fields");
    assert_close(after[1], 0.5, 4.0 * rounding(), "the fields' restitution");
    let (after, _) = answered_by(Responder::Both);
    assert!(after[1] > 0.4 && after[0] < -0.4, "{after:?}");
}

#[test]
fn a_ball_on_a_floor_without_a_field_is_detected_and_held() {
    let mut world = arena(from_f64(1.0 / 120.0));
    world.gravity = Vector::Y * -9.81;
    let slab = ColliderBuilder::cuboid(5.0, 0.5, 5.0).translation(Vector::Y * -0.5);
    let floor = insert(&mut world, RigidBodyBuilder::fixed(), [slab]);
    let resting = ball(&mut world, 1.0, Vector::Y * 0.499, Vector::ZERO);
    let mut fields = detect(&[&resting], ELASTIC);
    for _ in 0..240 {
        assert_eq!(step(&mut fields, &mut world), 1, "a slab without a field");
        assert_eq!(fields.contacts()[0].has_field, [false, true]);
    }
    let height = to_f64(world.bodies[resting.body].translation().y);
    assert_close(height, 0.5, 0.01, "it lies on the floor");
    let groups = |part: ColliderHandle| world.colliders[part].solver_groups();
    assert_eq!(groups(resting.parts[0]), InteractionGroups::all());
    assert_eq!(groups(floor.parts[0]), InteractionGroups::all());
}
