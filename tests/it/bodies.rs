//! Fields on every kind of body of Rapier, under each scheme.

use rapier3d_fields::math::{DVec3, Real, from_dvec3, to_dpose3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::lab::stability::SCHEMES;
use crate::support::{
    Row, Table, assert_at_most, assert_close, build, either, insert_ball, largest, weightless,
};

fn steps(fields: &mut Fields, world: &mut PhysicsWorld, count: usize) {
    for _ in 0..count {
        fields.step(world).expect("a finite step");
    }
}

fn state(world: &PhysicsWorld, body: RigidBodyHandle) -> [Vector; 3] {
    let body = &world.bodies[body];
    [body.translation(), body.linvel(), body.angvel()]
}

const DOWN: Vector = Vector::new(0.0, -9.81, 0.0);

// Resting under contacts.

/// Five boxes on the ground.
fn stack() -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let mut world = weightless(1.0 / 60.0);
    let ground = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    world.insert(ground, ColliderBuilder::cuboid(10.0, 0.5, 10.0));
    let boxes = (0..5).map(|level| {
        let place = Vector::Y * (0.5 + level as Real);
        let body = RigidBodyBuilder::dynamic().translation(place);
        world.insert(body, ColliderBuilder::cuboid(0.5, 0.5, 0.5)).0
    });
    let boxes = boxes.collect();
    (world, boxes)
}

/// The number of steps after which all boxes sleep, and the height of the topmost.
fn settle(
    mut world: PhysicsWorld,
    boxes: &[RigidBodyHandle],
    fields: Option<Fields>,
) -> (usize, f64) {
    let mut fields = fields;
    for count in 1..=600 {
        match &mut fields {
            Some(fields) => steps(fields, &mut world, 1),
            None => world.step(),
        }
        if boxes
            .iter()
            .all(|handle| world.bodies[*handle].is_sleeping())
        {
            if let Some(fields) = &mut fields {
                steps(fields, &mut world, 120);
            }
            assert!(
                boxes
                    .iter()
                    .all(|handle| world.bodies[*handle].is_sleeping())
            );
            let top = world.bodies[*boxes.last().expect("boxes")].translation().y;
            return (count, to_f64(top));
        }
    }
    panic!("not all of the boxes fell asleep");
}

#[test]
fn a_stack_rests_and_sleeps_as_under_gravity() {
    let (mut world, boxes) = stack();
    world.gravity = DOWN;
    let (native_steps, native_top) = settle(world, &boxes, None);
    println!("gravity: asleep after {native_steps}, top at {native_top}");
    for scheme in SCHEMES {
        let (world, boxes) = stack();
        let downward = Field::uniform(DOWN).force_mode(ForceMode::Acceleration);
        let (steps, top) = settle(world, &boxes, Some(build(downward, scheme)));
        println!("{scheme:?}: asleep after {steps}, top at {top}");
        // Rapier's solver allows a penetration at each contact.
        assert_close(top, native_top, 5e-3, format!("{scheme:?}: top"));
        assert!(
            steps <= 2 * native_steps + 30,
            "{scheme:?}: {steps}, gravity {native_steps}"
        );
    }
}

// Rapier's own forces beside the fields.

/// A ball on a spring in Rapier's gravity hangs where the two balance; substeps include gravity.
#[test]
fn gravity_and_a_spring_balance() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        world.gravity = DOWN;
        let ball = insert_ball(&mut world, 2.0, Vector::Y * -1.962, Vector::ZERO);
        world.bodies[ball].set_linear_damping(0.5);
        // 2 · 9.81 / 10 below.
        let mut fields = build(Field::spring(10.0), scheme);
        steps(&mut fields, &mut world, 600);
        let height = to_f64(world.bodies[ball].translation().y);
        assert_close(height, -1.962, 0.01, format!("{scheme:?}"));
    }
}

/// Rapier's own integration of gravity is ahead of the parabola by g t dt/2n for n solver iterations; substeps are not.
#[test]
fn substeps_follow_gravity_along_the_parabola() {
    for scheme in [Scheme::substeps(3), Scheme::Forward4] {
        let mut world = weightless(1.0 / 60.0);
        world.gravity = DOWN;
        let ball = insert_ball(&mut world, 2.0, Vector::ZERO, Vector::X * 3.0);
        let mut fields = build(Field::uniform(Vector::Z * 4.0), scheme);
        steps(&mut fields, &mut world, 120);
        let expected = DVec3::new(6.0, -9.81 * 2.0, 2.0 * 2.0);
        let error = to_dvec3(world.bodies[ball].translation()).distance(expected);
        let rounding = 120.0 * 20.0 * to_f64(Real::EPSILON);
        assert_at_most(error, rounding, format!("{scheme:?}"));
    }
}

/// Rapier damps at the end of a step, at first order; schemes of higher order damp exactly.
#[test]
fn damping_is_exact_where_fields_act() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::X * 8.0);
        world.bodies[ball].set_linear_damping(1.0);
        let mut fields = build(Field::uniform(Vector::Y * 1e-3), scheme);
        steps(&mut fields, &mut world, 60);
        let expected = match scheme {
            Scheme::Kick | Scheme::ExternalForce | Scheme::LinearlyImplicit => {
                8.0 * (1.0_f64 + 1.0 / 60.0).powi(-60)
            }
            _ => 8.0 * (-1.0_f64).exp(),
        };
        let speed = to_f64(world.bodies[ball].linvel().x);
        assert_close(speed, expected, 1e-4, format!("{scheme:?}"));
    }
}

// Bodies that cannot follow, or not in every direction.

#[test]
fn fixed_and_kinematic_bodies_are_left_alone() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let builders = [
            RigidBodyBuilder::fixed(),
            RigidBodyBuilder::kinematic_position_based(),
            RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::Z),
        ];
        let handles = builders.map(|body| world.insert(body, ColliderBuilder::ball(0.5)).0);
        let push = Field::uniform(Vector::Y * 5.0).sum_union(Field::spring(3.0).at(Vector::X));
        let mut fields = build(push, scheme);
        steps(&mut fields, &mut world, 30);
        for handle in handles {
            let body = &world.bodies[handle];
            assert_eq!(
                body.linvel() * Vector::new(1.0, 1.0, 0.0),
                Vector::ZERO,
                "{scheme:?}"
            );
            assert_eq!(fields.wrench(handle), None, "not even sampled");
        }
    }
}

#[test]
fn locked_axes_stay_locked() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let locks = LockedAxes::TRANSLATION_LOCKED_Y
            | LockedAxes::ROTATION_LOCKED_X
            | LockedAxes::ROTATION_LOCKED_Z;
        let body = RigidBodyBuilder::dynamic()
            .locked_axes(locks)
            .can_sleep(false);
        let (body, _) = world.insert(body, ColliderBuilder::ball(0.2).translation(Vector::X));
        // Rapier's gyroscopic term breaks locks where the principal axes are not the body's.
        world.bodies[body].enable_gyroscopic_forces(false);
        let other = ColliderBuilder::ball(0.4).translation(Vector::new(0.3, -1.0, 0.5));
        world
            .colliders
            .insert_with_parent(other, body, &mut world.bodies);
        let place = Vector::new(3.0, 2.0, 1.0);
        let mut fields = build(Field::radial(-5.0, 2.0).at(place), scheme);
        steps(&mut fields, &mut world, 120);
        let body = &world.bodies[body];
        let turned = to_dpose3(body.position()).rotation;
        let slack = 1e-5;
        assert_at_most(
            to_f64(body.translation().y.abs()),
            slack,
            format!("{scheme:?}: y"),
        );
        assert_at_most(
            turned.x.hypot(turned.z),
            slack,
            format!("{scheme:?}: rotation"),
        );
        assert!(
            body.translation().x.abs() > 0.1,
            "{scheme:?}: free to move along x"
        );
        assert!(turned.y.abs() > 1e-3, "{scheme:?}: free to turn about y");
    }
}

#[test]
fn bodies_without_mass_do_not_move_and_without_inertia_do_not_turn() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let massless = RigidBodyBuilder::dynamic().translation(Vector::X);
        let massless = world.bodies.insert(massless);
        // Mass, but no inertia: moves, and cannot turn.
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::X * 3.0)
            .additional_mass_properties(MassProperties::new(Vector::ZERO, 2.0, Vector::ZERO))
            .can_sleep(false);
        let (point, _) = world.insert(
            body,
            ColliderBuilder::ball(0.1)
                .density(0.0)
                .translation(Vector::Y),
        );
        let pull = Field::spring(4.0).sum_union(Field::drag(0.1, 0.0));
        let mut fields = build(pull.sum_union(Field::uniform(Vector::Z)), scheme);
        steps(&mut fields, &mut world, 60);
        assert_eq!(
            state(&world, massless),
            [Vector::X, Vector::ZERO, Vector::ZERO],
            "{scheme:?}"
        );
        let [x, v, w] = state(&world, point);
        assert!(
            x.is_finite() && v.length() > 0.5 && w == Vector::ZERO,
            "{scheme:?}: {x} {v} {w}"
        );
    }
}

#[test]
fn disabled_colliders_are_not_sampled() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let body = RigidBodyBuilder::dynamic()
            .additional_mass(1.0)
            .can_sleep(false);
        let (body, collider) = world.insert(body, ColliderBuilder::ball(0.5).density(0.0));
        let push = Field::uniform(Vector::Y * 6.0).coupled_to_axis(Axis::Charge);
        let mut fields = build(push, scheme);
        let charge = ColliderProperties::new().charge(1.0);
        fields
            .set_properties(collider, charge, &world.colliders)
            .expect("a collider");
        steps(&mut fields, &mut world, 10);
        let speed = world.bodies[body].linvel().y;
        assert_close(to_f64(speed), 1.0, 1e-5, format!("{scheme:?}"));
        world.colliders[collider].set_enabled(false);
        // The evaluation of the end of the last step may still count, for half a kick.
        steps(&mut fields, &mut world, 2);
        let after = world.bodies[body].linvel();
        steps(&mut fields, &mut world, 10);
        assert_eq!(world.bodies[body].linvel(), after, "{scheme:?}");
    }
}

#[test]
fn a_body_may_change_its_type() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let ball = insert_ball(&mut world, 2.0, Vector::ZERO, Vector::ZERO);
        let mut fields = build(Field::uniform(Vector::Y * 12.0), scheme);
        steps(&mut fields, &mut world, 10);
        world.bodies[ball].set_body_type(RigidBodyType::Fixed, true);
        let place = world.bodies[ball].translation();
        steps(&mut fields, &mut world, 10);
        assert_eq!(world.bodies[ball].translation(), place, "{scheme:?}");
        world.bodies[ball].set_body_type(RigidBodyType::Dynamic, true);
        world.bodies[ball].set_linvel(Vector::ZERO, true);
        steps(&mut fields, &mut world, 10);
        let speed = to_f64(world.bodies[ball].linvel().y);
        assert_close(speed, 1.0, 1e-5, format!("{scheme:?}"));
    }
}

/// A new body in the slot and at the position of a removed one, while another body goes on.
#[test]
fn a_body_that_was_taken_out_and_put_back_is_a_new_one() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 60.0);
        let first = insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
        insert_ball(&mut world, 1.0, Vector::Y * 3.0, Vector::ZERO);
        let near = || Region::ball(2.0);
        let well = || {
            let drag = Field::drag(0.5, 0.0).within(near());
            Field::spring(500.0).within(near()).sum_union(drag)
        };
        let mut fields = build(well(), scheme);
        steps(&mut fields, &mut world, 5);
        world.remove_body(first);
        let again = insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
        assert_ne!(first, again);
        steps(&mut fields, &mut world, 5);

        let mut fresh = weightless(1.0 / 60.0);
        let other = insert_ball(&mut fresh, 1.0, Vector::X, Vector::ZERO);
        let mut fields = build(well(), scheme);
        steps(&mut fields, &mut fresh, 5);
        assert_eq!(state(&world, again), state(&fresh, other), "{scheme:?}");
    }
}

// Articulations.

/// A rod of one kilogram that hangs from a hinge, as a multibody or by an impulse joint.
fn pendulum(multibody: bool) -> (PhysicsWorld, RigidBodyHandle) {
    let mut world = weightless(1.0 / 240.0);
    let (post, _) = world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::ball(0.05));
    let rod = RigidBodyBuilder::dynamic()
        .translation(Vector::X)
        .can_sleep(false);
    let (rod, _) = world.insert(rod, ColliderBuilder::ball(0.1).mass(1.0));
    let joint = RevoluteJointBuilder::new(Vector::Z)
        .local_anchor1(Vector::ZERO)
        .local_anchor2(-Vector::X);
    if multibody {
        world
            .multibody_joints
            .insert(post, rod, joint, true)
            .expect("a joint");
    } else {
        world.impulse_joints.insert(post, rod, joint, true);
    }
    (world, rod)
}

/// Links ignore impulses, so every scheme moves them by `add_force`: they swing as a body on an impulse joint does.
#[test]
fn links_of_multibodies_are_moved_under_every_scheme() {
    for scheme in SCHEMES {
        let ends = [true, false].map(|multibody| {
            let (mut world, rod) = pendulum(multibody);
            let mut fields = build(Field::uniform(DOWN), scheme);
            steps(&mut fields, &mut world, 60);
            to_dvec3(world.bodies[rod].translation())
        });
        println!("{scheme:?}: link {} body {}", ends[0], ends[1]);
        assert!(ends[0].y < -0.2, "{scheme:?}: the link fell to {}", ends[0]);
        // A quarter of a second of a pendulum of 1 m; multibody joints are damped by 0.1.
        assert_at_most(ends[0].distance(ends[1]), 1e-2, format!("{scheme:?}"));
        assert_close(ends[0].length(), 1.0, 1e-3, "on its circle");
    }
}

// Soft bodies.

/// The mean height and vertical velocity of the particles of a falling cloth after 60 steps.
fn fall(scheme: Scheme, tree: impl Into<Tree>, gravity: Vector) -> (f64, f64, PhysicsWorld) {
    let mut world = weightless(1.0 / 60.0);
    world.gravity = gravity;
    let cloth = SoftBodyBuilder::cloth(Vector::ZERO, Vector::X * 0.5, Vector::Z * 0.5, 4, 4);
    let cloth = world.insert_soft_body(cloth.mass(2.0));
    let mut fields = build(tree, scheme);
    steps(&mut fields, &mut world, 60);
    let soft = &world.soft_bodies[cloth];
    let count = soft.num_particles() as f64;
    let mean = |values: Vec<Vector>| values.iter().map(|v| to_f64(v.y)).sum::<f64>() / count;
    let height = mean(soft.particle_positions().collect());
    let speed = mean(soft.particle_velocities().collect());
    (height, speed, world)
}

#[test]
fn fields_act_on_particles_of_soft_bodies() {
    for scheme in SCHEMES {
        let downward = Field::uniform(DOWN).force_mode(ForceMode::Acceleration);
        let (height, speed, _) = fall(scheme, downward, Vector::ZERO);
        let (_, native, _) = fall(scheme, Field::uniform(Vector::ZERO), DOWN);
        println!("{scheme:?}: at {height}, {speed}, under gravity {native}");
        assert_close(
            speed,
            native,
            2e-3 * native.abs(),
            format!("{scheme:?}: speed"),
        );
        // A whole kick before the step is ahead by g t dt/2.
        assert_close(height, -0.5 * 9.81, 0.1, format!("{scheme:?}: height"));
        // Two newtons on two kilograms.
        let (_, speed, _) = fall(scheme, Field::uniform(Vector::Y * 2.0), Vector::ZERO);
        assert_close(speed, 1.0, 3e-3, format!("{scheme:?}: speed"));
    }
}

#[test]
fn a_failed_step_restores_soft_bodies() {
    let mut world = weightless(1.0 / 60.0);
    let ball = insert_ball(&mut world, 1.0, Vector::X * 20.0, Vector::Y);
    let cloth = SoftBodyBuilder::cloth(Vector::ZERO, Vector::X * 0.5, Vector::Z * 0.5, 3, 3);
    let cloth = world.insert_soft_body(cloth.mass(2.0));
    // Infinite from the end of the first step on.
    let bad = Field::closure([Axis::Time], |sample: &Sample| {
        let later = sample.axes[0] > 0.0;
        Vector::Y * if later { Real::INFINITY } else { 1.0 }
    });
    let mut fields = build(bad.within(Region::ball(10.0)), Scheme::KickDriftKick);
    fields.settings.on_fault = FaultPolicy::Refuse;
    let all = |world: &PhysicsWorld| {
        let soft = &world.soft_bodies[cloth];
        let particles = soft.particle_positions().zip(soft.particle_velocities());
        (particles.collect::<Vec<_>>(), state(world, ball))
    };
    let before = all(&world);
    assert!(fields.step(&mut world).is_err());
    assert_eq!(all(&world), before);
}

// Free tops, stepped by `Fields`.

const FLIP: &str = include_str!("../data/e_free_top/top_near_intermediate_axis_dzhanibekov.csv");
const SIDE: &str = include_str!("../data/e_free_top/top_largest_inertia_side.csv");
const FAST: &str = include_str!("../data/e_free_top/top_smallest_inertia_side_fast.csv");
const AMMONIA: &str = include_str!("../data/e_free_top/top_ammonia_symmetric.csv");

/// Largest relative errors of energy and |L|, and of the direction of L in radians, over ten
/// seconds at 60 Hz.
fn spin(text: &'static str, moments: [f64; 3], scheme: Scheme) -> [f64; 3] {
    let table = Table::parse(text);
    let rows: Vec<Row<'_>> = table.rows().collect();
    let moments = DVec3::from_array(moments);
    let mut world = weightless(1.0 / 60.0);
    let top = RigidBodyBuilder::dynamic()
        .pose(Pose::from_rotation(rows[0].attitude("")))
        .angvel(from_dvec3(rows[0].vector("w", "")))
        .additional_mass_properties(MassProperties::new(Vector::ZERO, 1.0, from_dvec3(moments)))
        .can_sleep(false)
        .allow_fast_rotation(true);
    let (top, _) = world.insert(top, ColliderBuilder::ball(0.1).density(0.0));
    let far = Field::spring(1.0)
        .within(Region::ball(1.0))
        .at(Vector::X * 100.0);
    let mut fields = build(far, scheme);
    let invariants = |world: &PhysicsWorld| {
        let body = &world.bodies[top];
        let to_world = to_dpose3(body.position()).rotation;
        let w = to_world.inverse() * to_dvec3(body.angvel());
        (to_world * (moments * w), w.dot(moments * w))
    };
    let (momentum, energy) = invariants(&world);
    let mut errors = [const { Vec::new() }; 3];
    for _ in 0..600 {
        steps(&mut fields, &mut world, 1);
        let (l, e) = invariants(&world);
        errors[0].push((e / energy - 1.0).abs());
        errors[1].push((l.length() / momentum.length() - 1.0).abs());
        errors[2].push(l.normalize().distance(momentum.normalize()));
    }
    errors.map(largest)
}

#[test]
fn free_tops_keep_energy_and_angular_momentum_for_ten_seconds() {
    const ASYMMETRIC: [f64; 3] = [1.557596206665039, 2.5878665447235107, 1.1970621347427368];
    let ammonia = crate::lab::scenes::ammonia::PRINCIPAL_INERTIA;
    let tops = [
        ("largest", SIDE, ASYMMETRIC),
        ("intermediate", FLIP, ASYMMETRIC),
        ("smallest, fast", FAST, ASYMMETRIC),
        ("ammonia", AMMONIA, ammonia),
    ];
    let schemes = [
        Scheme::KickDriftKick,
        Scheme::substeps(3),
        Scheme::auto(1e-3),
    ];
    for (name, text, moments) in tops {
        for scheme in schemes {
            let [energy, length, direction] = spin(text, moments, scheme);
            println!(
                "{name}, {scheme:?}: E {energy:.1e}, |L| {length:.1e}, direction {direction:.1e}"
            );
            assert_at_most(energy, 1e-4, format!("{name}, {scheme:?}: energy"));
            assert_at_most(length, 1e-4, format!("{name}, {scheme:?}: |L|"));
            assert_at_most(
                direction,
                1e-3,
                format!("{name}, {scheme:?}: direction of L"),
            );
        }
    }
}

/// The rotation of a top after two seconds.
fn turned(tree: Tree, scheme: Scheme) -> Rotation {
    let mut world = weightless(1.0 / 120.0);
    let body = RigidBodyBuilder::dynamic().angvel(Vector::new(0.3, 4.0, 0.2));
    let slab = ColliderBuilder::cuboid(0.5, 0.3, 0.1);
    let top = world.insert(body.can_sleep(false), slab).0;
    let mut fields = build(tree, scheme);
    steps(&mut fields, &mut world, 240);
    *world.bodies[top].rotation()
}

#[test]
fn free_rotation_is_the_same_where_no_field_can_exert_a_torque() {
    let schemes = SCHEMES
        .into_iter()
        .filter(|scheme| *scheme != Scheme::ExternalForce);
    for scheme in schemes {
        let wind = || Tree::from(Field::uniform(Vector::X));
        let zone = || Tree::from(Field::uniform(Vector::X).within(Region::ball(1e4)));
        // Out of reach, but of a kind that can exert a torque.
        let torque = Field::uniform(Vector::X).within(Region::ball(0.1));
        let torque = torque.sampled(Sampling::Volume).at(Vector::X * 1e3);
        let known = turned(wind().sum_union(torque), scheme);
        for tree in [wind(), zone()] {
            let off = turned(tree, scheme).angle_between(known);
            assert_at_most(to_f64(off), either(2e-3, 1e-6), format!("{scheme:?}"));
        }
    }
}
