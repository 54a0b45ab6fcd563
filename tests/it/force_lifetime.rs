//! The lifetime of forces: fields act anew in each step, the user's forces are kept, bodies fall asleep, and changes
//! between steps take effect in the next step.

use rapier3d_fields::math::{Real, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::lab::stability::SCHEMES;
use crate::support::{assert_at_most, assert_close, build, insert_ball, weightless};

/// The tolerance of results that are exact but for some tens of roundings.
fn rounding() -> f64 {
    50.0 * to_f64(Real::EPSILON)
}

fn step(fields: &mut Fields, world: &mut PhysicsWorld) {
    fields.step(world).expect("a finite step");
}

fn linvel(world: &PhysicsWorld, body: RigidBodyHandle) -> Vector {
    world.bodies[body].linvel()
}

/// A field that could act on anything, but is nowhere near.
fn out_of_reach() -> Field {
    let region = Region::ball(1.0);
    Field::spring(5.0).within(region).at(Vector::splat(1e4))
}

// Fields act once a step, for that step.

#[test]
fn a_field_gives_the_same_velocity_in_every_step() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 2.0, Vector::ZERO, Vector::ZERO);
        let mut fields = build(Field::uniform(Vector::Y * 6.0), scheme);
        for count in 1..=20 {
            step(&mut fields, &mut world);
            let expected = f64::from(count) * 3.0 / 60.0;
            let place = format!("{scheme:?}, step {count}");
            // Equal kicks give speeds of 1:2:3; forces that pile up would give 1:3:6.
            assert_close(to_f64(linvel(&world, ball).y), expected, rounding(), place);
        }
    }
}

#[test]
fn fields_act_in_the_first_step() {
    // Rapier computes the mass of a new body in its first step, and ignores impulses before it.
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let body = RigidBodyBuilder::dynamic().additional_mass(2.0);
        let bare = world.bodies.insert(body);
        let mut fields = build(Field::uniform(Vector::Y * 6.0), scheme);
        step(&mut fields, &mut world);
        let expected = 3.0 / 60.0;
        let place = format!("{scheme:?}, a body without colliders");
        assert_close(to_f64(linvel(&world, bare).y), expected, rounding(), place);
    }
}

/// An impulse of the user's between steps adds to the impulses of the fields.
#[test]
fn impulses_between_steps_are_kept() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 2.0, Vector::ZERO, Vector::ZERO);
        let mut fields = build(Field::uniform(Vector::Y * 6.0), scheme);
        step(&mut fields, &mut world);
        world.bodies[ball].apply_impulse(Vector::X * 4.0, true);
        step(&mut fields, &mut world);
        let expected = Vector::new(2.0, 0.1, 0.0);
        let error = (linvel(&world, ball) - expected).length();
        assert_at_most(to_f64(error), rounding() * 2.0, format!("{scheme:?}"));
    }
}

// The user's own forces.

#[test]
fn user_forces_are_the_same_bit_for_bit_after_each_step() {
    for scheme in SCHEMES {
        for size in [0.1, 1e-30, 1e10, 1.0 / 3.0, -0.0] {
            let mut world = weightless(1.0 / 60.0);
            let ball = insert_ball(&mut world, 2.0, Vector::X, Vector::ZERO);
            let force = Vector::new(size, size * -3.7, size / 7.0);
            world.bodies[ball].add_force(force, true);
            world.bodies[ball].add_torque(-force, true);
            let body = &world.bodies[ball];
            let expected = (bits(body.user_force()), bits(body.user_torque()));
            let mut fields = build(Field::spring(3.3), scheme);
            for count in 0..5 {
                step(&mut fields, &mut world);
                let body = &world.bodies[ball];
                let found = (bits(body.user_force()), bits(body.user_torque()));
                assert_eq!(found, expected, "{scheme:?}, {size:e}, step {count}");
            }
        }
    }
}

fn bits(v: Vector) -> [u64; 3] {
    v.to_array().map(|x| to_f64(x).to_bits())
}

/// Position, velocity and angular velocity after ten steps under the user's force and torque.
fn pushed(mut step: impl FnMut(&mut PhysicsWorld)) -> [[u64; 3]; 3] {
    let mut world = weightless(1.0 / 60.0);
    let ball = insert_ball(&mut world, 2.0, Vector::X, Vector::ZERO);
    world.bodies[ball].add_force(Vector::new(0.1, 0.7, -0.3), true);
    world.bodies[ball].add_torque(Vector::new(0.01, 0.02, -0.03), true);
    for _ in 0..10 {
        step(&mut world);
    }
    let body = &world.bodies[ball];
    [body.translation(), body.linvel(), body.angvel()].map(bits)
}

#[test]
fn a_user_force_acts_as_without_fields() {
    let without = pushed(PhysicsWorld::step);
    for scheme in SCHEMES {
        let mut fields = build(out_of_reach(), scheme);
        let with = pushed(|world| step(&mut fields, world));
        assert_eq!(with, without, "{scheme:?}");
    }
}

#[test]
fn a_user_force_and_a_field_add_up() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 2.0, Vector::X, Vector::ZERO);
        world.bodies[ball].add_force(Vector::X * 4.0, true);
        let mut fields = build(Field::uniform(Vector::Y * 6.0), scheme);
        for _ in 0..60 {
            step(&mut fields, &mut world);
        }
        let error = (linvel(&world, ball) - Vector::new(2.0, 3.0, 0.0)).length();
        assert_at_most(to_f64(error), rounding() * 3.0, format!("{scheme:?}"));
    }
}

// Sleep.

/// A box on the ground under a uniform acceleration in place of gravity, and fields that have an
/// axis `lift` that can raise it.
struct Rest {
    world: PhysicsWorld,
    cube: RigidBodyHandle,
    fields: Fields,
}

const DOWN: Vector = Vector::new(0.0, -9.81, 0.0);

fn downward() -> Field {
    Field::uniform(DOWN).force_mode(ForceMode::Acceleration)
}

fn lifting() -> Tree {
    let lift = Field::closure(["lift".into()], |sample: &Sample| {
        Vector::Y * sample.axes[0]
    });
    downward().sum_union(lift)
}

impl Rest {
    /// After four seconds on the ground.
    fn new(scheme: Scheme, wake: WakePolicy) -> Self {
        let mut world = weightless(1.0 / 60.0);
        let ground = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
        world.insert(ground, ColliderBuilder::cuboid(5.0, 0.5, 5.0));
        let cube = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5);
        let (cube, _) = world.insert(cube, ColliderBuilder::cuboid(0.5, 0.5, 0.5).mass(1.0));
        let builder = Fields::builder(lifting()).axis("lift", 0.0);
        let fields = builder.scheme(scheme).wake(wake).build();
        let fields = fields.expect("a valid tree");
        let mut rest = Rest {
            world,
            cube,
            fields,
        };
        rest.steps(240);
        rest
    }

    fn steps(&mut self, count: usize) {
        for _ in 0..count {
            step(&mut self.fields, &mut self.world);
            let cube = &self.world.bodies[self.cube];
            if cube.is_sleeping() {
                // A velocity or force stored in a sleeping body would act when it wakes.
                assert_eq!(cube.linvel(), Vector::ZERO);
                assert_eq!(cube.angvel(), Vector::ZERO);
                assert_eq!(cube.user_force(), Vector::ZERO);
            }
        }
    }

    fn sleeps(&self) -> bool {
        self.world.bodies[self.cube].is_sleeping()
    }

    fn height(&self) -> f64 {
        to_f64(self.world.bodies[self.cube].translation().y)
    }
}

const ON_CHANGE: WakePolicy = WakePolicy::OnChange { fraction: 1e-3 };

#[test]
fn a_body_at_rest_in_a_static_field_sleeps() {
    for scheme in SCHEMES {
        for wake in [ON_CHANGE, WakePolicy::Never] {
            let rest = Rest::new(scheme, wake);
            assert!(rest.sleeps(), "{scheme:?}, {wake:?}");
            // Rapier lets a body sink in by up to 0.001 length units before it pushes back.
            assert_close(rest.height(), 0.5, 2e-3, format!("{scheme:?}, {wake:?}"));
        }
    }
}

#[test]
fn wake_policy_always_keeps_bodies_awake() {
    for scheme in SCHEMES {
        let mut rest = Rest::new(scheme, WakePolicy::Always);
        for _ in 0..60 {
            assert!(!rest.sleeps(), "{scheme:?}");
            rest.steps(1);
        }
        assert_close(rest.height(), 0.5, 2e-3, format!("{scheme:?}"));
    }
}

#[test]
fn a_changed_axis_wakes_under_on_change_and_not_under_never() {
    for scheme in SCHEMES {
        for (wake, wakes) in [(ON_CHANGE, true), (WakePolicy::Never, false)] {
            let mut rest = Rest::new(scheme, wake);
            let set = rest.fields.set_axis("lift", 20.0);
            set.expect("a declared axis");
            rest.steps(30);
            assert_eq!(!rest.sleeps(), wakes, "{scheme:?}, {wake:?}");
            // 10.19 m/s² for half a second: 1.27 m; forces stored during sleep would raise it higher.
            let expected = if wakes { 0.5 + 1.27 } else { 0.5 };
            assert_close(
                rest.height(),
                expected,
                0.1,
                format!("{scheme:?}, {wake:?}"),
            );
        }
    }
}

/// A change is one from the wrench under which the body fell asleep, not from the first one evaluated in its sleep.
#[test]
fn a_change_right_after_falling_asleep_wakes() {
    for scheme in SCHEMES {
        let mut rest = Rest::new(scheme, ON_CHANGE);
        rest.world.bodies[rest.cube].wake_up(true);
        rest.steps(1);
        while !rest.sleeps() {
            rest.steps(1);
        }
        rest.fields.set_axis("lift", 20.0).expect("a declared axis");
        rest.steps(30);
        assert!(!rest.sleeps(), "{scheme:?}");
    }
}

#[test]
fn a_new_tree_wakes_under_on_change_and_not_under_never() {
    for scheme in SCHEMES {
        for (wake, wakes) in [(ON_CHANGE, true), (WakePolicy::Never, false)] {
            let mut rest = Rest::new(scheme, wake);
            let upward = Field::uniform(-DOWN).force_mode(ForceMode::Acceleration);
            rest.fields.set_tree(upward).expect("a valid tree");
            rest.steps(30);
            assert_eq!(!rest.sleeps(), wakes, "{scheme:?}, {wake:?}");
            assert_eq!(rest.height() > 1.0, wakes, "{scheme:?}, {wake:?}");
        }
    }
}

#[test]
fn a_change_too_small_does_not_wake() {
    let mut rest = Rest::new(
        Scheme::KickDriftKick,
        WakePolicy::OnChange { fraction: 0.5 },
    );
    rest.fields.set_axis("lift", 2.0).expect("a declared axis");
    rest.steps(30);
    assert!(rest.sleeps());
}

/// Long sleep under a field, then a wake-up by the user: the body starts from rest.
#[test]
fn forces_do_not_pile_up_on_sleepers() {
    for scheme in SCHEMES {
        let mut rest = Rest::new(scheme, ON_CHANGE);
        rest.steps(600);
        assert!(rest.sleeps(), "{scheme:?}");
        rest.world.bodies[rest.cube].wake_up(true);
        rest.steps(1);
        let speed = to_f64(linvel(&rest.world, rest.cube).length());
        // A resting body may show the kick of one step at most.
        assert_at_most(speed, 9.81 / 60.0, format!("{scheme:?}, speed"));
        assert_close(rest.height(), 0.5, 2e-3, format!("{scheme:?}, height"));
    }
}

// Changes between steps.

#[test]
fn a_teleported_body_gets_the_force_of_its_new_place() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
        let mut fields = build(Field::spring(3.0), scheme);
        step(&mut fields, &mut world);
        world.bodies[ball].set_translation(Vector::Y * 5.0, true);
        world.bodies[ball].set_linvel(Vector::ZERO, true);
        step(&mut fields, &mut world);

        let mut fresh = weightless(1.0 / 60.0);
        let other = insert_ball(&mut fresh, 1.0, Vector::Y * 5.0, Vector::ZERO);
        step(&mut build(Field::spring(3.0), scheme), &mut fresh);
        let (found, expected) = (linvel(&world, ball), linvel(&fresh, other));
        assert!(to_f64(expected.y) < -0.2, "the spring pulls");
        let error = to_f64((found - expected).length());
        assert_at_most(error, rounding(), format!("{scheme:?}"));
    }
}

#[test]
fn bodies_come_and_go_between_steps() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let first = insert_ball(&mut world, 2.0, Vector::ZERO, Vector::ZERO);
        let mut fields = build(Field::uniform(Vector::Y * 6.0), scheme);
        step(&mut fields, &mut world);
        let second = insert_ball(&mut world, 2.0, Vector::X * 5.0, Vector::ZERO);
        step(&mut fields, &mut world);
        let speed = |world: &PhysicsWorld, ball| to_f64(linvel(world, ball).y);
        assert_close(
            speed(&world, first),
            0.1,
            rounding(),
            format!("{scheme:?}, first"),
        );
        assert_close(
            speed(&world, second),
            0.05,
            rounding(),
            format!("{scheme:?}, second"),
        );
        world.remove_body(first);
        // Takes the slot of the first body in the arena.
        let third = insert_ball(&mut world, 4.0, Vector::ZERO, Vector::ZERO);
        step(&mut fields, &mut world);
        assert_close(
            speed(&world, second),
            0.1,
            rounding(),
            format!("{scheme:?}, second"),
        );
        assert_close(
            speed(&world, third),
            0.025,
            rounding(),
            format!("{scheme:?}, third"),
        );
        assert_eq!(fields.wrench(first), None);
    }
}

#[test]
fn colliders_come_and_go_between_steps() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 2.0, Vector::ZERO, Vector::ZERO);
        let each = Field::uniform(Vector::Y * 6.0).coupled_to(Coupling::Each);
        let mut fields = build(each, scheme);
        let mut speed = 0.0;
        let mut check = |world: &mut PhysicsWorld, colliders: f64| {
            step(&mut fields, world);
            speed += colliders * 0.05;
            let found = to_f64(linvel(world, ball).y);
            assert_close(
                found,
                speed,
                rounding(),
                format!("{scheme:?}, {colliders} colliders"),
            );
        };
        check(&mut world, 1.0);
        let weightless = ColliderBuilder::ball(0.5).density(0.0);
        let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
        let second = colliders.insert_with_parent(weightless, ball, bodies);
        check(&mut world, 2.0);
        world.remove_collider(second);
        check(&mut world, 1.0);
    }
}

#[test]
fn fields_of_a_removed_body_stop_acting() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 1.0, Vector::X * 5.0, Vector::ZERO);
        let source = world.bodies.insert(RigidBodyBuilder::fixed());
        let mut fields = build(Field::spring(3.0).at(source), scheme);
        step(&mut fields, &mut world);
        let pulled = linvel(&world, ball);
        assert!(to_f64(pulled.x) < -0.2, "the spring pulls");
        world.remove_body(source);
        // A new body in the same slot of the arena does not inherit the fields.
        world.bodies.insert(RigidBodyBuilder::fixed());
        step(&mut fields, &mut world);
        assert_eq!(linvel(&world, ball), pulled, "{scheme:?}");
    }
}

#[test]
fn a_new_charge_counts_from_the_next_step_on() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::ZERO);
        let electric = Field::uniform(Vector::Y * 6.0).coupled_to_axis("charge");
        let mut fields = build(electric, scheme);
        step(&mut fields, &mut world);
        assert_eq!(linvel(&world, ball), Vector::ZERO, "no charge yet");
        let collider = world.bodies[ball].colliders()[0];
        let charge = ColliderProperties::new().charge(2.0);
        let set = fields.set_properties(collider, charge, &world.colliders);
        set.expect("a collider of the world");
        step(&mut fields, &mut world);
        assert_close(
            to_f64(linvel(&world, ball).y),
            0.2,
            rounding(),
            format!("{scheme:?}"),
        );
    }
}

// The time step.

#[test]
fn the_time_step_may_change() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 2.0, Vector::ZERO, Vector::ZERO);
        let mut fields = build(Field::uniform(Vector::Y * 6.0), scheme);
        let mut time = 0.0;
        for dt in [0.01, 0.02, 0.005, 0.03] {
            world.integration_parameters.dt = dt;
            step(&mut fields, &mut world);
            time += to_f64(dt);
            let place = format!("{scheme:?}, dt {dt}");
            assert_close(
                to_f64(linvel(&world, ball).y),
                3.0 * time,
                rounding(),
                place,
            );
            assert_close(fields.time(), time, rounding(), "time");
        }
    }
}

/// `ForceMode::VelocityChange` adds the vector to the velocity once per step, whatever the length of the step.
#[test]
fn a_change_of_velocity_does_not_depend_on_the_time_step() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 2.0, Vector::ZERO, Vector::ZERO);
        let change = Field::uniform(Vector::Y * 0.5).force_mode(ForceMode::VelocityChange);
        let mut fields = build(change, scheme);
        for (count, dt) in [0.01, 0.02, 0.005, 0.03].into_iter().enumerate() {
            world.integration_parameters.dt = dt;
            step(&mut fields, &mut world);
            let expected = 0.5 * (count as f64 + 1.0);
            let place = format!("{scheme:?}, dt {dt}");
            assert_close(
                to_f64(linvel(&world, ball).y),
                expected,
                rounding() * 2.0,
                place,
            );
        }
    }
}

#[test]
fn a_step_of_no_length_changes_nothing() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 2.0, Vector::X, Vector::Z);
        let change = Field::uniform(Vector::Y).force_mode(ForceMode::VelocityChange);
        let mut fields = build(Field::spring(3.0).sum_union(change), scheme);
        step(&mut fields, &mut world);
        let state = |world: &PhysicsWorld| {
            let body = &world.bodies[ball];
            [body.translation(), body.linvel(), body.angvel()].map(bits)
        };
        let (before, time) = (state(&world), fields.time());
        world.integration_parameters.dt = 0.0;
        // A change of velocity would be an infinite force over this step.
        step(&mut fields, &mut world);
        assert_eq!(state(&world), before, "{scheme:?}");
        assert_eq!(fields.time(), time, "{scheme:?}");
    }
}

#[test]
fn a_step_of_bad_length_is_refused() {
    for dt in [-0.01, Real::NAN, Real::INFINITY] {
        let mut world = weightless(1.0 / 60.0);
        insert_ball(&mut world, 2.0, Vector::X, Vector::Z);
        let mut fields = build(Field::spring(3.0), Scheme::KickDriftKick);
        world.integration_parameters.dt = dt;
        let refused = fields.step(&mut world);
        assert!(matches!(refused, Err(StepError::TimeStep { .. })), "{dt}");
        // The next step, of valid length, succeeds.
        world.integration_parameters.dt = 0.01;
        step(&mut fields, &mut world);
    }
}

// The two ways to make a step.

/// A handful of spinning, colliding boxes in a spring.
fn crowd() -> PhysicsWorld {
    let mut world = weightless(1.0 / 60.0);
    for place in 0..6 {
        let place = place as Real;
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::new(place * 1.3 - 3.0, place * 0.2, 0.0))
            .angvel(Vector::new(1.0, place, -2.0));
        world.insert(body, ColliderBuilder::cuboid(0.5, 0.3, 0.4));
    }
    world
}

/// The poses and velocities of all bodies, bit for bit.
fn all_bits(world: &PhysicsWorld) -> Vec<[u64; 3]> {
    let states = world.bodies.iter().flat_map(|(_, body)| {
        let rotation = to_dvec3(body.rotation().to_scaled_axis());
        let rotation = rotation.to_array().map(f64::to_bits);
        let moving = [body.translation(), body.linvel(), body.angvel()];
        moving.map(bits).into_iter().chain([rotation])
    });
    states.collect()
}

/// The explicit path: the user's own pipeline between the two halves of the fields' step.
fn explicit_step(fields: &mut Fields, pipeline: &mut PhysicsPipeline, world: &mut PhysicsWorld) {
    let open = fields.begin(WorldMut::from(&mut *world));
    let open = open.expect("a finite step");
    pipeline.step(
        world.gravity,
        &world.integration_parameters,
        &mut world.islands,
        &mut world.broad_phase,
        &mut world.narrow_phase,
        &mut world.bodies,
        &mut world.colliders,
        &mut world.impulse_joints,
        &mut world.multibody_joints,
        &mut world.soft_bodies,
        &mut world.ccd_solver,
        &open.hooks(&()),
        &(),
    );
    let ended = fields.finish(open, WorldMut::from(world));
    ended.expect("a finite step");
}

#[test]
fn begin_and_finish_equal_step_bit_for_bit() {
    for scheme in SCHEMES {
        let tree = || Field::spring(3.0).sum_union(Field::drag(0.1, 0.2));
        let (mut easy, mut explicit) = (crowd(), crowd());
        let (mut one, mut other) = (build(tree(), scheme), build(tree(), scheme));
        let mut pipeline = PhysicsPipeline::new();
        let start = all_bits(&easy);
        for count in 0..120 {
            step(&mut one, &mut easy);
            explicit_step(&mut other, &mut pipeline, &mut explicit);
            assert_eq!(
                all_bits(&easy),
                all_bits(&explicit),
                "{scheme:?}, step {count}"
            );
        }
        assert_ne!(all_bits(&easy), start, "something moved");
    }
}

/// Neither a sample nor the potential energy between steps changes the motion.
#[test]
fn sampling_between_steps_changes_nothing() {
    for scheme in SCHEMES {
        let tree = || Field::spring(3.0).sum_union(Field::drag(0.1, 0.2));
        let (mut alone, mut watched) = (crowd(), crowd());
        let (mut one, mut other) = (build(tree(), scheme), build(tree(), scheme));
        for count in 0..60 {
            step(&mut one, &mut alone);
            step(&mut other, &mut watched);
            let first = watched.bodies.iter().next().map(|(handle, _)| handle);
            let sample = other.sample(first.expect("a crowd"), &watched);
            assert!(sample.is_ok_and(|wrench| wrench.is_some()));
            other.potential_energy(&watched);
            assert_eq!(
                all_bits(&alone),
                all_bits(&watched),
                "{scheme:?}, step {count}"
            );
        }
    }
}

#[test]
fn fields_may_move_between_threads() {
    fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<Fields>();
    is_send_and_sync::<Tree>();
    is_send_and_sync::<OpenStep>();
    is_send_and_sync::<FieldState>();
    is_send_and_sync::<FieldSettings>();
    is_send_and_sync::<FieldPipeline>();
    is_send_and_sync::<StepError>();
}

/// Where nearly all bodies sleep, one that was just added gets the same kick as in an empty world.
#[test]
fn a_body_added_among_sleepers_is_kicked_in_its_first_step() {
    let velocity = |sleepers: usize| {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        for i in 0..sleepers {
            let place = Vector::X * (3.0 * i as Real + 3.0);
            let body = RigidBodyBuilder::dynamic()
                .translation(place)
                .sleeping(true);
            world.insert(body, ColliderBuilder::ball(0.5));
        }
        // Not uniform, so that bodies are read and sampled.
        let mut fields = Fields::new(Field::spring(1e-3)).expect("a valid tree");
        fields.settings.wake = WakePolicy::Never;
        (0..5).for_each(|_| step(&mut fields, &mut world));
        let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 5.0);
        let (body, _) = world.insert(body, ColliderBuilder::ball(0.5));
        step(&mut fields, &mut world);
        assert!(world.bodies[body].linvel().y < 0.0);
        world.bodies[body].linvel()
    };
    assert_eq!(velocity(1000), velocity(0));
}
