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

/// A field pulls one ball of a pair, which cannot move as the field alone would move it.
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
            let pull = Field::uniform(Vector::X * -0.05).force_mode(ForceMode::Acceleration);
            let mut fields = build(pull.groups(only(Group::GROUP_1)), scheme);
            for _ in 0..240 {
                fields.step(&mut world).expect("a step");
            }
            let mean = pair.iter().map(|it| world.bodies[*it].translation().x);
            let way = to_f64(mean.sum::<Real>() * -0.5);
            assert_at_most(
                (way - 0.2).abs(),
                0.01,
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

/// The velocities along y of a ball after each of three steps in a field, while all others sleep. The ball was woken
/// and moved there, inserted in place of a removed body, or added.
fn arrived(sleepers: usize, how: &str, field: &Field, scheme: Scheme) -> [Real; 3] {
    let mut world = weightless(1.0 / 60.0);
    let ball = |place: Vector| RigidBodyBuilder::dynamic().translation(place);
    let shape = || ColliderBuilder::ball(0.5).mass(1.0);
    let (first, _) = world.insert(ball(Vector::X * -20.0), shape());
    for k in 0..sleepers {
        world.insert(ball(Vector::Y * (50.0 + 2.0 * k as Real)), shape());
    }
    world.bodies.iter_mut().for_each(|(_, body)| body.sleep());
    let mut fields = build(field.clone().at(Vector::X * 20.0), scheme);
    for _ in 0..5 {
        fields.step(&mut world).expect("a step");
    }
    let place = Vector::X * 20.0;
    let body = match how {
        "woken" => {
            world.bodies[first].set_translation(place, true);
            first
        }
        "swapped" => {
            world.remove_body(first);
            world.insert(ball(place), shape()).0
        }
        _ => world.insert(ball(place), shape()).0,
    };
    [0; 3].map(|_| {
        fields.step(&mut world).expect("a step");
        world.bodies[body].linvel().y
    })
}

/// Where most bodies slept, a body that was woken or swapped between two steps missed all fields for one step.
#[test]
fn a_body_that_wakes_among_sleepers_misses_no_field() {
    let zone = Region::ball(5.0);
    let push = Field::uniform(Vector::Y * 12.0).within(zone.clone());
    let parts = push.clone().sampled(Sampling::Volume);
    let wind = Field::wind(Vector::Y * 3.0, 2.0, 0.0).within(zone.clone());
    let storm = Field::wind(Vector::Y * 3.0, 1e5, 0.0).within(zone);
    for (name, field) in [
        ("push", push),
        ("parts", parts),
        ("wind", wind),
        ("storm", storm),
    ] {
        for scheme in SCHEMES {
            for how in ["woken", "swapped", "added"] {
                let few = arrived(0, how, &field, scheme);
                let many = arrived(1000, how, &field, scheme);
                for (few, many) in few.iter().zip(many) {
                    let off = to_f64((few - many).abs()) / to_f64(few.abs());
                    assert_at_most(
                        off,
                        1e-3,
                        format!("{name}, {scheme:?}, {how}: {few}, {many}"),
                    );
                }
            }
        }
    }
}

/// The positions and velocities of a box that tumbles over the floor under a force and on a spring, beside this
/// number of sleeping boxes.
fn tumbled(sleepers: usize, scheme: Scheme) -> Vec<[Vector; 3]> {
    let mut world = PhysicsWorld::new();
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    world.insert(floor, ColliderBuilder::cuboid(60.0, 0.5, 60.0));
    let body = RigidBodyBuilder::dynamic()
        .translation(Vector::new(0.0, 1.0, 0.0))
        .angvel(Vector::new(1.0, 0.5, -2.0));
    let shape = ColliderBuilder::cuboid(0.3, 0.2, 0.25).restitution(0.7);
    let (body, _) = world.insert(body, shape);
    for number in 0..sleepers {
        let place = [number % 16, number / 16].map(|n| 20.0 + 2.0 * n as Real);
        let sleeper = RigidBodyBuilder::dynamic()
            .translation(Vector::new(place[0], 0.2, place[1]))
            .sleeping(true);
        world.insert(sleeper, ColliderBuilder::cuboid(0.3, 0.2, 0.25));
    }
    let near = Region::ball(15.0);
    let push = Field::uniform(Vector::X * 0.5).within(near.clone());
    let spring = Field::spring(2.0).within(near).at(Vector::Y * 0.5);
    let mut fields = build(push.sum_union(spring), scheme);
    let step = |_| {
        fields.step(&mut world).expect("a step");
        let body = &world.bodies[body];
        [body.translation(), body.linvel(), body.angvel()]
    };
    (0..300).map(step).collect()
}

/// Beside many sleepers, contacts are looked up for bodies that are awake only.
#[test]
fn sleepers_elsewhere_change_no_bit() {
    for scheme in SCHEMES {
        assert_eq!(tumbled(0, scheme), tumbled(300, scheme), "{scheme:?}");
    }
}

#[test]
fn a_fraction_that_is_no_number_or_negative_is_refused() {
    for fraction in [Real::NAN, -1.0] {
        let policy = WakePolicy::OnChange { fraction };
        let built = Fields::builder(Field::uniform(Vector::X))
            .wake(policy)
            .build();
        let error = built.err().expect("the fraction").to_string();
        assert!(error.contains("the wake policy"), "{error}");
        let mut fields = Fields::new(Field::uniform(Vector::X)).expect("a valid tree");
        fields.settings.wake = policy;
        let error = fields.step(&mut PhysicsWorld::new());
        assert!(matches!(error, Err(StepError::Setting(_))), "{error:?}");
    }
}

/// What carries a field past sleepers.
#[derive(Clone, Copy, Debug)]
enum Carrier {
    Thrown,
    Moved,
    Led,
}

impl Carrier {
    fn insert(self, world: &mut PhysicsWorld) -> RigidBodyHandle {
        let body = match self {
            Carrier::Thrown => RigidBodyBuilder::dynamic().additional_mass(1.0),
            Carrier::Moved => RigidBodyBuilder::kinematic_velocity_based(),
            Carrier::Led => RigidBodyBuilder::kinematic_position_based(),
        };
        let linvel = match self {
            Carrier::Led => Vector::ZERO,
            _ => Vector::X * 10.0,
        };
        world.insert_body(body.linvel(linvel).translation(Vector::X * -2.0))
    }
}

/// Fields that act within one metre, or everywhere, of a body. One of them depends on velocities.
fn carried(by: RigidBodyHandle) -> [Tree; 5] {
    let ball = Region::ball(1.0);
    let shell = Field::uniform(Vector::Y).within(ball.clone());
    let core = Field::uniform(Vector::Y * -5.0).within(Region::ball(0.3));
    let composite = shell.clone().replace_union(core);
    [
        shell.at(by).into(),
        Tree::instances(composite, [by]),
        Field::radial(1.0, -2.0).within(ball.clone()).at(by).into(),
        Field::wind(Vector::Y * 3.0, 1.0, 0.0)
            .within(ball)
            .at(by)
            .into(),
        Field::radial(1.0, -2.0).at(by).into(),
    ]
}

/// Balls in a row fall asleep while a field comes along: some before it, some in the very step in which it arrives.
#[test]
fn a_field_that_comes_along_wakes_sleepers() {
    for carrier in [Carrier::Thrown, Carrier::Moved, Carrier::Led] {
        for number in 0..5 {
            for scheme in SCHEMES {
                let mut world = weightless(1.0 / 60.0);
                let by = carrier.insert(&mut world);
                let place = |k: usize| Vector::new(0.25 * k as Real, 0.0, 0.5);
                let balls: Vec<_> = (0..60)
                    .map(|k| {
                        let ball = ColliderBuilder::ball(0.01).mass(1.0);
                        let body = RigidBodyBuilder::dynamic().translation(place(k));
                        world.insert(body, ball).0
                    })
                    .collect();
                let mut fields = build(carried(by)[number].clone(), scheme);
                let mut asleep = 0;
                for step in 0..120 {
                    let next = Vector::X * ((step + 1) as Real / 6.0 - 2.0);
                    world.bodies[by].set_next_kinematic_translation(next);
                    fields.step(&mut world).expect("a step");
                    let sleeps = |ball: &&RigidBodyHandle| world.bodies[**ball].is_sleeping();
                    asleep = asleep.max(balls.iter().filter(sleeps).count());
                }
                // The field without a border keeps all awake.
                assert_eq!(asleep > 30, number < 4, "{carrier:?}, {number}, {scheme:?}");
                for (k, ball) in balls.iter().enumerate() {
                    let moved = world.bodies[*ball].translation() != place(k);
                    assert!(moved, "{carrier:?}, {number}, {scheme:?}: ball {k}");
                }
            }
        }
    }
}

/// Returns whether a box that sleeps on a floor wakes while a body that carries a field flies past, two metres above.
fn wakes_below(field: impl Fn(RigidBodyHandle) -> Tree, gravity: Real) -> bool {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::Y * -gravity;
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    world.insert(floor, ColliderBuilder::cuboid(9.0, 0.5, 9.0));
    let sleeper = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5);
    let cube = ColliderBuilder::cuboid(0.5, 0.5, 0.5);
    let (sleeper, _) = world.insert(sleeper, cube);
    (0..60).for_each(|_| world.step());
    assert!(world.bodies[sleeper].is_sleeping());
    let by = RigidBodyBuilder::kinematic_velocity_based().translation(Vector::new(-4.0, 2.5, 0.0));
    let by = world.insert_body(by.linvel(Vector::X * 4.0));
    let mut fields = Fields::new(field(by)).expect("a valid tree");
    (0..120).any(|_| {
        fields.step(&mut world).expect("a step");
        !world.bodies[sleeper].is_sleeping()
    })
}

/// Beside the weight that holds a sleeper in place, small changes of a force that acted before do not count.
#[test]
fn a_field_that_comes_along_wakes_by_its_share_of_the_weight() {
    let pull = |strength: Real| move |by| Field::radial(strength, -2.0).at(by).into();
    let within = |by| {
        let weak = Field::radial(1e-3, -2.0).within(Region::ball(3.0));
        weak.at(by).into()
    };
    // At the nearest 2 m the first two pull with 0.0008 and 0.1 of the weight.
    assert!(!wakes_below(pull(0.03), 9.81));
    assert!(wakes_below(pull(4.0), 9.81));
    assert!(wakes_below(pull(0.03), 0.0));
    assert!(wakes_below(within, 9.81));
}
