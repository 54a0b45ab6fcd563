//! Each scheme is the integrator of its name: in a harmonic well its steps are those of the textbook, to rounding.

use rapier3d_fields::math::{DVec3, Real, from_dvec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{Row, Table, assert_at_most, build, either, insert_ball, largest, weightless};

const MAPS: &str = include_str!("../data/h_stiff/integrator_maps.csv");

/// The rows of the file whose first column is `name`, without that column.
fn rows(name: &str) -> Table {
    let numbers = MAPS.lines().filter_map(|line| {
        if line.starts_with("scheme,") {
            return line.split_once(',').map(|(_, rest)| rest.to_owned());
        }
        line.strip_prefix(name)?
            .strip_prefix(',')
            .map(str::to_owned)
    });
    let text: Vec<String> = numbers.collect();
    Table::parse(text.join("\n").leak())
}

/// The map of `count` steps at dt·ω = `h`: where (1, 0) and (0, 1) go, in x and v/ω.
fn map(scheme: Scheme, iterations: usize, h: f64, count: u32) -> [DVec3; 2] {
    // dt = 1, so that ω = h to the last bit.
    let starts = [(1.0, 0.0), (0.0, 1.0)];
    starts.map(|(x, v)| {
        let mut world = weightless(1.0);
        world.integration_parameters.num_solver_iterations = iterations;
        world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
        world.integration_parameters.max_ccd_substeps = 0;
        let place = from_dvec3(DVec3::X * x);
        let speed = from_dvec3(DVec3::X * (v * h));
        let ball = insert_ball(&mut world, 1.0, place, speed);
        let spring = Field::spring(from_f64(h * h));
        let fields = Fields::builder(spring).scheme(scheme).build();
        let mut fields = fields.expect("a valid tree");
        for _ in 0..count {
            fields.step(&mut world).expect("a finite step");
        }
        let body = &world.bodies[ball];
        let (x, v) = (to_dvec3(body.translation()), to_dvec3(body.linvel()));
        DVec3::new(x.x, v.x / h, 0.0)
    })
}

/// Compares all rows of a scheme; one step of ours is `divide` steps of the file.
fn compare(name: &str, scheme: Scheme, iterations: usize, divide: u32) {
    let rounding = match scheme {
        // Solving a linear equation adds roundings.
        Scheme::LinearlyImplicit => 60.0 * to_f64(Real::EPSILON),
        _ => 20.0 * to_f64(Real::EPSILON),
    };
    let table = rows(name);
    let mut worst = (0.0, String::new());
    let mut compared = 0;
    for row in table.rows() {
        let (h, count) = (row.number("h"), row.number("n") as u32);
        let entries = ["a", "b", "c", "d"].map(|entry| row.number(entry));
        let size = largest(entries.map(f64::abs));
        // Rounding dominates larger maps, and the body is soon too fast for Rapier.
        if size > 1e8 || count % divide != 0 {
            continue;
        }
        let [from_x, from_v] = map(scheme, iterations, h * f64::from(divide), count / divide);
        let found = [from_x.x, from_v.x, from_x.y, from_v.y];
        let errors = found.iter().zip(entries).map(|(f, e)| (f - e).abs());
        let error = largest(errors) / size.max(1.0);
        // Each step rounds a few times; near the limit of stability the map is a shear, and roundings grow linearly.
        let relative = error / (f64::from(count) * f64::from(count)).max(1.0);
        if relative > worst.0 || error.is_nan() {
            worst = (relative, format!("h = {h}, n = {count}, error {error:.1e}"));
        }
        compared += 1;
    }
    println!(
        "{name} as {scheme:?}: {compared} rows, worst {:.1e} at {}",
        worst.0, worst.1
    );
    assert!(compared >= 30, "{compared} rows of {name}");
    assert_at_most(worst.0, rounding, format!("{name}, {}", worst.1));
}

#[test]
fn kick_is_symplectic_euler() {
    for iterations in [1, 4] {
        compare("symplectic_euler_kick_drift", Scheme::Kick, iterations, 1);
    }
}

#[test]
fn kick_drift_kick_is_velocity_verlet() {
    for iterations in [1, 4] {
        compare("velocity_verlet_kdk", Scheme::KickDriftKick, iterations, 1);
    }
}

#[test]
fn substeps_are_velocity_verlet_at_smaller_steps() {
    for count in [1, 2, 5] {
        let scheme = Scheme::substeps(count);
        compare("velocity_verlet_kdk", scheme, 4, count);
    }
}

#[test]
fn linearly_implicit_is_implicit_euler() {
    compare("implicit_euler", Scheme::LinearlyImplicit, 4, 1);
}

#[test]
fn external_forces_are_frozen_over_the_solver_iterations() {
    for iterations in [2, 4, 8] {
        let name = format!("const_force_over_{iterations}_substeps");
        compare(&name, Scheme::ExternalForce, iterations, 1);
    }
    compare("symplectic_euler_kick_drift", Scheme::ExternalForce, 1, 1);
}

/// The comparison can fail.
#[test]
fn another_scheme_differs_from_the_map() {
    let table = rows("velocity_verlet_kdk");
    let is_far = |row: Row<'_>| {
        let [x, _] = map(Scheme::Kick, 4, row.number("h"), row.number("n") as u32);
        (x.x - row.number("a")).abs() > 1e-3
    };
    let rows = table.rows().filter(|row| row.number("h") == 0.5);
    assert!(rows.filter(|row| is_far(*row)).count() >= 3);
}

/// Rapier's gravity on a body that leaves the only field, which acts across it: the height is that of a parabola at any
/// time, although Rapier alone moves the body in the end.
#[test]
fn a_body_that_leaves_a_field_stays_on_its_parabola() {
    const DT: f64 = 1.0 / 60.0;
    for scheme in [
        Scheme::KickDriftKick,
        Scheme::Forward4,
        Scheme::Substep(Substeps::Fixed(4)),
        Scheme::auto(1e-3),
    ] {
        let mut world = weightless(from_f64(DT));
        world.gravity = Vector::Y * -9.81;
        let body = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::X * 3.0);
        let region = Region::interval("x", -1.0, 1.0);
        let mut fields = build(Field::uniform(Vector::Z).within(region), scheme);
        for step in 1..=60 {
            fields.step(&mut world).expect("a step");
            let time = f64::from(step) * DT;
            let height = to_f64(world.bodies[body].translation().y);
            let off = (height + 0.5 * 9.81 * time * time).abs();
            // Rounding: the largest is 3.3e-6 and 4e-15.
            assert_at_most(off, either(5e-6, 1e-14), format!("{scheme:?}, step {step}"));
        }
    }
}
