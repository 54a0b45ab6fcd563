//! Helpers of the integration tests: tables, and tolerances that fail on NaN.

pub mod ammonia;
pub mod bits;
pub mod collide;
pub mod drops;
pub mod flight;
pub mod formats;
pub mod model;
pub mod numbers;
pub mod runge_kutta;
pub mod trees;
pub mod worlds;

use proptest::test_runner::Config;
use rapier3d_fields::math::{DQuat, DVec3, Pose, Real, Rotation, from_dvec3, from_f64};
use rapier3d_fields::prelude::*;

/// A file of comma-separated numbers: lines that start with `#`, a line of names, and rows.
pub struct Table {
    names: Vec<&'static str>,
    rows: Vec<Vec<f64>>,
}

impl Table {
    /// Reads the text of a file.
    #[track_caller]
    pub fn parse(text: &'static str) -> Self {
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let header = lines.next().expect("a line of names");
        let names: Vec<_> = header.split(',').collect();
        let rows: Vec<Vec<f64>> = lines
            .map(|line| {
                let cells = line.split(',').map(|cell| cell.parse());
                cells.collect::<Result<_, _>>().expect("numbers")
            })
            .collect();
        assert!(!rows.is_empty(), "a table without rows tests nothing");
        assert!(rows.iter().all(|row| row.len() == names.len()), "ragged");
        Table { names, rows }
    }

    /// The rows from top to bottom.
    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        let names = &self.names;
        self.rows.iter().map(move |cells| Row { names, cells })
    }
}

/// A row of a [`Table`], its cells by the names of their columns.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    names: &'a [&'static str],
    cells: &'a [f64],
}

impl Row<'_> {
    /// The cell in the column `name`.
    #[track_caller]
    pub fn number(&self, name: &str) -> f64 {
        let place = self.names.iter().position(|known| *known == name);
        self.cells[place.unwrap_or_else(|| panic!("no column `{name}`"))]
    }

    /// Three cells: `prefix`, then x, y or z, then `suffix`.
    #[track_caller]
    pub fn vector(&self, prefix: &str, suffix: &str) -> DVec3 {
        let cell = |axis| self.number(&format!("{prefix}{axis}{suffix}"));
        DVec3::new(cell("x"), cell("y"), cell("z"))
    }

    /// A rotation `qw`, `qx`, `qy`, `qz`, each with `suffix`, body to world.
    #[track_caller]
    pub fn rotation(&self, suffix: &str) -> DQuat {
        let q = self.vector("q", suffix);
        DQuat::from_xyzw(q.x, q.y, q.z, self.number(&format!("qw{suffix}"))).normalize()
    }

    /// Its [rotation](Self::rotation), rounded to [`Real`].
    #[track_caller]
    pub fn attitude(&self, suffix: &str) -> Rotation {
        let [x, y, z, w] = self.rotation(suffix).to_array().map(from_f64);
        Rotation::from_xyzw(x, y, z, w).normalize()
    }

    /// A pose `x`, `y`, `z` and its [rotation](Self::rotation), rounded to [`Real`].
    #[track_caller]
    pub fn pose(&self, suffix: &str) -> Pose {
        let translation = from_dvec3(self.vector("", suffix));
        Pose::from_parts(translation, self.attitude(suffix))
    }
}

/// `f32` in the build of that precision, `f64` in the other.
pub fn either(f32: f64, f64: f64) -> f64 {
    if size_of::<Real>() == 4 { f32 } else { f64 }
}

/// The largest of some errors; infinite if one is NaN, which `f64::max` would pass over.
pub fn largest(errors: impl IntoIterator<Item = f64>) -> f64 {
    let errors = errors.into_iter();
    errors.fold(
        0.0,
        |a, b| if b.is_nan() { f64::INFINITY } else { a.max(b) },
    )
}

/// Fails unless `error` is at most `bound`, also on NaN.
#[track_caller]
pub fn assert_at_most(error: f64, bound: f64, place: impl std::fmt::Display) {
    assert!(
        error <= bound,
        "{place}: error {error:.3e} exceeds {bound:.1e}"
    );
}

/// Fails unless `found` is within `tolerance` of `expected`, also on NaN.
#[track_caller]
pub fn assert_close(found: f64, expected: f64, tolerance: f64, place: impl std::fmt::Display) {
    let error = (found - expected).abs();
    assert!(
        error <= tolerance,
        "{place}: found {found:e}, expected {expected:e}, error {error:.3e} exceeds {tolerance:.1e}"
    );
}

/// Orders of convergence of errors at steps that are halved from one to the next.
pub fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect()
}

/// Numbers in a line, for printing.
pub fn scientific(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().map(|x| format!("{x:.2e}")).collect();
    numbers.join(" ")
}

/// Fails unless every halving of the step gains the expected order; prints the orders.
#[track_caller]
pub fn assert_order(errors: &[f64], expected: f64, tolerance: f64, what: &str) {
    let orders = orders(errors);
    println!("{what}: errors {}, orders {orders:.3?}", scientific(errors));
    for order in orders {
        assert_close(order, expected, tolerance, format!("{what}: order"));
    }
}

/// A world without gravity that moves in steps of `dt`, at Rapier's defaults otherwise.
pub fn weightless(dt: Real) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    world.integration_parameters.dt = dt;
    world
}

/// Inserts a ball of radius 0.5 that never sleeps.
pub fn insert_ball(
    world: &mut PhysicsWorld,
    mass: Real,
    position: Vector,
    linvel: Vector,
) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(position)
        .linvel(linvel)
        .can_sleep(false);
    world.insert(body, ColliderBuilder::ball(0.5).mass(mass)).0
}

/// Fields of a tree that is known to be valid.
pub fn build(tree: impl Into<Tree>, scheme: Scheme) -> Fields {
    let builder = Fields::builder(tree).scheme(scheme);
    builder.build().expect("a valid tree")
}

/// This number of random cases, which differ between runs; `CASES_TIMES=100` tries a hundred times as many. Failures are
/// not stored, since they print their plans in full.
pub fn cases(cases: u32) -> Config {
    let times = from_environment("CASES_TIMES", 1);
    let usual = Config::default();
    Config {
        cases: cases * times,
        max_global_rejects: usual.max_global_rejects.saturating_mul(times),
        failure_persistence: None,
        ..usual
    }
}

/// A number that an environment variable may set.
pub fn from_environment(name: &str, otherwise: u32) -> u32 {
    std::env::var(name).map_or(otherwise, |it| it.parse().expect("a number"))
}
