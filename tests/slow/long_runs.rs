//! Ten million steps of a bound pair of molecules.

use crate::lab::scenes::ammonia::{COULOMB, Molecule, insert_molecule};
use rapier3d_fields::math::{from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{Row, Table, ammonia, assert_at_most, either, weightless};

const STEPS: usize = 10_000_000;
/// The number of stretches; energies are averaged over each.
const STRETCHES: usize = 100;

/// Kinetic and potential energy of all molecules.
fn energy(fields: &mut Fields, world: &PhysicsWorld, molecules: &[Molecule]) -> f64 {
    let of_one = |molecule: &Molecule| to_f64(world.bodies[molecule.body].kinetic_energy());
    let kinetic: f64 = molecules.iter().map(of_one).sum();
    let potential = fields.potential_energy(world);
    kinetic + potential.total
}

/// The bound pair of molecules, at a step of 1 fs for 10 ns. A symplectic scheme conserves an energy that differs from
/// the true one by an oscillating term: the mean over a stretch stays.
#[test]
#[ignore = "ten million steps"]
fn a_bound_dimer_does_not_drift_in_ten_million_steps() {
    let table = Table::parse(include_str!("../data/c_trajectories/dimer_bound.csv"));
    let start: Vec<Row<'_>> = table.rows().take(2).collect();
    let mut world = weightless(from_f64(1e-3));
    let put = |row: &Row<'_>| {
        let (v, w) = (row.vector("v", ""), row.vector("w", ""));
        let [v, w] = [v, w].map(rapier3d_fields::math::from_dvec3);
        let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
        insert_molecule(bodies, colliders, row.pose(""), v, w)
    };
    let molecules: Vec<Molecule> = start.iter().map(put).collect();
    for (_, collider) in world.colliders.iter_mut() {
        collider.set_collision_groups(InteractionGroups::none());
    }
    let tree = ammonia::tree(&molecules, COULOMB);
    let mut fields = ammonia::fields(&molecules, tree, &world.colliders);
    let depth = start[0].number("E").abs();
    let mut means = Vec::new();
    for _ in 0..STRETCHES {
        let (mut sum, mut count) = (0.0, 0.0);
        for step in 0..STEPS / STRETCHES {
            fields.step(&mut world).expect("a finite step");
            if step % 10 == 0 {
                sum += energy(&mut fields, &world, &molecules);
                count += 1.0;
            }
        }
        means.push(sum / count);
    }
    let first = means[0];
    let worst = means
        .iter()
        .map(|mean| (mean - first).abs())
        .fold(0.0, f64::max);
    let last = means[STRETCHES - 1] - first;
    println!("mean energy {first:.4}; off by {worst:.3e} at most, {last:.3e} in the end");
    println!(
        "relative to the depth: {:.2e}, {:.2e}",
        worst / depth,
        last / depth
    );
    // Means over 0.1 ns differ by 4.5e-6 in f64, in both directions; in f32 roundings add up.
    assert_at_most(
        worst / depth,
        either(4e-3, 2e-5),
        "drift of the mean energy",
    );
}
