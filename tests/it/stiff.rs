//! Fields too stiff for the step: schemes that damp lose energy, adaptive schemes keep their tolerance, the others
//! warn.

use rapier3d_fields::math::{DVec3, Real, from_dvec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{
    Row, Table, assert_at_most, assert_close, build, insert_ball, largest, weightless,
};

const TOLERANCE: f64 = 1e-3;

fn auto() -> Scheme {
    Scheme::auto(from_f64(TOLERANCE))
}

fn unbounded(dt: f64) -> PhysicsWorld {
    let mut world = weightless(from_f64(dt));
    world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
    world.integration_parameters.max_ccd_substeps = 0;
    world
}

fn state(world: &PhysicsWorld, body: RigidBodyHandle) -> (DVec3, DVec3) {
    let body = &world.bodies[body];
    (to_dvec3(body.translation()), to_dvec3(body.linvel()))
}

/// The first rows of all cases of a file.
fn starts(text: &'static str) -> Vec<Vec<Row<'static>>> {
    let table: &'static Table = Box::leak(Box::new(Table::parse(text)));
    let mut cases: Vec<Vec<Row<'static>>> = Vec::new();
    for row in table.rows() {
        let case = row.number("case") as usize;
        cases.resize_with(cases.len().max(case + 1), Vec::new);
        cases[case].push(row);
    }
    cases
}

// Wells.

/// Energies of an oscillator after each step, relative to that at its start, over `count` steps;
/// and its states, as (x, v/ω) over the size of the first.
fn swing(row: Row<'_>, scheme: Scheme, count: u32) -> (Vec<f64>, Vec<[f64; 2]>) {
    let [m, w, zeta] = ["m", "w", "zeta"].map(|name| row.number(name));
    let mut world = unbounded(row.number("dt"));
    let x0 = from_dvec3(DVec3::X * row.number("x0"));
    let v0 = from_dvec3(DVec3::X * row.number("v0"));
    let ball = insert_ball(&mut world, from_f64(m), x0, v0);
    let well = Field::spring_damper(from_f64(m * w * w), from_f64(2.0 * m * zeta * w), 0.0);
    let mut fields = build(well, scheme);
    let size = row.number("x0").hypot(row.number("v0") / w);
    let mut states = Vec::new();
    for _ in 0..count {
        fields.step(&mut world).expect("a finite step");
        let (x, v) = state(&world, ball);
        states.push([x.x / size, v.x / w / size]);
    }
    let energies = states.iter().map(|[x, v]| x * x + v * v);
    (energies.collect(), states)
}

const WELLS: &str = include_str!("../data/h_stiff/oscillators.csv");

#[test]
fn linearly_implicit_never_gains_energy() {
    let mut count = 0;
    for case in starts(WELLS) {
        let (energies, _) = swing(case[0], Scheme::LinearlyImplicit, 1000);
        let mut last = 1.0;
        for (step, energy) in energies.into_iter().enumerate() {
            let place = format!("dt·ω = {}, step {step}", case[0].number("w_dt"));
            assert!(
                energy <= last * (1.0 + 1e-9) + rounding(),
                "{place}: {energy} after {last}"
            );
            last = energy;
        }
        count += 1;
    }
    assert_eq!(count, 75);
}

/// Some roundings of a number of order one.
fn rounding() -> f64 {
    10.0 * to_f64(Real::EPSILON)
}

/// The energy of kick-drift-kick oscillates within the tolerance, and grows no further.
#[test]
fn auto_never_gains_energy() {
    let mut worst = 0.0_f64;
    for case in starts(WELLS) {
        // Drag leaves less than a millionth of the energy by then, and such steps are the slowest.
        let fades = case[0].number("zeta") > 0.0 && case[0].number("w_dt") > 4.0;
        let count = if fades { 200 } else { 1000 };
        let (energies, _) = swing(case[0], auto(), count);
        let most = largest(energies);
        let place = format!(
            "dt·ω = {}, ζ = {}",
            case[0].number("w_dt"),
            case[0].number("zeta")
        );
        assert_at_most(most, 1.0 + 1.1 * TOLERANCE, place);
        worst = worst.max(most);
    }
    println!("most energy: {worst}");
}

/// Where the well is not so stiff that `Auto` must damp, it also follows the motion.
#[test]
fn auto_follows_wells_that_it_need_not_damp() {
    for case in starts(WELLS) {
        let row = case[0];
        let (w, h, zeta) = (row.number("w"), row.number("w_dt"), row.number("zeta"));
        // Up to here 32 substeps keep dt·ω, and the damping number 2 ζ dt·ω, within the tolerance.
        if h > 1.9 || zeta > 1.0 {
            continue;
        }
        let (_, states) = swing(row, auto(), 100);
        let size = row.number("x0").hypot(row.number("v0") / w);
        for expected in case
            .iter()
            .filter(|row| (1.0..=100.0).contains(&row.number("n")))
        {
            let n = expected.number("n");
            let [x, v] = states[n as usize - 1];
            let off = (x - expected.number("x") / size).hypot(v - expected.number("v") / w / size);
            // Velocity Verlet is off by the oscillation of its energy, and in phase by a share of (dt·ω)²/24; drag adds
            // no more.
            let bound = TOLERANCE * (1.0 + n * h / 6.0) + n * rounding();
            assert_at_most(off, bound, format!("dt·ω = {h}, ζ = {zeta}, step {n}"));
        }
    }
}

/// Shows that the test of energies can fail.
#[test]
fn kick_drift_kick_explodes_beyond_its_limit() {
    for case in starts(WELLS) {
        let (h, zeta) = (case[0].number("w_dt"), case[0].number("zeta"));
        if zeta == 0.0 && h > 2.0 && h < 10.0 {
            let (energies, _) = swing(case[0], Scheme::KickDriftKick, 8);
            assert!(largest(energies) > 1.5, "dt·ω = {h}");
        }
    }
}

// Drag.

/// Velocities of a ball in drag relative to `limit`, its terminal velocity, at the start and after each of 50 steps,
/// over the first of these speeds.
fn slow(row: Row<'_>, law: &str, scheme: Scheme) -> Vec<DVec3> {
    let mut world = unbounded(row.number("dt"));
    let (x, v, g) = (
        row.vector("", "0"),
        row.vector("v", "0"),
        row.vector("g", ""),
    );
    let mass = 2.0;
    let ball = insert_ball(&mut world, from_f64(mass), from_dvec3(x), from_dvec3(v));
    let k = from_f64(mass * row.number("k"));
    let drag = match law {
        "quadratic" => Field::drag(0.0, k),
        _ => Field::drag(k, 0.0),
    };
    let gravity = Field::uniform(from_dvec3(g)).force_mode(ForceMode::Acceleration);
    let mut fields = build(drag.sum_union(gravity), scheme);
    let limit = if law == "quadratic" {
        DVec3::ZERO
    } else {
        g / row.number("k")
    };
    let first = v - limit;
    let mut left = vec![first / first.length()];
    for _ in 0..50 {
        fields.step(&mut world).expect("a finite step");
        left.push((state(&world, ball).1 - limit) / first.length());
    }
    left
}

/// The first row of each case of the drag file, with its law, which is a word.
fn drags() -> Vec<(String, Row<'static>)> {
    let text = include_str!("../data/h_stiff/drag.csv");
    let mut laws = Vec::new();
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let numbers = lines.map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        laws.push(cells[1].to_owned());
        [&cells[..1], &cells[2..]].concat().join(",")
    });
    let numbers: Vec<String> = numbers.collect();
    let table: &'static Table = Box::leak(Box::new(Table::parse(numbers.join("\n").leak())));
    laws.into_iter()
        .skip(1)
        .zip(table.rows())
        .filter(|(_, row)| row.number("n") == 0.0)
        .collect()
}

#[test]
fn drag_is_monotone_at_any_step() {
    let cases = drags();
    assert!(cases.iter().any(|(_, row)| row.number("k_dt") > 999.0));
    for (law, row) in cases {
        for scheme in [Scheme::LinearlyImplicit, auto()] {
            let left = slow(row, &law, scheme);
            let way = left[0];
            for (step, pair) in left.windows(2).enumerate() {
                let (was, is) = (pair[0].dot(way), pair[1].dot(way));
                let place = format!(
                    "{law}, {scheme:?}, k·dt = {}, step {step}",
                    row.number("k_dt")
                );
                // The rest may be the rounding of a much larger velocity.
                let slack = rounding() * (1.0 + row.vector("g", "").length() / row.number("k"));
                assert!(is <= was + slack, "{place}: {is} after {was}");
                assert!(is >= -slack, "{place}: beyond, {is}");
            }
        }
    }
}

// Reports.

#[test]
fn stiffness_is_that_of_the_closed_form() {
    let mut world = unbounded(0.01);
    let place = Vector::new(0.3, -0.2, 0.5);
    let ball = insert_ball(&mut world, 4.0, place, Vector::new(0.1, 0.2, 0.3));
    world.step();
    let drag = Field::spring(100.0).sum_union(Field::drag(12.0, 0.0));
    let turn = Field::magnetic(Vector::Y * 8.0);
    let mut fields = build(drag.sum_union(turn), Scheme::KickDriftKick);
    let charge = ColliderProperties::new().charge(2.0);
    let collider = world.bodies[ball].colliders()[0];
    fields
        .set_properties(collider, charge, &world.colliders)
        .expect("a collider");
    let report = fields.stiffness(ball, 0.01, &world);
    let report = report.expect("finite").expect("a dynamic body");
    println!("{report:?}");
    let bound = 1e-5;
    assert_close(to_f64(report.dt_omega), 0.05, bound, "√(100/4) dt");
    assert_close(to_f64(report.dt_damping), 0.03, bound, "12/4 dt");
    assert_close(to_f64(report.dt_gyration), 0.04, bound, "2·8/4 dt");
    // From the eigenvalues of the map of a step with half kicks exp(½ h (−3 + 4i)), in the plane that turns.
    let largest = to_f64(report.largest_stable_dt);
    assert_close(
        largest,
        0.410_246_615,
        1e-4,
        "2/ω without drag and gyration",
    );
    let bad = fields.stiffness(ball, Real::NAN, &world);
    assert!(matches!(bad, Err(StepError::TimeStep { .. })));
}

/// A dumbbell in a field that pulls its ends apart: it swings about its middle at ω² = 2 F a / I.
#[test]
fn stiffness_counts_rotation() {
    let mut world = unbounded(0.01);
    let body = RigidBodyBuilder::dynamic();
    let (rod, end) = world.insert(
        body,
        ColliderBuilder::ball(0.1).mass(1.0).translation(Vector::X),
    );
    let other = ColliderBuilder::ball(0.1).mass(1.0).translation(-Vector::X);
    let other = world
        .colliders
        .insert_with_parent(other, rod, &mut world.bodies);
    world.step();
    let pull = Field::uniform(Vector::X * 50.0).coupled_to_axis(Axis::Charge);
    let mut fields = build(pull, Scheme::KickDriftKick);
    for (collider, charge) in [(end, 1.0), (other, -1.0)] {
        let charge = ColliderProperties::new().charge(charge);
        fields
            .set_properties(collider, charge, &world.colliders)
            .expect("a collider");
    }
    let report = fields.stiffness(rod, 0.01, &world);
    let report = report.expect("finite").expect("a dynamic body");
    let inertia = 2.0 * (1.0 + 0.4 * 0.01);
    let omega = (2.0 * 50.0 / inertia).sqrt();
    assert_close(to_f64(report.dt_omega), 0.01 * omega, 1e-5, "dt·ω");
}

#[test]
fn a_stiff_well_is_warned_of_and_an_edge_is_not() {
    let mut world = unbounded(0.1);
    let ball = insert_ball(&mut world, 1.0, Vector::X, Vector::X * 0.1);
    let mut fields = build(Field::spring(225.0), Scheme::KickDriftKick);
    let outcome = fields.step(&mut world).expect("a finite step");
    assert_eq!(outcome.warnings, 1);
    let [
        StepWarning::Stiff {
            body,
            dt_omega,
            largest_stable_dt,
        },
    ] = *fields.warnings()
    else {
        panic!("{:?}", fields.warnings());
    };
    assert_eq!(body, ball);
    assert_close(to_f64(dt_omega), 1.5, 1e-4, "dt·ω");
    assert_close(to_f64(largest_stable_dt), 2.0 / 15.0, 1e-5, "2/ω");

    // A ball enters a wind: its force changes by as much as in a stiff well.
    let mut world = unbounded(0.1);
    insert_ball(&mut world, 1.0, Vector::X * -0.05, Vector::X);
    let wind = Field::uniform(Vector::X * 500.0).within(Region::half_space(-Vector::X, 0.0));
    let mut fields = build(wind, Scheme::KickDriftKick);
    for _ in 0..3 {
        let outcome = fields.step(&mut world).expect("a finite step");
        assert_eq!(outcome.warnings, 0, "{:?}", fields.warnings());
    }
}

#[test]
fn speeds_that_rapier_would_cap_are_reported() {
    let mut world = weightless(0.1);
    let fast = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::ZERO);
    let body = RigidBodyBuilder::dynamic()
        .translation(Vector::Y * 50.0)
        .can_sleep(false);
    let (turning, _) = world.insert(body, ColliderBuilder::ball(0.5).translation(Vector::X));
    let right = ColliderBuilder::ball(0.5).translation(-Vector::X);
    world
        .colliders
        .insert_with_parent(right, turning, &mut world.bodies);
    let push = Field::uniform(Vector::X * 1e4).within(Region::ball(10.0));
    let there = Field::uniform(Vector::Y * 500.0)
        .coupled_to(Coupling::Each)
        .within(Region::ball(1.2))
        .at(Vector::new(1.0, 50.0, 0.0));
    let mut fields = build(push.sum_union(there), Scheme::KickDriftKick);
    fields.step(&mut world).expect("a finite step");
    let warnings = fields.warnings().to_vec();
    let speed_is_reported = warnings.iter().any(|warning| match *warning {
        StepWarning::SpeedCapped { body, speed, limit } => {
            body == fast && (speed - 500.0).abs() < 1e-3 && limit == 400.0
        }
        _ => false,
    });
    let rotation_is_reported = warnings.iter().any(
        |warning| matches!(warning, StepWarning::RotationCapped { body, .. } if *body == turning),
    );
    assert!(speed_is_reported && rotation_is_reported, "{warnings:?}");
    // Rapier caps the speed, and the ball has left the field.
    assert_close(to_f64(world.bodies[fast].linvel().x), 400.0, 1e-2, "speed");
}

#[test]
fn schemes_with_numbers_out_of_range_are_refused() {
    let bad = [
        Scheme::substeps(0),
        Scheme::substeps(1025),
        Scheme::Substep(Substeps::PerBody { tolerance: 0.0 }),
        Scheme::auto(Real::NAN),
        Scheme::auto(0.3),
        Scheme::auto(-1.0),
    ];
    for scheme in bad {
        let built = Fields::builder(Field::spring(1.0)).scheme(scheme).build();
        assert!(
            matches!(built, Err(BuildError::Parameter { .. })),
            "{scheme:?}"
        );
    }
}

// Choice.

/// A calm well and a stiff one in one world: `Auto` substeps the stiff one, and moves the calm one by kick-drift-kick.
#[test]
fn auto_chooses_body_by_body() {
    let mut world = unbounded(1.0 / 64.0);
    let apart = Vector::Y * 100.0;
    let calm = insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
    let stiff = insert_ball(&mut world, 1.0, apart + Vector::X, Vector::ZERO);
    let wells = |world: &mut PhysicsWorld, scheme| {
        let slow = Field::spring(1.0).within(Region::ball(20.0));
        let fast = Field::spring(1e6).within(Region::ball(20.0)).at(apart);
        let mut fields = build(slow.sum_union(fast), scheme);
        for _ in 0..200 {
            fields.step(world).expect("a finite step");
        }
    };
    let mut alone = unbounded(1.0 / 64.0);
    let twin = insert_ball(&mut alone, 1.0, Vector::X, Vector::ZERO);
    wells(&mut world, auto());
    wells(&mut alone, Scheme::KickDriftKick);
    assert_eq!(
        state(&world, calm),
        state(&alone, twin),
        "kick-drift-kick, bit for bit"
    );
    let (x, v) = state(&world, stiff);
    let energy = (x - to_dvec3(apart)).length_squared() + v.length_squared() / 1e6;
    assert_close(energy, 1.0, 1.1 * TOLERANCE, "energy");
}

/// A ball that flies into a stiff wall does not come out faster.
#[test]
fn auto_survives_a_wall_that_was_not_there_before() {
    for speed in [0.5, 3.0, 40.0] {
        let mut world = unbounded(1.0 / 60.0);
        let start = Vector::X * 5.03;
        let ball = insert_ball(&mut world, 1.0, start, Vector::X * -speed);
        let wall = Field::closure([], |sample: &Sample| {
            Vector::X * (1e7 * -sample.local_point.x.min(0.0))
        });
        let mut fields = build(wall, auto());
        let mut fastest = 0.0_f64;
        for _ in 0..2000 {
            fields.step(&mut world).expect("a finite step");
            fastest = fastest.max(state(&world, ball).1.x);
        }
        println!("in at {speed}, out at {fastest}");
        assert!(
            fastest <= to_f64(speed) * 1.001,
            "in at {speed}, out at {fastest}"
        );
    }
}
