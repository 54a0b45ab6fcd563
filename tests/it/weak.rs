//! Weak forces: a body that they accelerate stays awake, however slow it is; a body in equilibrium sleeps.

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::lab::stability::SCHEMES;
use crate::support::*;

const DT: Real = 1.0 / 60.0;

/// A ball that may sleep.
fn ball(world: &mut PhysicsWorld, place: Vector, linvel: Vector) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(place)
        .linvel(linvel);
    world.insert(body, ColliderBuilder::ball(0.5).mass(2.0)).0
}

fn steps(fields: &mut Fields, world: &mut PhysicsWorld, count: usize) {
    for _ in 0..count {
        fields.step(world).expect("a valid step");
    }
}

/// A uniform force, evaluated by its own path and by the general one.
fn winds(force: Vector) -> [Tree; 2] {
    let everywhere = Field::uniform(force);
    let within = Field::uniform(force).within(Region::ball(1e5));
    [everywhere.into(), within.into()]
}

#[test]
fn weak_forces_move_bodies_at_rest() {
    for scheme in SCHEMES {
        // Down to a force that moves a ball by a few roundings in the time in which it could fall asleep.
        for weak in [1e-5, 1e-3, 0.01, 0.1, 0.19, 0.5] {
            for tree in winds(Vector::X * from_f64(2.0 * weak)) {
                let mut world = weightless(DT);
                let ball = ball(&mut world, Vector::Y, Vector::ZERO);
                let mut fields = build(tree, scheme);
                steps(&mut fields, &mut world, 3600);
                let way = to_f64(world.bodies[ball].translation().x);
                let expected = 0.5 * weak * 3600.0;
                assert_close(way / expected, 1.0, 1e-3, format!("{scheme:?}, {weak}"));
            }
        }
    }
}

#[test]
fn a_ball_thrown_against_a_weak_wind_comes_back() {
    for scheme in SCHEMES {
        for tree in winds(Vector::X * -0.02) {
            let mut world = weightless(DT);
            let ball = ball(&mut world, Vector::ZERO, Vector::X * 0.15);
            let mut fields = build(tree, scheme);
            // Out and back: 2 · 0.15 / 0.01 s.
            steps(&mut fields, &mut world, 1800);
            let body = &world.bodies[ball];
            // Schemes of first order are ahead by half a step's change of velocity, all the time.
            let bound = 1e-3 + first_order(scheme) * 0.5 * 0.01 * 30.0 / 60.0;
            let place = to_f64(body.translation().x).abs();
            assert_at_most(place, bound, format!("place, {scheme:?}"));
            let linvel = to_f64(body.linvel().x);
            assert_close(linvel, -0.15, 1e-4, format!("velocity, {scheme:?}"));
        }
    }
}

/// One for schemes of first order, and zero for others.
fn first_order(scheme: Scheme) -> f64 {
    let first = matches!(
        scheme,
        Scheme::Kick | Scheme::ExternalForce | Scheme::LinearlyImplicit
    );
    f64::from(u8::from(first))
}

#[test]
fn slow_springs_swing() {
    for scheme in SCHEMES {
        for hertz in [0.01, 0.05, 0.2] {
            let mut world = weightless(DT);
            let ball = ball(&mut world, Vector::X, Vector::ZERO);
            let omega = std::f64::consts::TAU * hertz;
            let spring = Field::spring(from_f64(2.0 * omega.powi(2)));
            let mut fields = build(spring, scheme);
            let half = (30.0 / hertz) as usize;
            for turn in 1..=4 {
                steps(&mut fields, &mut world, half);
                let expected = if turn % 2 == 0 { 1.0 } else { -1.0 };
                let place = to_f64(world.bodies[ball].translation().x);
                // A scheme of first order may gain or lose (dt·ω)²/2 of the swing in a step.
                let gained = 0.5 * (omega / 60.0).powi(2) * (half * turn) as f64;
                let bound = 1e-3 + first_order(scheme) * 1.1 * gained;
                assert_close(place, expected, bound, format!("{scheme:?}, {hertz} Hz"));
            }
        }
    }
}

/// A ball that hangs on a spring in strong drag.
#[test]
fn a_ball_in_equilibrium_falls_asleep() {
    for scheme in [Scheme::KickDriftKick, Scheme::auto(1e-3)] {
        let mut world = weightless(DT);
        world.gravity = Vector::Y * -9.81;
        let ball = ball(&mut world, Vector::ZERO, Vector::ZERO);
        let tree = Tree::from(Field::spring(20.0)).sum_union(Field::drag(8.0, 0.0));
        let mut fields = build(tree, scheme);
        steps(&mut fields, &mut world, 1800);
        let body = &world.bodies[ball];
        let below = -2.0 * 9.81 / 20.0;
        let height = to_f64(body.translation().y);
        assert_close(height / below, 1.0, 1e-3, format!("{scheme:?}"));
        assert!(body.is_sleeping(), "{scheme:?}: {height}");
    }
}

/// A float dropped into a pool.
#[test]
fn a_float_settles_and_sleeps() {
    let mut world = weightless(DT);
    world.gravity = Vector::Y * -9.81;
    let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.6);
    // Upright the cube is not stable.
    let body = body.lock_rotations();
    let cube = ColliderBuilder::cuboid(0.5, 0.5, 0.5).density(400.0);
    let float = world.insert(body, cube).0;
    let pool = Tree::pool(Vector::ZERO, Vector::splat(20.0), 1000.0, 9.81, 2.0);
    let mut fields = build(pool, Scheme::KickDriftKick);
    // The lift when it was last awake.
    let mut carried = 0.0;
    for _ in 0..3600 {
        fields.step(&mut world).expect("a valid step");
        if !world.bodies[float].is_sleeping() {
            let wrench = fields.wrench(float).expect("a float in the water");
            carried = to_f64(wrench.force.y);
        }
    }
    assert_close(carried / 3924.0, 1.0, 1e-3, "balance");
    let body = &world.bodies[float];
    // Four tenths of the cube are under water, by the volumes in which buoyancy is sampled.
    let height = to_f64(body.translation().y);
    assert_close(height, 0.1, 0.02, "height");
    assert!(body.is_sleeping(), "{height}, {:?}", body.linvel());
}

/// How far wind pushes a box on the floor in ten seconds, and whether it sleeps then.
fn blown(friction: Real, weak: f64) -> (f64, bool) {
    let mut world = weightless(DT);
    world.gravity = Vector::Y * -9.81;
    let floor = ColliderBuilder::cuboid(50.0, 0.5, 50.0).friction(friction);
    world.colliders.insert(floor.translation(Vector::Y * -0.5));
    let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5);
    let cube = ColliderBuilder::cuboid(0.5, 0.5, 0.5)
        .friction(friction)
        .mass(2.0);
    let cube = world.insert(body, cube).0;
    let wind = Field::uniform(Vector::X * from_f64(2.0 * weak));
    let mut fields = build(wind, Scheme::KickDriftKick);
    steps(&mut fields, &mut world, 600);
    let body = &world.bodies[cube];
    (to_f64(body.translation().x), body.is_sleeping())
}

#[test]
fn wind_pushes_a_box_over_ice_and_lets_it_sleep_on_the_floor() {
    for weak in [0.01, 0.05, 0.2] {
        let (way, asleep) = blown(0.0, weak);
        assert_close(
            way / (0.5 * weak * 100.0),
            1.0,
            0.01,
            format!("on ice, {weak}"),
        );
        assert!(!asleep);
        let (way, asleep) = blown(0.5, weak);
        assert_at_most(way.abs(), 1e-3, "on the floor");
        assert!(asleep, "on the floor, {weak}");
    }
}

/// The velocity along the magnetic field stayed zero, and should be 2.5e-7 m/s after a second: a force of less than 1e-5 of
/// those that read velocities was taken for their rounding.
#[test]
fn forces_that_are_weak_beside_those_that_read_velocities_act() {
    for scheme in SCHEMES {
        let mut world = weightless(DT);
        let ball = ball(&mut world, Vector::ZERO, Vector::X * 100.0);
        let field = Field::magnetic(Vector::Z * 1e-3).coupled_to(Coupling::Share);
        let weak = Field::uniform(Vector::Z * 5e-7).within(Region::ball(1e5));
        let mut fields = build(field.sum_union(weak), scheme);
        steps(&mut fields, &mut world, 60);
        let along = to_f64(world.bodies[ball].linvel().z);
        assert!((along / 2.5e-7 - 1.0).abs() < 1e-3, "{scheme:?}: {along:e}");
    }
}
