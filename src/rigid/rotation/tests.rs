//! Tests of the free rotation against closed forms, elliptic functions and Rapier itself.

use super::*;
use crate::math::{Pose, RigidBodyHandle, Rotation, from_f64};
use crate::rapier::dynamics::{LockedAxes, RigidBodyBuilder};
use crate::rapier::pipeline::PhysicsWorld;

/// Bound of the sum of some hundred roundings of [`Real`].
const ROUNDING: Real = 50.0 * Real::EPSILON;

/// `assert!(a <= b)` that fails on NaN and prints both numbers.
#[track_caller]
fn assert_within(error: f64, bound: f64, what: &str) {
    assert!(
        error <= bound,
        "{what}: error {error:.3e} exceeds {bound:.1e}"
    );
}

fn top(moments: [f64; 3]) -> Inertia {
    let moments = from_dvec3(DVec3::from_array(moments));
    let frame = Rotation::from_rotation_z(0.4) * Rotation::from_rotation_x(-1.1);
    let properties =
        MassProperties::with_principal_inertia_frame(Vector::ZERO, 1.0, moments, frame);
    Inertia::new(&properties).expect("positive moments")
}

/// The angle between nearly equal attitudes, to first order.
fn angle_between(a: DQuat, b: DQuat) -> f64 {
    2.0 * (a - b).length().min((a + b).length())
}

/// Selects the bound for the build's precision.
fn either(f32: f64, f64: f64) -> f64 {
    if size_of::<Real>() == 4 { f32 } else { f64 }
}

fn rotation(q: DQuat) -> Rotation {
    let [x, y, z, w] = q.to_array().map(from_f64);
    Rotation::from_xyzw(x, y, z, w).normalize()
}

/// Random numbers, uniform in [-1, 1), the same sequence in every run.
pub(crate) struct Random(pub u64);

impl Random {
    pub(crate) fn next(&mut self) -> f64 {
        let Self(state) = *self;
        self.0 = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub(crate) fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

/// One row of `tests/data/e_free_top`: time, angular velocity in body axes, attitude.
struct Row {
    t: f64,
    body_angvel: DVec3,
    attitude: DQuat,
}

fn rows(csv: &str) -> Vec<Row> {
    let data = csv.lines().filter(|line| !line.starts_with(['#', 't']));
    data.map(|line| {
        let numbers = line.split(',').map(|x| x.parse().expect("a number"));
        let n: Vec<f64> = numbers.collect();
        let attitude = DQuat::from_xyzw(n[8], n[9], n[10], n[7]);
        Row {
            t: n[0],
            body_angvel: DVec3::new(n[1], n[2], n[3]),
            attitude,
        }
    })
    .collect()
}

fn body_top(moments: [f64; 3]) -> Inertia {
    Inertia {
        principal_to_body: DQuat::IDENTITY,
        ..top(moments)
    }
}

#[test]
fn symmetric_top_is_exact_over_any_step() {
    let csv = include_str!("../../../tests/data/e_free_top/top_ammonia_symmetric.csv");
    let (rows, perpendicular) = (rows(csv), 1.68672087031384);
    let top = body_top([perpendicular, perpendicular, 2.6371629045728437]);
    let start = rotation(rows[0].attitude);
    let momentum = rows[0].attitude * (top.moments * rows[0].body_angvel);
    for row in rows {
        let delta = top.free_rotation(to_dquat(start), momentum, row.t);
        let error = angle_between(delta * to_dquat(start), row.attitude);
        // A turn of up to 30 rad multiplies the rounding of the moments and of `dt`.
        assert_within(
            error,
            either(1e-5, 1e-12),
            &format!("attitude at t = {}", row.t),
        );
    }
}

/// Follows a reference file row by row. Returns the largest relative errors of the body's angular velocity and energy.
fn follow(csv: &str) -> (f64, f64) {
    let rows = rows(csv);
    let top = body_top([1.557596206665039, 2.5878665447235107, 1.1970621347427368]);
    let energy = |body_angvel: DVec3| body_angvel.dot(top.moments * body_angvel);
    let momentum = rows[0].attitude * (top.moments * rows[0].body_angvel);
    let mut attitude = rotation(rows[0].attitude);
    let mut errors = (0.0_f64, 0.0_f64);
    for pair in rows.windows(2) {
        let delta = top.free_rotation(to_dquat(attitude), momentum, pair[1].t - pair[0].t);
        attitude = rotation(delta * to_dquat(attitude));
        let angvel = to_dquat(attitude).inverse() * top.angvel_after(to_dquat(attitude), momentum);
        let expected = pair[1].body_angvel;
        errors.0 = errors.0.max(angvel.distance(expected) / expected.length());
        errors.1 = errors
            .1
            .max((energy(angvel) / energy(expected) - 1.0).abs());
    }
    errors
}

#[test]
fn asymmetric_top_follows_the_elliptic_functions() {
    let (angvel, energy) = follow(include_str!(
        "../../../tests/data/e_free_top/top_largest_inertia_side.csv"
    ));
    assert_within(angvel, 3e-6, "angular velocity, near the largest moment");
    assert_within(
        energy,
        either(5e-7, 5e-8),
        "energy, near the largest moment",
    );

    let (angvel, energy) = follow(include_str!(
        "../../../tests/data/e_free_top/top_smallest_inertia_side_fast.csv"
    ));
    assert_within(angvel, 3e-5, "angular velocity, near the smallest moment");
    assert_within(energy, ENERGY_ERROR, "energy, near the smallest moment");
}

#[test]
fn flipping_top_keeps_its_energy() {
    let (angvel, energy) = follow(include_str!(
        "../../../tests/data/e_free_top/top_near_intermediate_axis_dzhanibekov.csv"
    ));
    // Near the separatrix an error of 1e-7 grows to 1e-2.
    assert_within(angvel, either(1e-1, 1e-3), "angular velocity");
    assert_within(energy, ENERGY_ERROR, "energy");
}

#[test]
fn splitting_is_of_second_order() {
    let top = top([1.0, 2.0, 3.0]);
    let momentum = DVec3::new(0.7, 2.0, 1.5);
    let splitting = Splitting::new(&top, momentum);
    let turn = |steps| splitting.turn(momentum, 1.0, steps);
    let error = |steps| angle_between(turn(steps), turn(4096));
    for steps in [4, 8, 16, 32] {
        let order = (error(steps) / error(2 * steps)).log2();
        assert_within(
            (order - 2.0).abs(),
            0.02,
            &format!("order at {steps} steps"),
        );
    }
}

#[test]
fn energy_error_is_bounded_for_any_top() {
    let mut random = Random(7);
    for _ in 0..300 {
        let mass = DVec3::from_array([0; 3].map(|_| 10_f64.powf(random.next() - 1.0)));
        let top = top([mass.y + mass.z, mass.x + mass.z, mass.x + mass.y]);
        let mut momentum = top.moments * random.vector().normalize() * 0.2;
        let energy = |momentum: DVec3| momentum.dot(top.inverse_moments * momentum);
        let start = energy(momentum);
        for _ in 0..300 {
            let splitting = Splitting::new(&top, momentum);
            let turn = splitting.turn(momentum, 1.0, splitting.steps(1.0, ENERGY_ERROR));
            momentum = turn.inverse() * momentum;
            let error = (energy(momentum) / start - 1.0).abs();
            assert_within(error, ENERGY_ERROR, &format!("energy of {top:?}"));
        }
    }
}

/// Rapier's rotation by a steady velocity.
fn linearised(angvel: Vector, dt: Real, substeps: u32) -> DQuat {
    let half = to_dvec3(angvel) * (0.5 * to_f64(dt) / f64::from(substeps));
    let substep = DQuat::from_xyzw(half.x, half.y, half.z, 1.0).normalize();
    (0..substeps).fold(DQuat::IDENTITY, |turned, _| substep * turned)
}

#[test]
fn the_steady_velocity_leads_to_the_rotation() {
    let axis = DVec3::new(2.0, -1.0, 2.0) / 3.0;
    let dt = 1.0 / 60.0;
    for substeps in [1, 2, 4, 7] {
        for angle in [1e-12, 1e-5, 0.03, 0.0999, 0.1001, 1.5, 3.0, 3.3, 5.0, 6.2] {
            let delta = DQuat::from_axis_angle(axis, angle);
            let reached = linearised(steady_angvel(delta, dt, substeps), dt, substeps);
            // The substeps of this test round, too.
            let bound = to_f64(ROUNDING) * angle + 1e-15 + 2e-16 * f64::from(substeps);
            let what = format!("{angle} rad in {substeps} substeps");
            assert_within(angle_between(reached, delta), bound, &what);
        }
    }
}

#[test]
fn half_a_turn_in_one_substep_stays_finite() {
    let delta = DQuat::from_rotation_x(std::f64::consts::PI);
    let reached = linearised(steady_angvel(delta, 0.01, 1), 0.01, 1);
    assert_within(angle_between(reached, delta), 2.1e-4, "half a turn");
}

#[test]
fn a_body_at_rest_or_a_step_of_zero_gives_no_rotation() {
    let top = top([1.0, 2.0, 3.0]);
    let momentum = DVec3::new(1.0, 2.0, -3.0);
    for (momentum, dt) in [(momentum, 0.0), (DVec3::ZERO, 0.1), (DVec3::ZERO, 0.0)] {
        let delta = top.free_rotation(
            to_dquat(Rotation::from_rotation_y(0.3)),
            momentum,
            to_f64(dt),
        );
        assert_within(angle_between(delta, DQuat::IDENTITY), 1e-15, "rotation");
        assert_within(
            to_dvec3(steady_angvel(delta, dt, 4)).length(),
            1e-13,
            "angvel",
        );
    }
}

#[test]
fn numbers_that_are_not_finite_give_velocities_that_are_not_finite() {
    let top = top([1.0, 2.0, 3.0]);
    for bad in [Real::NAN, Real::INFINITY] {
        let momentum = top.angular_momentum(DQuat::IDENTITY, to_dvec3(Vector::splat(bad)));
        let delta = top.free_rotation(DQuat::IDENTITY, momentum, 0.1);
        assert!(!steady_angvel(delta, 0.1, 4).is_finite());
        assert!(!top.angvel_after(DQuat::IDENTITY, momentum).is_finite());
    }
    let delta = top.free_rotation(DQuat::IDENTITY, DVec3::ONE, f64::NAN);
    assert!(steady_angvel(delta, Real::NAN, 0).is_nan());
}

#[test]
fn only_free_tops_have_an_inertia() {
    let with = |moments| Inertia::new(&MassProperties::new(Vector::ZERO, 1.0, moments));
    assert!(with(Vector::new(1.0, 0.0, 1.0)).is_none());
    assert!(with(Vector::new(1.0, Real::INFINITY, 1.0)).is_none());
    assert!(with(Vector::new(1.0, Real::NAN, 1.0)).is_none());

    let (mut world, handle) = spinning(Vector::new(1.0, 2.0, 3.0), Vector::X);
    assert!(Inertia::of(&world.bodies[handle]).is_some());
    world.bodies[handle].set_locked_axes(LockedAxes::ROTATION_LOCKED_Y, true);
    assert!(Inertia::of(&world.bodies[handle]).is_none());
}

#[test]
fn moments_that_are_equal_to_rounding_are_spherical() {
    assert!(top([0.3, 0.3, 0.3]).is_spherical());
    assert!(top([0.3, 0.3, 0.3 * (1.0 + to_f64(Real::EPSILON))]).is_spherical());
    assert!(!top([0.3, 0.3, 0.3 * (1.0 + 1e4 * to_f64(Real::EPSILON))]).is_spherical());
}

fn spinning(moments: Vector, angvel: Vector) -> (PhysicsWorld, RigidBodyHandle) {
    let mut world = PhysicsWorld {
        gravity: Vector::ZERO,
        ..PhysicsWorld::new()
    };
    world.integration_parameters.dt = 1.0 / 60.0;
    let body = RigidBodyBuilder::dynamic()
        .pose(Pose::from_parts(Vector::X, Rotation::from_rotation_y(0.3)))
        .additional_mass_properties(MassProperties::new(Vector::ZERO, 1.0, moments))
        .gyroscopic_forces_enabled(false)
        .allow_fast_rotation(true)
        .can_sleep(false);
    let handle = world.insert_body(body);
    // Rapier computes mass properties in the first step.
    world.step();
    world.bodies[handle].set_angvel(angvel, true);
    (world, handle)
}

/// The recipe at the top of the module.
fn step(world: &mut PhysicsWorld, handle: RigidBodyHandle) {
    let (dt, substeps) = (
        world.integration_parameters.dt,
        world.integration_parameters.num_solver_iterations,
    );
    let body = &mut world.bodies[handle];
    let top = Inertia::of(body).expect("a free top");
    let momentum = top.angular_momentum(to_dquat(*body.rotation()), to_dvec3(body.angvel()));
    let delta = top.free_rotation(to_dquat(*body.rotation()), momentum, to_f64(dt));
    let steady = steady_angvel(delta, dt, substeps as u32);
    body.set_angvel(steady, true);

    world.step();

    let body = &mut world.bodies[handle];
    let gained = body.angvel() - steady;
    let angvel = from_dvec3(top.angvel_after(to_dquat(*body.rotation()), momentum));
    body.set_angvel(angvel + gained, true);
}

/// Angular momentum and twice the rotational energy.
fn invariants(body: &RigidBody) -> (DVec3, f64) {
    let top = Inertia::of(body).expect("a free top");
    let momentum = top.angular_momentum(to_dquat(*body.rotation()), to_dvec3(body.angvel()));
    (momentum, momentum.dot(to_dvec3(body.angvel())))
}

#[test]
fn rapier_body_keeps_energy_and_momentum() {
    for angvel in [
        [1.0, 3.0, 0.0],
        [0.1, 3.16, 0.1],
        [3.0, 1.0, 0.1],
        [5.0, 10.0, 2.0],
    ] {
        let (mut world, handle) = spinning(Vector::new(1.0, 2.0, 3.0), Vector::from_array(angvel));
        let (momentum, energy) = invariants(&world.bodies[handle]);
        for _ in 0..600 {
            step(&mut world, handle);
            let (m, e) = invariants(&world.bodies[handle]);
            assert_within((e / energy - 1.0).abs(), either(2e-5, 1e-5), "energy");
            let length_error = (m.length() / momentum.length() - 1.0).abs();
            assert_within(length_error, either(5e-6, 1e-12), "|L|");
            let direction_error = m.normalize().distance(momentum.normalize());
            assert_within(direction_error, either(5e-6, 1e-13), "direction of L");
        }
    }
}

#[test]
fn rapier_carries_out_the_free_rotation() {
    let (mut world, handle) = spinning(Vector::new(1.0, 2.0, 3.0), Vector::new(5.0, 10.0, 2.0));
    let body = &world.bodies[handle];
    let (before, (momentum, _)) = (*body.rotation(), invariants(body));
    let top = Inertia::of(body).expect("a free top");
    let delta = top.free_rotation(
        to_dquat(before),
        momentum,
        to_f64(world.integration_parameters.dt),
    );
    step(&mut world, handle);
    let reached = to_dquat(*world.bodies[handle].rotation());
    assert_within(
        angle_between(reached, delta * to_dquat(before)),
        to_f64(ROUNDING),
        "attitude",
    );
}

#[test]
fn small_tangents_are_exact_to_rounding() {
    for step in 1..=1000 {
        let tangent = SMALL_TANGENT * f64::from(step) / 1000.0;
        for parts in [1.0, 2.0, 4.0, 7.0, 100.0] {
            let (found, exact) = (
                small_tangent(tangent, parts),
                (tangent.atan() / parts).tan(),
            );
            let error = (found / exact - 1.0).abs();
            assert_within(error, 4.0 * f64::EPSILON, &format!("{tangent} in {parts}"));
        }
    }
}
