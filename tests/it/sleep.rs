//! Bodies at their terminal velocity stay awake until they arrive, although the forces on them balance; bodies that
//! rest on something sleep.

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::control::{DynamicRayCastVehicleController, WheelTuning};

use crate::support::{assert_at_most, build, weightless};

const G: Real = 9.81;
const SCHEMES: [Scheme; 3] = [Scheme::KickDriftKick, Scheme::Kick, Scheme::auto(1e-3)];

/// A world under gravity, with a floor whose top is at y = −6.
fn basin() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::Y * -G;
    let floor = ColliderBuilder::cuboid(20.0, 1.0, 20.0);
    world.insert(
        RigidBodyBuilder::fixed().translation(Vector::Y * -7.0),
        floor,
    );
    world
}

/// Water from the floor up to y = 0, in which a speed halves in about a third of a second.
fn water() -> Tree {
    Tree::pool(Vector::ZERO, Vector::new(20.0, 3.0, 20.0), 1000.0, G, 2.0)
}

fn ball(world: &mut PhysicsWorld, place: Vector, density: Real) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic().translation(place);
    world
        .insert(body, ColliderBuilder::ball(0.25).density(density))
        .0
}

/// How the floating bodies are joined.
#[derive(Clone, Copy, Debug)]
enum Float {
    Single,
    Jointed,
    Articulated,
}

impl Float {
    /// Inserts one ball or two at a height, and returns them all.
    fn insert(self, world: &mut PhysicsWorld, height: Real, density: Real) -> Vec<RigidBodyHandle> {
        let mut at = |x| ball(world, Vector::new(x, height, 0.0), density);
        let joint = SphericalJointBuilder::new()
            .local_anchor1(Vector::X * 0.3)
            .local_anchor2(Vector::X * -0.3);
        match self {
            Float::Single => vec![at(0.0)],
            Float::Jointed => {
                let pair = [at(-0.3), at(0.3)];
                world.impulse_joints.insert(pair[0], pair[1], joint, true);
                pair.into()
            }
            Float::Articulated => {
                let pair = [at(-0.3), at(0.3)];
                world.multibody_joints.insert(pair[0], pair[1], joint, true);
                pair.into()
            }
        }
    }
}

/// A ball of density 1050 fell asleep in mid-water, jointed balls of density 950 at step 30, ten metres down: a slow
/// body whose forces balance was taken for one at rest, and jointed bodies were not checked.
#[test]
fn bodies_that_sink_or_rise_stay_awake_until_they_arrive() {
    for scheme in SCHEMES {
        for float in [Float::Single, Float::Jointed, Float::Articulated] {
            // 4.75 m at the terminal velocities, g/2 times 0.01 and 0.05.
            for (density, from, to, rate, seconds) in [
                (1010.0, -1.0, -5.75, 60.0, 120.0),
                (990.0, -5.0, -0.0, 60.0, 120.0),
                (1050.0, -1.0, -5.75, 60.0, 30.0),
                (950.0, -5.0, -0.0, 60.0, 30.0),
                (1050.0, -1.0, -5.75, 240.0, 30.0),
            ] {
                let mut world = basin();
                world.integration_parameters.dt = from_f64(1.0 / rate);
                let bodies = float.insert(&mut world, from, density);
                let mut fields = build(water(), scheme);
                for _ in 0..(seconds * rate) as usize {
                    fields.step(&mut world).expect("a step");
                }
                for body in bodies {
                    let body = &world.bodies[body];
                    let off = to_f64(body.translation().y) - to_f64(to);
                    let what = format!(
                        "{scheme:?}, {float:?}, {density}, {rate} Hz: {}",
                        body.translation()
                    );
                    assert_at_most(off.abs(), 0.26, format_args!("{what}"));
                    // `Kick` adds the buoyancy of a step at once, as an impulse, while gravity acts over the course of
                    // the step: at the bottom a single ball bounces by some millimetres.
                    let bobs = matches!((scheme, float), (Scheme::Kick, Float::Single));
                    assert!(body.is_sleeping() || bobs, "{what}");
                }
            }
        }
    }
}

/// A ball that fell in air at its terminal velocity of 0.054 m/s fell asleep.
#[test]
fn a_ball_at_its_terminal_velocity_stays_awake() {
    for scheme in SCHEMES {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::Y * -G;
        let body = ball(&mut world, Vector::ZERO, 1.0);
        let rate = G / 0.054;
        let drag = Field::drag(rate, 0.0).force_mode(ForceMode::Acceleration);
        let mut fields = build(drag, scheme);
        for _ in 0..600 {
            fields.step(&mut world).expect("a step");
        }
        let fallen = to_f64(world.bodies[body].translation().y) / (-0.054 * 10.0);
        assert_at_most(
            (fallen - 1.0).abs(),
            0.01,
            format_args!("{scheme:?}: {fallen}"),
        );
    }
}

/// Parks a car with four wheels for 15 s: the step after which it slept, and how far it moved after the first second.
fn park(wind: Option<Scheme>) -> (Option<usize>, f64) {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::Y * -G;
    let floor = ColliderBuilder::cuboid(50.0, 0.5, 50.0).translation(Vector::Y * -0.5);
    world.colliders.insert(floor);
    let push = Vector::X * 2.5;
    let chassis = RigidBodyBuilder::dynamic().translation(Vector::Y * 1.0);
    let box_ = ColliderBuilder::cuboid(1.0, 0.25, 0.5).mass(10.0);
    let (chassis, _) = world.insert(chassis, box_);
    let mut fields = wind.map(|scheme| build(Field::uniform(push), scheme));
    if fields.is_none() {
        world.bodies[chassis].add_force(push, true);
    }
    let mut vehicle = DynamicRayCastVehicleController::new(chassis);
    let tuning = WheelTuning {
        suspension_stiffness: 80.0,
        suspension_damping: 10.0,
        ..WheelTuning::default()
    };
    for (x, z) in [(-0.8, -0.5), (-0.8, 0.5), (0.8, -0.5), (0.8, 0.5)] {
        let place = Vector::new(x, 0.0, z);
        vehicle.add_wheel(place, -Vector::Y, Vector::Z, 0.4, 0.25, &tuning);
    }
    for wheel in vehicle.wheels_mut() {
        wheel.brake = 5.0;
    }
    let (mut asleep, mut settled) = (None, Vector::ZERO);
    for step in 0..900 {
        let dt = world.integration_parameters.dt;
        let queries = world.broad_phase.as_query_pipeline_mut(
            world.narrow_phase.query_dispatcher(),
            &mut world.bodies,
            &mut world.colliders,
            QueryFilter::default().exclude_rigid_body(chassis),
        );
        vehicle.update_vehicle(dt, queries);
        match &mut fields {
            Some(fields) => drop(fields.step(&mut world).expect("a step")),
            None => world.step(),
        }
        let body = &world.bodies[chassis];
        if body.is_sleeping() {
            asleep = asleep.or(Some(step));
        }
        if step == 60 {
            settled = body.translation();
        }
    }
    let moved = world.bodies[chassis].translation() - settled;
    (asleep, to_f64(moved.length()))
}

/// A parked car in a steady wind never slept and crept 0.15 m in 15 s, while it sleeps under the same force of the
/// user: the wheels of a vehicle were not counted as contacts.
#[test]
fn a_parked_car_sleeps_in_the_wind() {
    let (alone, crept) = park(None);
    for scheme in SCHEMES {
        let (asleep, moved) = park(Some(scheme));
        let (alone, asleep) = (alone.expect("asleep"), asleep.expect("asleep in the wind"));
        assert!(asleep <= alone + 30, "{scheme:?}: {asleep} after {alone}");
        assert_at_most(moved, crept.max(0.01), format_args!("{scheme:?}"));
    }
}

/// Two jointed balls that a weak uniform field accelerates from rest fell asleep after half a second.
#[test]
fn jointed_bodies_in_a_weak_field_stay_awake() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let bodies = Float::Jointed.insert(&mut world, 0.0, 1000.0);
        let pull = Field::uniform(Vector::Y * 0.05).force_mode(ForceMode::Acceleration);
        let mut fields = build(pull, scheme);
        for _ in 0..240 {
            fields.step(&mut world).expect("a step");
        }
        for body in bodies {
            let way = to_f64(world.bodies[body].translation().y);
            assert_at_most((way - 0.4).abs(), 0.01, format_args!("{scheme:?}: {way}"));
        }
    }
}

/// A field pulls the lighter ball of a pair, which moves by a quarter of what the field alone would give it.
#[test]
fn a_pair_of_which_a_field_pulls_one_stays_awake() {
    let only = |group| InteractionGroups::new(group, group, InteractionTestMode::And);
    for scheme in SCHEMES {
        for float in [Float::Jointed, Float::Articulated] {
            let mut world = weightless(1.0 / 60.0);
            let pair = float.insert(&mut world, 0.0, 1000.0);
            for (body, group) in pair.iter().zip([Group::GROUP_1, Group::GROUP_2]) {
                let collider = world.bodies[*body].colliders()[0];
                world.colliders[collider].set_collision_groups(only(group));
            }
            let heavier = world.bodies[pair[1]].colliders()[0];
            world.colliders[heavier].set_density(3000.0);
            let pull = Field::uniform(Vector::X * -0.05).force_mode(ForceMode::Acceleration);
            let mut fields = build(pull.groups(only(Group::GROUP_1)), scheme);
            for _ in 0..240 {
                fields.step(&mut world).expect("a step");
            }
            let mean = pair.iter().map(|it| world.bodies[*it].translation().x);
            let way = to_f64(mean.sum::<Real>() * -0.5);
            assert_at_most(
                (way - 0.1).abs(),
                5e-4,
                format!("{scheme:?}, {float:?}: {way}"),
            );
        }
    }
}

/// Forces on two bodies balance through the joint between them, although each alone would accelerate.
#[test]
fn a_pair_that_a_field_presses_onto_its_joint_falls_asleep() {
    for scheme in SCHEMES {
        for articulated in [false, true] {
            let mut world = weightless(1.0 / 60.0);
            let pair = [-1.0, 1.0].map(|x| ball(&mut world, Vector::X * x, 1000.0));
            let joint = FixedJointBuilder::new().local_anchor1(Vector::X * 2.0);
            if articulated {
                let link = world.multibody_joints.insert(pair[0], pair[1], joint, true);
                link.expect("a chain");
            } else {
                world.impulse_joints.insert(pair[0], pair[1], joint, true);
            }
            let mut fields = build(Field::spring(20.0), scheme);
            for _ in 0..300 {
                fields.step(&mut world).expect("a step");
            }
            for body in pair.map(|it| &world.bodies[it]) {
                let off = to_f64(body.translation().length() - 1.0).abs();
                assert!(
                    body.is_sleeping() && off < 1e-6,
                    "{scheme:?}, {articulated}: {off} {}",
                    body.linvel()
                );
            }
        }
    }
}

/// A raft fell asleep 10.3 s after its launch, and after 48 s in water with a drag rate of 1/s: a body that moved by
/// more than a rounding was kept awake.
#[test]
fn floats_that_bob_fall_asleep() {
    let raft = || SharedShape::cuboid(1.0, 0.25, 1.0);
    let buoy = || SharedShape::ball(0.5);
    // The heights at which six tenths of the volume are under water.
    let barge = || SharedShape::cuboid(4.0, 0.5, 4.0);
    let floats = [(raft(), -0.05), (buoy(), -0.06707), (barge(), -0.1)];
    for scheme in SCHEMES {
        for (shape, height) in &floats {
            // At most 7.8 and 30.9 s were measured in f32.
            for (slowed, seconds) in [(5.0, 9.0), (1.0, 36.0)] {
                let mut world = basin();
                let start = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5);
                let collider = ColliderBuilder::new(shape.clone()).density(600.0);
                let (float, _) = world.insert(start, collider);
                let half = Vector::new(20.0, 3.0, 20.0);
                let mut fields = build(Tree::pool(Vector::ZERO, half, 1000.0, G, slowed), scheme);
                let mut time = 0.0;
                while !world.bodies[float].is_sleeping() {
                    fields.step(&mut world).expect("a step");
                    time += 1.0 / 60.0;
                    assert!(time < seconds, "{scheme:?}, {slowed}: awake");
                }
                // A tenth of Rapier's allowed error, plus the last digit of the heights above.
                let off = to_f64(world.bodies[float].translation().y) - height;
                assert_at_most(off.abs(), 5.1e-4, format_args!("{scheme:?}, {slowed}"));
            }
        }
    }
}

/// A log that slowly falls over hardly bobs, and must not fall asleep on the way.
#[test]
fn a_log_that_falls_over_lies_flat_before_it_sleeps() {
    let mut world = basin();
    let start = RigidBodyBuilder::dynamic().translation(Vector::Y);
    let log = ColliderBuilder::capsule_y(0.5, 0.3).density(600.0);
    let (log, _) = world.insert(start, log);
    let half = Vector::new(20.0, 3.0, 20.0);
    let pool = Tree::pool(Vector::ZERO, half, 1000.0, G, 5.0);
    let mut fields = build(pool, Scheme::KickDriftKick);
    world.bodies[log].set_rotation(Rotation::from_rotation_z(1e-3), true);
    let mut steps = 0;
    while !world.bodies[log].is_sleeping() && steps < 6000 {
        fields.step(&mut world).expect("a step");
        steps += 1;
    }
    let upright = to_f64((world.bodies[log].rotation() * Vector::Y).y.abs());
    assert!(upright < 0.05, "asleep after {steps} steps at {upright}");
}

/// A body that a force shakes by less than a sleeping float may bob fell asleep for one step at each turning point.
#[test]
fn a_body_that_a_force_shakes_stays_awake() {
    let mut world = weightless(1.0 / 60.0);
    let (shaken, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
    // Twice a second, by 6e-5 to either side.
    let shake = |sample: &Sample<'_>| Vector::X * (0.01 * (sample.axes[0] as Real * 12.566).cos());
    let shake = Field::closure([Axis::Time], shake).force_mode(ForceMode::Acceleration);
    let mut fields = build(shake, Scheme::KickDriftKick);
    for step in 0..600 {
        fields.step(&mut world).expect("a step");
        assert!(!world.bodies[shaken].is_sleeping(), "asleep at step {step}");
    }
}
