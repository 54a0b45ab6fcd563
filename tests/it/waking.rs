//! When fields wake sleeping bodies, and what sleepers change for others.

use rapier3d_fields::math::{Real, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{assert_at_most, build, weightless};

const SCHEMES: [Scheme; 3] = [Scheme::KickDriftKick, Scheme::Kick, Scheme::auto(1e-3)];

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
    for (carrier, limit) in [
        (Carrier::Thrown, 400.0),
        (Carrier::Moved, 400.0),
        (Carrier::Led, 400.0),
        (Carrier::Thrown, Real::INFINITY),
    ] {
        for number in 0..5 {
            for scheme in SCHEMES {
                let mut world = weightless(1.0 / 60.0);
                world.integration_parameters.normalized_max_linear_velocity = limit;
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
                let case = format!("{carrier:?}, {limit} m/s, {number}, {scheme:?}");
                assert_eq!(asleep > 30, number < 4, "{case}");
                for (k, ball) in balls.iter().enumerate() {
                    let moved = world.bodies[*ball].translation() != place(k);
                    assert!(moved, "{case}: ball {k}");
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

/// A ball sleeps in one place and then in another. An edit that does not concern it is compared with the later sleep.
#[test]
fn an_earlier_sleep_elsewhere_is_forgotten() {
    for scheme in SCHEMES {
        let mut world = PhysicsWorld::new();
        let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
        world.insert(floor, ColliderBuilder::cuboid(20.0, 0.5, 20.0));
        let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5);
        let ball = ColliderBuilder::ball(0.5).mass(1.0);
        let (body, _) = world.insert(body.lock_rotations(), ball);
        let mut fields = build(Field::radial(20.0, -1.0).at(Vector::Y * 20.0), scheme);
        let sleep = |world: &mut PhysicsWorld, fields: &mut Fields| {
            for _ in 0..180 {
                fields.step(world).expect("a step");
            }
            assert!(world.bodies[body].is_sleeping(), "{scheme:?}");
        };
        sleep(&mut world, &mut fields);
        world.bodies[body].set_linvel(Vector::X * 6.0, true);
        sleep(&mut world, &mut fields);
        assert!(world.bodies[body].translation().x > 2.0);
        let elsewhere = Field::uniform(Vector::X).within(Region::ball(1.0));
        fields.set.insert(elsewhere.at(Vector::Y * -90.0));
        for _ in 0..3 {
            fields.step(&mut world).expect("a step");
            assert!(world.bodies[body].is_sleeping(), "{scheme:?}");
        }
    }
}

/// A field that changes with time by itself wakes a body that fell asleep while it was weak.
#[test]
fn fields_that_change_with_time_wake_sleepers() {
    let grows = Scalar::time().ramp(1.5, 9.0);
    let step = Region::interval(Axis::Time, 1.5, 9.0);
    let fields = [
        Field::uniform(Vector::X * 20.0).scaled_by(grows),
        Field::uniform(Vector::X * 20.0).within(step),
        Field::uniform(Vector::X * 20.0).lifetime(Lifetime::between(1.5, 9.0)),
        Field::closure([Axis::Time], |sample: &Sample| {
            Vector::X * (20.0 * (sample.axes[0] - 1.5).max(0.0))
        }),
    ];
    for (number, field) in fields.into_iter().enumerate() {
        for scheme in SCHEMES {
            let mut world = weightless(1.0 / 60.0);
            let ball = ColliderBuilder::ball(0.01).mass(1.0);
            let (body, _) = world.insert(RigidBodyBuilder::dynamic(), ball);
            let mut fields = build(field.clone(), scheme);
            let mut slept = false;
            for _ in 0..120 {
                fields.step(&mut world).expect("a step");
                slept |= world.bodies[body].is_sleeping();
            }
            let place = format!("{number}, {scheme:?}");
            assert!(slept, "{place}");
            assert!(world.bodies[body].translation().x > 0.0, "{place}");
        }
    }
}
