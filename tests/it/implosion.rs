//! 216 molecules collide in the middle of a box and rebound from its walls: contacts found by fields against those
//! found by Rapier, in each of 10,000 steps.

use crate::lab::scenes::ammonia::{MASS, PRINCIPAL_INERTIA, SITES};
use crate::lab::scenes::insert_box;
use rapier3d_fields::cross_check::CrossCheck;
use rapier3d_fields::math::{Vector, from_dvec3, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::collide::*;
use crate::support::{assert_at_most, either};

/// Radii of hard spheres at which the hydrogens protrude from the nitrogen, Å.
const RADII: [f64; 4] = [1.2, 0.6, 0.6, 0.6];

/// Molecules on a lattice that all move towards the middle and spin differently.
fn imploding(world: &mut PhysicsWorld) -> Vec<Thing> {
    let site = |i: usize| (i as Real - 2.5) * from_f64(3.6);
    let inertia = from_dvec3(PRINCIPAL_INERTIA.into());
    let properties = MassProperties::new(Vector::ZERO, from_f64(MASS), inertia);
    (0..216)
        .map(|i| {
            let place = Vector::new(site(i % 6), site(i / 6 % 6), site(i / 36));
            let turn = Vector::new(0.3, 0.5, -0.2) * (i % 11) as Real;
            let spin = Vector::new(3.0, -2.0, 4.0) * ((i % 7) as Real - 3.0);
            let body = RigidBodyBuilder::dynamic()
                .pose(Pose::new(place, turn))
                .linvel(place * from_f64(-0.8))
                .angvel(spin)
                .additional_mass_properties(properties)
                .allow_fast_rotation(true)
                .can_sleep(false);
            let atoms = SITES.iter().zip(RADII).map(|(atom, radius)| {
                ColliderBuilder::ball(from_f64(radius))
                    .translation(from_dvec3(atom.local_point.into()))
                    .density(0.0)
            });
            insert(world, body, atoms)
        })
        .collect()
}

#[test]
fn fields_and_rapier_agree_in_10_000_steps() {
    let mut world = crate::support::weightless(from_f64(2e-3));
    // Rapier's default; the check keeps the contacts from being recycled.
    assert!(world.integration_parameters.contact_recycling);
    let molecules = imploding(&mut world);
    let PhysicsWorld {
        bodies, colliders, ..
    } = &mut world;
    let walls = insert_box(bodies, colliders, Vector::splat(from_f64(12.0)));
    let atoms = molecules.iter().flat_map(|molecule| molecule.parts.clone());
    let tree = touch(atoms.chain(walls), ELASTIC);
    let check = CrossCheck::all().on_disagreement(|found| println!("{found:?}"));
    let builder = Fields::builder(tree).cross_check(check);
    let mut fields = builder.build().expect("a valid tree");
    let start = Totals::of(&world);
    for _ in 0..10_000 {
        step(&mut fields, &mut world);
    }
    let report = fields.cross_check().expect("it is on");
    println!(
        "{:?}, mean errors {:?}, largest {:?}",
        report.total,
        report.mean_errors(),
        [report.depth_error, report.normal_error, report.point_error],
    );
    assert_eq!(report.steps, 10_000);
    assert!(report.total.both > 1000, "{:?}", report.total);
    assert_eq!(report.total.disagreed(), 0, "{:?}", report.total);
    assert!(!report.recycling && !report.ccd_substeps);
    // Coordinates up to 12: a few units in the last place.
    assert_at_most(to_f64(report.depth_error), either(1e-5, 2e-14), "depth");
    let [depth, normal, point] = report.mean_errors();
    for mean in [depth, normal, point] {
        assert!(mean > 0.0 && mean < either(1e-6, 2e-15), "{mean}");
    }
    let end = Totals::of(&world);
    assert_at_most(
        (end.energy / start.energy - 1.0).abs(),
        2e-3,
        "energy of the tops",
    );
}
