//! Ammonia molecules in each other's field, without cutoff and without hard cores.

use std::sync::Arc;

use super::super::super::scenes::ammonia::{
    COULOMB, DISPERSION, LJ_EPSILON, LJ_SIGMA, MASS, PRINCIPAL_INERTIA, SITES, interaction,
};
use super::super::fields;
use super::{Forces, Metric, Motion, Potential, Reference, Site, State, Top, about};
use crate::study::{Row, StudyError, Table};
use fields::math::{DVec3, Real, Vector, from_f64, to_f64};

const BOUND: &str = include_str!("../../../../tests/data/c_trajectories/dimer_bound.csv");
const SCATTERING: &str = include_str!("../../../../tests/data/c_trajectories/dimer_scatter.csv");
const CLUSTER: &str = include_str!("../../../../tests/data/c_trajectories/cluster8.csv");

pub(super) const ATOMS: usize = SITES.len();

/// Two bound molecules for 0.4 ps, in which an error made at the start grows by 3.7.
pub fn dimer_bound() -> Motion {
    let text = "Two bound ammonia molecules, 0.4 ps; against DOP853 at 1e-13.";
    known("bound dimer", text, (BOUND, 2, 10))
}

/// Two molecules that meet and part.
pub fn dimer_scattering() -> Motion {
    let text = "Two ammonia molecules meet and part, 1 ps; against DOP853 at 1e-13.";
    known("scattering dimer", text, (SCATTERING, 2, 25))
}

/// Eight molecules in a drop.
pub fn cluster() -> Motion {
    let text = "Eight ammonia molecules in a drop, 0.2 ps; against DOP853 at 1e-13.";
    known("cluster of 8", text, (CLUSTER, 8, 10))
}

/// The tables are part of the program, and tests read all of them.
fn known(name: &str, description: &'static str, table: (&str, usize, usize)) -> Motion {
    molecules_from_csv(name, description, table).expect("a table that the tests read")
}

/// The motion from the first sample of a trajectory to number `sample`, counted from 0.
///
/// The table has one row per sample and molecule, with the columns `t` (ps), `x y z` (Å), `qw qx
/// qy qz` (body to world), `vx vy vz` (Å/ps) and `wx wy wz` (rad/ps, along the world's axes). Errors grow along the
/// trajectory: choose an early sample.
///
/// # Errors
/// A row or column is missing, or a cell is not a number.
pub fn molecules_from_csv(
    name: &str,
    description: &'static str,
    (text, count, sample): (&str, usize, usize),
) -> Result<Motion, StudyError> {
    let table = Table::parse(text)?;
    let rows: Vec<Row<'_>> = table.rows().collect();
    let of_sample = |sample: usize| {
        let rows = rows.get(count * sample..count * (sample + 1));
        let what = format!("sample {sample}");
        rows.ok_or(StudyError::Missing { what })
    };
    let (first, last) = (of_sample(0)?, of_sample(sample)?);
    let states = |rows: &[Row<'_>]| rows.iter().map(state).collect::<Result<Vec<_>, _>>();
    let (starts, ends) = (states(first)?, states(last)?);
    let duration = last[0].number("t")? - first[0].number("t")?;
    let top = |start: State| Top {
        mass: MASS,
        moments: DVec3::from_array(PRINCIPAL_INERTIA),
        start,
        sites: SITES
            .map(|site| (DVec3::from_array(site.local_point), site.charge))
            .to_vec(),
    };
    let kinetic: f64 = starts.iter().map(|it| it.velocity.length_squared()).sum();
    Ok(Motion {
        about: about(
            name,
            description,
            (duration, "ps"),
            (duration / 50.0, 8),
            &[(Metric::AtomPosition, 1e-2), (Metric::AtomPosition, 1e-3)],
        ),
        tops: starts.iter().copied().map(top).collect(),
        gravity: DVec3::ZERO,
        scales: [1.0, (kinetic / starts.len() as f64).sqrt()],
        tree: Arc::new(|sites| {
            let (molecules, _) = sites.as_chunks::<ATOMS>();
            interaction(molecules.iter().copied(), None)
        }),
        forces: forces(),
        potential: Some(potential()),
        first_site_axis: Some(DISPERSION),
        reference: Reference::Table(ends),
    })
}

fn state(row: &Row<'_>) -> Result<State, StudyError> {
    let rotation = row.rotation()?;
    let local = rotation.inverse() * row.vector("w", "")?;
    Ok(State {
        position: row.vector("", "")?,
        rotation,
        velocity: row.vector("v", "")?,
        momentum: rotation * (DVec3::from_array(PRINCIPAL_INERTIA) * local),
    })
}

/// Forces without fields: a loop over all pairs of atoms that adds each force to both.
pub(super) fn forces() -> Forces {
    let coulomb: Real = from_f64(COULOMB);
    Arc::new(move |sites, forces| {
        forces.fill(Vector::ZERO);
        for i in 0..sites.len() {
            for j in (i / ATOMS + 1) * ATOMS..sites.len() {
                let (a, b) = (&sites[i], &sites[j]);
                let d = b.world_point - a.world_point;
                let inverse = d.length_squared().recip();
                let mut strength = coulomb * a.charge * b.charge * inverse * inverse.sqrt();
                if i % ATOMS == 0 && j % ATOMS == 0 {
                    strength += lennard_jones(inverse);
                }
                let force = d * strength;
                forces[j] += force;
                forces[i] -= force;
            }
        }
    })
}

/// Lennard-Jones force over distance, from 1/r².
fn lennard_jones(inverse: Real) -> Real {
    let (sigma, epsilon): (Real, Real) = (from_f64(LJ_SIGMA), from_f64(LJ_EPSILON));
    let s6 = (sigma * sigma * inverse).powi(3);
    24.0 * epsilon * (2.0 * s6 * s6 - s6) * inverse
}

pub(super) fn potential() -> Potential {
    Arc::new(|sites: &[Site]| {
        let mut energy = 0.0;
        for i in 0..sites.len() {
            for j in (i / ATOMS + 1) * ATOMS..sites.len() {
                let (a, b) = (&sites[i], &sites[j]);
                let distance = to_f64((b.world_point - a.world_point).length());
                energy += COULOMB * to_f64(a.charge) * to_f64(b.charge) / distance;
                if i % ATOMS == 0 && j % ATOMS == 0 {
                    let s6 = (LJ_SIGMA / distance).powi(6);
                    energy += 4.0 * LJ_EPSILON * (s6 * s6 - s6);
                }
            }
        }
        energy
    })
}
