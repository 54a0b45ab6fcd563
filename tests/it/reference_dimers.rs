//! Forces, torques and energies of rigid ammonia against OpenMM: 200 dimers and two clusters of
//! 32, Lennard-Jones between nitrogens and Coulomb between all sites, without cutoff.
//!
//! Errors are counted in units of the sum of magnitudes of all elementary terms, which the files
//! state: the net values are small differences of large terms, and say nothing about round-off.

use std::sync::Arc;

use crate::lab::scenes::ammonia::{COULOMB, Molecule, SITES, insert_molecule};
use rapier3d_fields::field::Query;
use rapier3d_fields::math::{DVec3, to_dpose3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

use crate::support::{Row, Table, ammonia, assert_at_most, either, largest};

const DIMERS: &str = include_str!("../data/a_dimers/dimer_poses.csv");
const LOOSE: &str = include_str!("../data/b_cluster32/cluster32_loose.csv");
const LIQUID: &str = include_str!("../data/b_cluster32/cluster32_liquid.csv");

/// In `f32`, poses of up to 12 Å are rounded to 5e-7 Å, which moves terms at 2.5 Å and less by
/// some 1e-7 of themselves each; the arithmetic adds 4e-7 at most. In `f64` both are some units
/// of 1e-16 a term, and errors of many terms partly cancel.
fn force_bound() -> f64 {
    either(1e-6, 1e-14)
}

/// The same for the energy. Its terms fall off more slowly, so rounded poses count less; but
/// it is the sum over all molecules of partial sums in [`Real`].
fn energy_bound() -> f64 {
    either(1e-6, 1e-14)
}

/// The values of one molecule in the files.
struct Expected {
    pose: Pose,
    force: DVec3,
    torque: DVec3,
    force_scale: f64,
    torque_scale: f64,
}

/// The two molecules of a row of dimers.
fn dimer(row: Row<'_>) -> [Expected; 2] {
    ["1", "2"].map(|suffix| Expected {
        pose: row.pose(suffix),
        force: row.vector("f", suffix),
        torque: row.vector("t", suffix),
        force_scale: row.number("F_scale"),
        torque_scale: row.number(&format!("T_scale{suffix}")),
    })
}

/// The molecule of a row of a cluster.
fn cluster(row: Row<'_>) -> Expected {
    Expected {
        pose: row.pose(""),
        force: row.vector("f", ""),
        torque: row.vector("t", ""),
        force_scale: row.number("f_scale"),
        torque_scale: row.number("t_scale"),
    }
}

/// Molecules in their field.
struct Setting {
    world: PhysicsWorld,
    molecules: Vec<Molecule>,
    tree: Tree,
    fields: Fields,
}

impl Setting {
    fn new(expected: &[Expected], coulomb: f64) -> Self {
        let mut world = crate::support::weightless(0.001);
        let molecules: Vec<Molecule> = expected
            .iter()
            .map(|molecule| insert(&mut world, molecule.pose))
            .collect();
        let tree = ammonia::tree(&molecules, coulomb);
        let fields = ammonia::fields(&molecules, tree.clone(), &world.colliders);
        Setting {
            world,
            molecules,
            tree,
            fields,
        }
    }

    /// Force and torque on a molecule, by the compiled evaluator.
    fn sampled(&mut self, molecule: Molecule) -> (DVec3, DVec3) {
        let wrench = self.fields.sample(molecule.body, &self.world);
        let wrench = wrench.expect("finite").expect("a dynamic body");
        (to_dvec3(wrench.force), to_dvec3(wrench.torque))
    }

    /// Force and torque on a molecule, by the walk of the tree, summed over its sites in `f64`.
    fn walked(&self, molecule: Molecule) -> (DVec3, DVec3) {
        let reference = Reference::new(&self.tree).expect("a valid tree");
        let frames = WorldRef::from(&self.world);
        let pose = to_dpose3(self.world.bodies[molecule.body].position());
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for site in SITES {
            let arm = pose.rotation * DVec3::from_array(site.local_point);
            let query = Query {
                world_point: pose.translation + arm,
                charge: site.charge,
                user: Arc::new([("lj".into(), to_f64(ammonia::dispersion(&site)))]),
                body: Some(molecule.body),
                ..Query::default()
            };
            let on_site = reference
                .force(&frames, &query)
                .expect("defined everywhere");
            force += on_site;
            torque += arm.cross(on_site);
        }
        (force, torque)
    }

    fn energy(&mut self) -> f64 {
        let energy = self.fields.potential_energy(&self.world);
        assert_eq!(energy.without, 0, "every field has a potential");
        energy.total
    }
}

fn insert(world: &mut PhysicsWorld, pose: Pose) -> Molecule {
    let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
    insert_molecule(bodies, colliders, pose, Vector::ZERO, Vector::ZERO)
}

/// The largest errors of force and torque, in units of their scales.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    force: f64,
    torque: f64,
}

impl Errors {
    /// Includes the errors of one molecule.
    fn add(&mut self, expected: &Expected, (force, torque): (DVec3, DVec3)) {
        let force = force.distance(expected.force) / expected.force_scale;
        let torque = torque.distance(expected.torque) / expected.torque_scale;
        self.force = largest([self.force, force]);
        self.torque = largest([self.torque, torque]);
    }

    /// Fails unless both are within `bound`.
    #[track_caller]
    fn check(&self, bound: f64, place: impl std::fmt::Display) {
        assert_at_most(self.force, bound, format!("force, {place}"));
        assert_at_most(self.torque, bound, format!("torque, {place}"));
    }
}

impl std::fmt::Display for Errors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "force {:.1e} torque {:.1e}", self.force, self.torque)
    }
}

/// Errors of the compiled evaluator and of the reference walk.
fn errors(expected: &[Expected], coulomb: f64) -> [Errors; 2] {
    let mut setting = Setting::new(expected, coulomb);
    let mut errors = [Errors::default(); 2];
    for (place, expected) in expected.iter().enumerate() {
        let molecule = setting.molecules[place];
        errors[0].add(expected, setting.sampled(molecule));
        errors[1].add(expected, setting.walked(molecule));
    }
    errors
}

#[test]
fn dimers_have_the_forces_and_torques_of_openmm() {
    let mut worst = [Errors::default(); 2];
    for (place, row) in Table::parse(DIMERS).rows().enumerate() {
        let errors = errors(&dimer(row), COULOMB);
        for (worst, (errors, name)) in worst.iter_mut().zip(errors.iter().zip(NAMES)) {
            errors.check(force_bound(), format!("{name}, row {place}"));
            worst.force = largest([worst.force, errors.force]);
            worst.torque = largest([worst.torque, errors.torque]);
        }
    }
    println!(
        "largest errors: compiled {}, reference {}",
        worst[0], worst[1]
    );
}

const NAMES: [&str; 2] = ["compiled", "reference"];

#[test]
fn clusters_have_the_forces_and_torques_of_openmm() {
    for (name, text) in [("loose", LOOSE), ("liquid", LIQUID)] {
        let expected: Vec<Expected> = Table::parse(text).rows().map(cluster).collect();
        let errors = errors(&expected, COULOMB);
        println!("{name}: compiled {}, reference {}", errors[0], errors[1]);
        for (errors, evaluator) in errors.iter().zip(NAMES) {
            errors.check(force_bound(), format!("{name}, {evaluator}"));
        }
    }
}

#[test]
fn dimers_have_the_energy_of_openmm() {
    let mut worst: f64 = 0.0;
    for (place, row) in Table::parse(DIMERS).rows().enumerate() {
        let found = Setting::new(&dimer(row), COULOMB).energy();
        let error = (found - row.number("E")).abs() / row.number("E_scale");
        assert_at_most(error, energy_bound(), format!("energy, row {place}"));
        worst = worst.max(error);
    }
    println!("largest error of the energy: {worst:.2e}");
}

/// The files give no scale for the energy of a cluster. An energy term is a force term times the
/// distance, which is more than 1 Å, so the force scale times 1 Å is a strict one.
#[test]
fn clusters_have_the_energy_of_openmm() {
    for (name, text) in [("loose", LOOSE), ("liquid", LIQUID)] {
        let table = Table::parse(text);
        let expected: Vec<Expected> = table.rows().map(cluster).collect();
        let total: f64 = table.rows().map(|row| row.number("e_mol")).sum();
        let scale: f64 = expected.iter().map(|molecule| molecule.force_scale).sum();
        let error = (Setting::new(&expected, COULOMB).energy() - total).abs() / scale;
        println!("{name}: error of the energy {error:.2e}");
        assert_at_most(error, energy_bound(), format!("energy, {name}"));
    }
}

/// The bounds can be missed: each wrong model exceeds them at least tenfold.
#[test]
fn wrong_models_fail() {
    let table = Table::parse(DIMERS);
    let error = |coulomb: f64| {
        let errors = table
            .rows()
            .map(|row| errors(&dimer(row), coulomb)[0].force);
        largest(errors)
    };
    let wrong_sign = error(-COULOMB);
    let wrong_constant = error(COULOMB * (1.0 + 1e-3));
    println!("wrong sign {wrong_sign:.1e}, Coulomb's constant off by 1e-3 {wrong_constant:.1e}");
    assert!(wrong_sign > 1e-2);
    assert!(wrong_constant > 10.0 * force_bound());
}
