//! Orders of convergence: how the error at the end of a run falls as the step is halved, in `f64`,
//! where rounding leaves room for fourth order.

use std::f64::consts::TAU;

use crate::lab::scenes::ammonia::{Molecule, PRINCIPAL_INERTIA, insert_molecule};
use rapier3d_fields::math::{DQuat, DVec3, to_dpose3, to_dvec3};
use rapier3d_fields::prelude::*;

use crate::support::{Row, Table, ammonia, assert_order, insert_ball, largest, weightless};

/// How close to the nominal order the measured one must come, on average over the halvings.
const ORDER_BAND: f64 = 0.1;

/// Errors below this, thousands of roundings, show no order.
const EXACT: f64 = 1e-12;

const KDK: Scheme = Scheme::KickDriftKick;
const SUBSTEP: Scheme = Scheme::substeps(3);
const FORWARD: Scheme = Scheme::Forward4;
const IMPLICIT: Scheme = Scheme::LinearlyImplicit;

fn build(tree: impl Into<Tree>, scheme: Scheme) -> Fields {
    let builder = Fields::builder(tree).scheme(scheme);
    builder.build().expect("a valid tree")
}

/// A world without a limit of speed.
fn unbounded(dt: f64) -> PhysicsWorld {
    let mut world = weightless(dt);
    world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
    world.integration_parameters.max_ccd_substeps = 0;
    world
}

fn steps(fields: &mut Fields, world: &mut PhysicsWorld, count: u32) {
    for _ in 0..count {
        fields.step(world).expect("a finite step");
    }
}

/// Position and velocity of a body.
fn state(world: &PhysicsWorld, body: RigidBodyHandle) -> (DVec3, DVec3) {
    let body = &world.bodies[body];
    (to_dvec3(body.translation()), to_dvec3(body.linvel()))
}

/// Runs each scheme with the given numbers of steps and compares the orders.
fn check(what: &str, plan: &[(Scheme, f64, [u32; 3])], run: impl Fn(Scheme, u32) -> f64) {
    for (scheme, order, counts) in plan {
        let errors = counts.map(|count| run(*scheme, count));
        // A scheme is exact for some motions.
        if errors.iter().all(|error| *error < EXACT) {
            println!("{what}, {scheme:?}: exact");
            continue;
        }
        assert_order(&errors, *order, ORDER_BAND, &format!("{what}, {scheme:?}"));
    }
}

/// Numbers of steps that double from `first` on.
const fn from(first: u32) -> [u32; 3] {
    [first, 2 * first, 4 * first]
}

// The spring: x'' = −ω² x with ω = 2π, for 1.3 periods.

#[test]
fn a_spring_converges_at_the_nominal_orders() {
    let run = |scheme, count: u32| {
        let end = 1.3;
        let mut world = unbounded(end / f64::from(count));
        let ball = insert_ball(&mut world, 2.0, Vector::X, Vector::X * 3.0);
        let mut fields = build(Field::spring(2.0 * TAU * TAU), scheme);
        steps(&mut fields, &mut world, count);
        let (sin, cos) = (TAU * end).sin_cos();
        let expected = (cos + 3.0 / TAU * sin, 3.0 * cos - TAU * sin);
        let (x, v) = state(&world, ball);
        (x.x - expected.0).hypot((v.x - expected.1) / TAU)
    };
    let plan = [
        (KDK, 2.0, from(80)),
        (SUBSTEP, 2.0, from(40)),
        (FORWARD, 4.0, from(40)),
        (IMPLICIT, 1.0, from(4000)),
        (Scheme::Kick, 1.0, from(400)),
    ];
    check("spring", &plan, run);
}

// Orbits.

fn orbit(case: f64, sample: usize) -> impl Fn(Scheme, u32) -> f64 {
    let table = Table::parse(include_str!("../data/h_stiff/kepler.csv"));
    move |scheme, count| {
        let rows: Vec<Row<'_>> = table.rows().filter(|r| r.number("case") == case).collect();
        let (start, end) = (rows[0], rows[sample]);
        let mut world = unbounded(end.number("t") / f64::from(count));
        let (x, v) = (start.vector("", ""), start.vector("v", ""));
        let ball = insert_ball(&mut world, 1.0, x, v);
        let mut fields = build(Field::point_gravity(start.number("mu")), scheme);
        steps(&mut fields, &mut world, count);
        state(&world, ball).0.distance(end.vector("", ""))
    }
}

#[test]
fn an_orbit_of_eccentricity_one_half_converges_at_the_nominal_orders() {
    let plan = [
        (KDK, 2.0, from(800)),
        (SUBSTEP, 2.0, from(400)),
        (FORWARD, 4.0, from(400)),
        (IMPLICIT, 1.0, from(40_000)),
    ];
    check("Kepler, e = 0.5", &plan, orbit(0.0, 100));
}

#[test]
fn an_orbit_of_eccentricity_nine_tenths_converges_at_the_nominal_orders() {
    let plan = [
        (KDK, 2.0, from(8000)),
        (SUBSTEP, 2.0, from(4000)),
        (FORWARD, 4.0, from(2000)),
    ];
    check("Kepler, e = 0.9", &plan, orbit(1.0, 100));
}

// Charges in magnetic and electric fields.

/// Error of position and velocity at the end, the latter over the gyration frequency; and the
/// largest relative change of the speed.
fn gyration(row: [Row<'_>; 2], scheme: Scheme, count: u32) -> [f64; 2] {
    let [start, end] = row;
    let mut world = unbounded(end.number("t") / f64::from(count));
    let ball = insert_ball(&mut world, 1.0, start.vector("", ""), start.vector("v", ""));
    let magnetic = Field::magnetic(start.vector("B", ""));
    let electric = Field::uniform(start.vector("E", "")).coupled_to_axis(Axis::Charge);
    let mut fields = build(magnetic.sum_union(electric), scheme);
    let charge = ColliderProperties::new().charge(start.number("q_over_m"));
    let collider = world.bodies[ball].colliders()[0];
    let set = fields.set_properties(collider, charge, &world.colliders);
    set.expect("a collider");
    let speed = start.vector("v", "").length();
    let mut change = Vec::new();
    for _ in 0..count {
        steps(&mut fields, &mut world, 1);
        change.push((state(&world, ball).1.length() / speed - 1.0).abs());
    }
    let (x, v) = state(&world, ball);
    let off = v.distance(end.vector("v", "")) / start.number("omega_c");
    [x.distance(end.vector("", "")).hypot(off), largest(change)]
}

fn gyrations(text: &'static str) -> Vec<[Row<'static>; 2]> {
    let table: &'static Table = Box::leak(Box::new(Table::parse(text)));
    let rows: Vec<Row<'static>> = table.rows().collect();
    let cases = rows.chunks_exact(101);
    cases.map(|case| [case[0], case[100]]).collect()
}

#[test]
fn magnetic_helix_and_drift_converge_at_the_nominal_orders() {
    let cases = gyrations(include_str!("../data/h_stiff/magnetic.csv"));
    assert_eq!(cases.len(), 8);
    // Two without an electric field, two with one.
    for case in [0, 3, 4, 6] {
        let plan = [
            (KDK, 2.0, from(300)),
            (SUBSTEP, 2.0, from(150)),
            (FORWARD, 4.0, from(150)),
        ];
        let run = |scheme, count| gyration(cases[case], scheme, count)[0];
        check(&format!("helix, case {case}"), &plan, run);
    }
}

/// At any step, also one of half a turn and more.
#[test]
fn a_magnetic_field_keeps_the_speed() {
    for (case, rows) in gyrations(include_str!("../data/h_stiff/magnetic.csv"))[..4]
        .iter()
        .enumerate()
    {
        for scheme in [KDK, SUBSTEP, FORWARD] {
            for count in [1000, 100, 10, 4] {
                let change = gyration(*rows, scheme, count)[1];
                println!("helix {case}, {scheme:?}, {count} steps: speed off by {change:.1e}");
                crate::support::assert_at_most(change, 5e-14, "speed");
            }
        }
    }
}

// The dipole pendulum.

fn pendulum(case: f64) -> impl Fn(Scheme, u32) -> f64 {
    let table = Table::parse(include_str!("../data/h_stiff/dipole_pendulum.csv"));
    move |scheme, count| {
        let rows: Vec<Row<'_>> = table.rows().filter(|r| r.number("case") == case).collect();
        let (start, end) = (rows[0], rows[70]);
        let mut world = unbounded(end.number("t") / f64::from(count));
        let tilted = |row: Row<'_>| DQuat::from_rotation_x(row.number("theta"));
        let pose = Pose::from_rotation(tilted(start));
        let molecule = put(&mut world, pose, DVec3::ZERO, DVec3::ZERO);
        let field = Field::uniform(Vector::Z * -start.number("E_unit"));
        let field = field.coupled_to_axis(Axis::Charge);
        let mut fields = ammonia_fields(&world, &[molecule], field.into(), scheme);
        steps(&mut fields, &mut world, count);
        let body = &world.bodies[molecule.body];
        let axis = to_dpose3(body.position()).rotation * DVec3::Z;
        axis.distance(tilted(end) * DVec3::Z)
    }
}

fn put(world: &mut PhysicsWorld, pose: Pose, linvel: DVec3, angvel: DVec3) -> Molecule {
    let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
    let molecule = insert_molecule(bodies, colliders, pose, linvel, angvel);
    // The trajectories of the files were computed without hard cores.
    for site in molecule.sites {
        world.colliders[site].set_collision_groups(InteractionGroups::none());
    }
    molecule
}

fn ammonia_fields(
    world: &PhysicsWorld,
    molecules: &[Molecule],
    tree: Tree,
    scheme: Scheme,
) -> Fields {
    let builder = Fields::builder(tree).axis("lj", 0.0).scheme(scheme);
    let mut fields = builder.build().expect("a valid tree");
    for (handle, site) in ammonia::sites(molecules) {
        let properties = ColliderProperties::new()
            .charge(site.charge)
            .axis("lj", ammonia::dispersion(&site));
        let set = fields.set_properties(handle, properties, &world.colliders);
        set.expect("a collider of the world");
    }
    fields
}

#[test]
fn a_dipole_pendulum_converges_at_the_nominal_orders() {
    for case in [0.0, 1.0, 3.0] {
        let plan = [
            (KDK, 2.0, from(80)),
            (SUBSTEP, 2.0, from(40)),
            (FORWARD, 4.0, from(40)),
            (IMPLICIT, 1.0, from(8000)),
        ];
        check(&format!("pendulum, case {case}"), &plan, pendulum(case));
    }
}

// Free tops, under a tree that could turn them but is out of reach.

fn top(text: &'static str, moments: DVec3, sample: usize) -> impl Fn(Scheme, u32) -> f64 {
    let table = Table::parse(text);
    move |scheme, count| {
        let rows: Vec<Row<'_>> = table.rows().collect();
        let (start, end) = (rows[0], rows[sample]);
        let mut world = unbounded(end.number("t") / f64::from(count));
        let properties = MassProperties::new(Vector::ZERO, 1.0, moments);
        let top = RigidBodyBuilder::dynamic()
            .pose(Pose::from_rotation(start.attitude("")))
            .angvel(start.vector("w", ""))
            .additional_mass_properties(properties)
            .can_sleep(false)
            .allow_fast_rotation(true);
        let (top, _) = world.insert(top, ColliderBuilder::ball(0.1).density(0.0));
        let far = Field::spring(1.0).within(Region::ball(1.0));
        let mut fields = build(far.at(Vector::X * 100.0), scheme);
        steps(&mut fields, &mut world, count);
        let (is, was) = (*world.bodies[top].rotation(), end.rotation(""));
        2.0 * (is - was).length().min((is + was).length())
    }
}

const ASYMMETRIC: DVec3 = DVec3::new(1.557596206665039, 2.5878665447235107, 1.1970621347427368);

#[test]
fn free_tops_turn_exactly_at_any_step() {
    let side = include_str!("../data/e_free_top/top_largest_inertia_side.csv");
    let fast = include_str!("../data/e_free_top/top_smallest_inertia_side_fast.csv");
    let flip = include_str!("../data/e_free_top/top_near_intermediate_axis_dzhanibekov.csv");
    let tops = [
        ("largest side", side, 60, 1e-10),
        ("smallest side, fast", fast, 60, 1e-10),
        ("intermediate", flip, 20, 1e-10),
    ];
    for (name, text, sample, bound) in tops {
        let run = top(text, ASYMMETRIC, sample);
        for scheme in [KDK, SUBSTEP, FORWARD] {
            for count in [20, 200, 2000] {
                let error = run(scheme, count);
                println!("{name}, {scheme:?}, {count} steps: {error:.1e}");
                crate::support::assert_at_most(error, bound, name);
            }
        }
    }
}

/// A symmetric top is turned exactly, whatever the step.
#[test]
fn ammonia_turns_freely_to_rounding() {
    let text = include_str!("../data/e_free_top/top_ammonia_symmetric.csv");
    let run = top(text, DVec3::from_array(PRINCIPAL_INERTIA), 199);
    for scheme in [KDK, SUBSTEP, FORWARD] {
        for count in [20, 200] {
            let error = run(scheme, count);
            println!("free ammonia, {scheme:?}, {count} steps: {error:.1e}");
            crate::support::assert_at_most(error, 1e-12 * f64::from(count), "attitude");
        }
    }
}

// Drag.

#[test]
fn drag_converges_at_the_nominal_orders() {
    let rate = 3.0_f64;
    let linear = |scheme, count: u32| {
        let mut world = unbounded(1.0 / f64::from(count));
        let ball = insert_ball(&mut world, 0.5, Vector::ZERO, Vector::X);
        let mut fields = build(Field::drag(0.5 * rate, 0.0), scheme);
        steps(&mut fields, &mut world, count);
        let (x, v) = state(&world, ball);
        let left = (-rate).exp();
        (x.x - (1.0 - left) / rate).hypot(v.x - left)
    };
    let quadratic = |scheme, count: u32| {
        let mut world = unbounded(1.0 / f64::from(count));
        let ball = insert_ball(&mut world, 0.5, Vector::ZERO, Vector::X * 2.0);
        let mut fields = build(Field::drag(0.0, 0.5 * rate), scheme);
        steps(&mut fields, &mut world, count);
        let (x, v) = state(&world, ball);
        let (speed, slowed) = (2.0, 1.0 + rate * 2.0);
        (x.x - slowed.ln() / rate).hypot(v.x - speed / slowed)
    };
    let plan = [
        (KDK, 2.0, from(40)),
        (SUBSTEP, 2.0, from(20)),
        (FORWARD, 4.0, from(20)),
        (IMPLICIT, 1.0, from(400)),
        (Scheme::Kick, 1.0, from(200)),
    ];
    check("linear drag", &plan, linear);
    let plan = [
        (KDK, 2.0, from(160)),
        (SUBSTEP, 2.0, from(80)),
        (FORWARD, 4.0, from(80)),
        (IMPLICIT, 1.0, from(800)),
    ];
    check("quadratic drag", &plan, quadratic);
}

// Molecules in each other's fields.

/// Error of position at a sample of a trajectory of several molecules.
fn molecules(text: &'static str, count: usize, sample: usize) -> impl Fn(Scheme, u32) -> f64 {
    let table = Table::parse(text);
    move |scheme, steps_per_sample| {
        let rows: Vec<Row<'_>> = table.rows().collect();
        let samples: Vec<&[Row<'_>]> = rows.chunks_exact(count).collect();
        let interval = samples[1][0].number("t");
        let mut world = unbounded(interval / f64::from(steps_per_sample));
        let place = |row: &Row<'_>| {
            let (v, w) = (row.vector("v", ""), row.vector("w", ""));
            put(&mut world, row.pose(""), v, w)
        };
        let molecules: Vec<Molecule> = samples[0].iter().map(place).collect();
        let tree = ammonia::tree(&molecules, crate::lab::scenes::ammonia::COULOMB);
        let mut fields = ammonia_fields(&world, &molecules, tree, scheme);
        steps(&mut fields, &mut world, steps_per_sample * sample as u32);
        let errors = molecules
            .iter()
            .zip(samples[sample])
            .map(|(molecule, row)| state(&world, molecule.body).0.distance(row.vector("", "")));
        largest(errors)
    }
}

#[test]
fn molecules_in_each_others_fields_converge_at_the_nominal_orders() {
    let bound = include_str!("../data/c_trajectories/dimer_bound.csv");
    let scatter = include_str!("../data/c_trajectories/dimer_scatter.csv");
    let cluster = include_str!("../data/c_trajectories/cluster8.csv");
    let cases = [
        ("bound dimer", bound, 2, 25),
        ("scattered dimer", scatter, 2, 20),
        ("eight molecules", cluster, 8, 10),
    ];
    for (name, text, count, sample) in cases {
        let plan = [
            (KDK, 2.0, from(40)),
            (SUBSTEP, 2.0, from(20)),
            (FORWARD, 4.0, from(20)),
        ];
        check(name, &plan, molecules(text, count, sample));
    }
}

// Everything on: a charge on a spring, in a magnetic field, with drag, under the world's gravity, a force
// of the user's own and Rapier's damping.

/// Position and velocity at the end, from [x, v, 1]' = A [x, v, 1].
fn everything(end: f64) -> (DVec3, DVec3) {
    type Matrix7 = rapier3d_fields::rapier::na::SMatrix<f64, 7, 7>;
    let mut rate = Matrix7::zeros();
    for axis in 0..3 {
        rate[(axis, 3 + axis)] = 1.0;
        rate[(3 + axis, axis)] = -20.0;
        // Drag over the mass, and damping.
        rate[(3 + axis, 3 + axis)] = -0.5 - 0.4;
    }
    // v × B about z, for a charge of 3 on a mass of 2.
    rate[(3, 4)] = 1.5 * 2.0;
    rate[(4, 3)] = -1.5 * 2.0;
    rate[(4, 6)] = -9.81;
    rate[(5, 6)] = 4.0 / 2.0;
    let now = (rate * end).exp();
    let start = [1.0, 0.0, 0.5, 0.0, 2.0, 1.0, 1.0];
    let start = rapier3d_fields::rapier::na::SVector::<f64, 7>::from(start);
    let end = now * start;
    (
        DVec3::new(end[0], end[1], end[2]),
        DVec3::new(end[3], end[4], end[5]),
    )
}

#[test]
fn all_forces_together_converge_at_the_nominal_orders() {
    let run = |scheme, count: u32| {
        let end = 1.5;
        let mut world = unbounded(end / f64::from(count));
        world.gravity = Vector::Y * -9.81;
        let (place, velocity) = (Vector::new(1.0, 0.0, 0.5), Vector::new(0.0, 2.0, 1.0));
        let ball = insert_ball(&mut world, 2.0, place, velocity);
        world.bodies[ball].set_linear_damping(0.4);
        world.bodies[ball].add_force(Vector::Z * 4.0, true);
        let part = world.bodies[ball].colliders()[0];
        let spring = Tree::from(Field::spring(40.0));
        let tree = spring
            .sum_union(Field::magnetic(Vector::Z * 2.0))
            .sum_union(Field::drag(1.0, 0.0));
        let mut fields = build(tree, scheme);
        let charge = ColliderProperties::new().charge(3.0);
        fields
            .set_properties(part, charge, &world.colliders)
            .expect("a collider");
        steps(&mut fields, &mut world, count);
        let (x, v) = state(&world, ball);
        let (there, then) = everything(end);
        x.distance(there).hypot(v.distance(then) / 20.0_f64.sqrt())
    };
    let auto = Scheme::auto(0.1);
    let plan = [
        (KDK, 2.0, from(80)),
        (SUBSTEP, 2.0, from(40)),
        (FORWARD, 4.0, from(40)),
        (IMPLICIT, 1.0, from(4000)),
        (auto, 2.0, from(80)),
    ];
    check("everything on", &plan, run);
}

/// A top with damping in a field that turns it, under gravity: against a run with finer steps.
#[test]
fn tops_with_damping_converge_at_the_nominal_orders() {
    let run = |scheme, count: u32| {
        let end = 1.0;
        let mut world = unbounded(end / f64::from(count));
        world.gravity = Vector::Y * -9.81;
        let body = RigidBodyBuilder::dynamic()
            .angvel(Vector::new(0.5, 3.0, 1.0))
            .angular_damping(0.7)
            .linear_damping(0.3)
            .can_sleep(false);
        let slab = ColliderBuilder::cuboid(0.5, 0.3, 0.1).density(10.0);
        let (top, _) = world.insert(body, slab);
        let arm = ColliderBuilder::ball(0.01).density(0.0);
        let arm = arm.translation(Vector::new(0.4, 0.1, 0.05));
        let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
        let arm = colliders.insert_with_parent(arm, top, bodies);
        let mut fields = build(Field::spring(3.0).at(Vector::X * 0.7), scheme);
        fields
            .set_properties(arm, ColliderProperties::new(), &world.colliders)
            .expect("a collider");
        steps(&mut fields, &mut world, count);
        let (x, _) = state(&world, top);
        (x, *world.bodies[top].rotation())
    };
    let exact = run(FORWARD, 4000);
    let off = |scheme, count| {
        let (x, q) = run(scheme, count);
        // The angle by its sine, since the cosine loses half of the digits.
        let turn = q * exact.1.inverse();
        x.distance(exact.0).hypot(2.0 * turn.xyz().length())
    };
    let plan = [(KDK, 2.0, from(100)), (SUBSTEP, 2.0, from(50))];
    check("tops with damping", &plan, off);
    // At finer steps the free rotation limits the error.
    let errors = [25, 50].map(|count| off(FORWARD, count));
    assert_order(&errors, 4.0, ORDER_BAND, "tops with damping, Forward4");
}
