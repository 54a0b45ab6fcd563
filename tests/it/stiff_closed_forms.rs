//! Pair forces over seven decades of distance, and charges and drag in motion, against closed
//! forms. See `data/h_stiff`.

use crate::lab::scenes::ammonia::{COULOMB, LJ_EPSILON, LJ_SIGMA, SITES};
use rapier3d_fields::math::{DVec3, from_dvec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{
    Row, Table, assert_at_most, assert_close, either, insert_ball, orders, scientific, weightless,
};

const RADIAL: &str = include_str!("../data/h_stiff/radial.csv");
const MAGNETIC: &str = include_str!("../data/h_stiff/magnetic.csv");
const DRAG: &str = include_str!("../data/h_stiff/drag.csv");

/// Thirteen roundings of r enter a Lennard-Jones force, and as many products its result.
fn pair_bound() -> f64 {
    20.0 * to_f64(Real::EPSILON)
}

/// Force and energy of a sample of unit charge at a distance from a field at the origin.
fn pair(field: Field, r: f64) -> Result<(f64, f64), StepError> {
    let mut world = weightless(0.001);
    let ball = insert_ball(&mut world, 1.0, Vector::X * from_f64(r), Vector::ZERO);
    let collider = world.bodies[ball].colliders()[0];
    let mut fields = Fields::new(field).expect("a valid tree");
    let unit = ColliderProperties::new().charge(1.0);
    let set = fields.set_properties(collider, unit, &world.colliders);
    set.expect("valid properties");
    let wrench = fields.sample(ball, &world)?;
    let energy = fields.potential_energy(&world);
    Ok((
        to_f64(wrench.expect("a dynamic body").force.x),
        energy.total,
    ))
}

/// Either as close as rounding allows, or refused because it overflows: never wrong, never NaN.
/// Returns whether it was refused.
fn check_pair(field: Field, row: Row<'_>, name: &str, scales: [f64; 2]) -> bool {
    let r = row.number("r");
    let (force, energy) = (
        row.number(&format!("F_{name}")),
        row.number(&format!("U_{name}")),
    );
    let overflows = |x: f64| x.abs() > to_f64(Real::MAX);
    match pair(field, r) {
        Ok((found_force, found_energy)) => {
            assert!(!overflows(force), "{name} at {r}: {found_force:e}");
            let place = format!("force {name} at {r}");
            assert_close(found_force, force, pair_bound() * scales[0], place);
            if !overflows(energy * 8.0) {
                let place = format!("energy {name} at {r}");
                assert_close(found_energy, energy, pair_bound() * scales[1], place);
            }
            false
        }
        Err(error) => {
            assert!(
                matches!(error, StepError::NonFinite { .. }),
                "{name} at {r}: {error}"
            );
            // The overflow may be that of F/r, or of a product on the way to F.
            let largest = scales[0] / r * 2.0;
            assert!(
                overflows(largest),
                "{name} at {r}: {error}, but {largest:e} at most"
            );
            true
        }
    }
}

#[test]
fn lennard_jones_is_right_or_refused_at_all_distances() {
    let mut refused = 0;
    let (mut flagged, mut rows) = (0, 0);
    for row in Table::parse(RADIAL).rows() {
        let (s12, r) = (row.number("s12"), row.number("r"));
        let terms = 4.0 * LJ_EPSILON * (s12 + s12.sqrt());
        let field = Field::lennard_jones(from_f64(LJ_EPSILON), from_f64(LJ_SIGMA));
        let is_refused = check_pair(field, row, "lj", [12.0 * terms / r, terms]);
        refused += u32::from(is_refused);
        flagged += row.number("F_inf32") as u32;
        rows += 1;
    }
    println!("{refused} of {rows} distances refused; in f32 {flagged} forces overflow");
    let expected = either(f64::from(flagged), 0.0);
    assert!(f64::from(refused) >= expected);
    assert!(size_of::<Real>() == 4 || refused == 0);
}

#[test]
fn coulomb_pairs_are_right_at_all_distances() {
    let (nitrogen, hydrogen) = (SITES[0].charge, SITES[1].charge);
    for (name, product) in [
        ("NN", nitrogen * nitrogen),
        ("NH", nitrogen * hydrogen),
        ("HH", hydrogen * hydrogen),
    ] {
        for row in Table::parse(RADIAL).rows() {
            let field = Field::coulomb(from_f64(COULOMB), from_f64(product));
            let scales = [
                row.number(&format!("F_{name}")),
                row.number(&format!("U_{name}")),
            ];
            let refused = check_pair(field, row, name, scales.map(f64::abs));
            assert!(!refused, "{name}");
        }
    }
}

/// A ball of unit mass and charge `charge`, moved to time `t` in `steps` steps: its position and velocity.
fn moved(tree: &Tree, start: (DVec3, DVec3), charge: f64, t: f64, steps: u32) -> (DVec3, DVec3) {
    let mut world = weightless(from_f64(t / f64::from(steps)));
    let (position, velocity) = start;
    let ball = insert_ball(&mut world, 1.0, from_dvec3(position), from_dvec3(velocity));
    let collider = world.bodies[ball].colliders()[0];
    let mut fields = Fields::new(tree.clone()).expect("a valid tree");
    let properties = ColliderProperties::new().charge(from_f64(charge));
    let set = fields.set_properties(collider, properties, &world.colliders);
    set.expect("valid properties");
    for _ in 0..steps {
        fields.step(&mut world).expect("a finite step");
    }
    let body = &world.bodies[ball];
    (to_dvec3(body.translation()), to_dvec3(body.linvel()))
}

/// One motion of a file, its rate (per time), and the row that says where it ends.
struct Case<'a> {
    tree: Tree,
    charge: f64,
    rate: f64,
    end: Row<'a>,
}

impl Case<'_> {
    fn start(&self) -> (DVec3, DVec3) {
        (self.end.vector("", "0"), self.end.vector("v", "0"))
    }

    fn time(&self) -> f64 {
        self.end.number("t")
    }

    /// Distance from the closed form in phase space, positions times the rate, over the largest speed.
    fn error(&self, steps: u32) -> f64 {
        let (x, v) = moved(&self.tree, self.start(), self.charge, self.time(), steps);
        let (x1, v1) = (self.end.vector("", ""), self.end.vector("v", ""));
        let distance = ((x - x1) * self.rate).length().hypot((v - v1).length());
        distance / self.speed()
    }

    fn speed(&self) -> f64 {
        let fastest = |suffix| self.end.vector("v", suffix).length();
        fastest("0").max(fastest(""))
    }

    /// Errors at steps that are halved three times, the first `fraction` of 1/rate.
    fn errors(&self, fraction: f64) -> [f64; 4] {
        let first = (self.rate * self.time() / fraction).ceil() as u32;
        [1, 2, 4, 8].map(|factor| self.error(first.max(2) * factor))
    }

    /// In `f64` checks for second order, in `f32` that the coarsest run is within its truncation error and rounding.
    fn check(&self, fraction: f64, what: &str) {
        if size_of::<Real>() == 4 {
            let steps = (self.rate * self.time() / fraction).ceil().max(2.0);
            // Each step rounds position and velocity; rounded positions count by the rate.
            let place = self
                .end
                .vector("", "")
                .length()
                .max(self.end.vector("", "0").length());
            let rounding =
                steps * f64::from(f32::EPSILON) * (1.0 + place * self.rate / self.speed());
            let truncation = fraction * fraction * (self.rate * self.time()).max(1.0);
            assert_at_most(self.error(steps as u32), truncation + rounding, what);
            return;
        }
        let errors = self.errors(fraction);
        let found = orders(&errors);
        println!("{what}: errors {}, orders {found:.3?}", scientific(&errors));
        // Some motions are followed exactly.
        if errors.iter().any(|error| *error > 1e-12) {
            assert_close(found[2], 2.0, 0.1, format!("{what}: order"));
        }
    }
}

/// Helices and E×B drift, three gyro-periods.
#[test]
fn charges_in_a_magnetic_field_move_at_second_order() {
    let table = Table::parse(MAGNETIC);
    for end in table.rows().filter(|row| row.number("s") == 100.0) {
        let magnetic = Field::magnetic(from_dvec3(end.vector("B", "")));
        let electric = Field::uniform(from_dvec3(end.vector("E", "")));
        let case = Case {
            tree: magnetic.sum_union(electric.coupled_to_axis(Axis::Charge)),
            charge: end.number("q_over_m"),
            rate: end.number("omega_c"),
            end,
        };
        case.check(0.1, &format!("magnetic {}", end.number("case")));
    }
}

/// The kinds of drag, which are words in the file.
const LAWS: [&str; 3] = ["linear", "linear_gravity", "quadratic"];

fn drag_table() -> Table {
    let mut text = DRAG.to_owned();
    for (number, law) in LAWS.iter().enumerate() {
        text = text.replace(&format!(",{law},"), &format!(",{number},"));
    }
    Table::parse(text.leak())
}

#[test]
fn drag_slows_at_second_order() {
    let table = drag_table();
    for row in table.rows() {
        let (law, k, k_dt) = (row.number("law"), row.number("k"), row.number("k_dt"));
        // A few times the time of decay, but not so long that nothing is left to compare.
        let wanted = if k_dt < 0.05 { 100.0 } else { 1.0 };
        if k_dt > 15.0 || row.number("n") != wanted {
            continue;
        }
        let k_real = from_f64(k);
        let gravity =
            Field::uniform(from_dvec3(row.vector("g", ""))).force_mode(ForceMode::Acceleration);
        let (tree, rate) = match law as usize {
            0 => (Field::drag(k_real, 0.0).into(), k),
            1 => (Field::drag(k_real, 0.0).sum_union(gravity), k),
            _ => (
                Field::drag(0.0, k_real).into(),
                k * row.vector("v", "0").length(),
            ),
        };
        let case = Case {
            tree,
            charge: 0.0,
            rate,
            end: row,
        };
        // At coarse steps of a strong quadratic drag two errors cancel each other, and hide the order.
        let fraction = if law == 2.0 && size_of::<Real>() == 8 {
            0.0125
        } else {
            0.05
        };
        case.check(fraction, &format!("{}, k dt {k_dt:.3}", LAWS[law as usize]));
    }
}
