//! The Lennard-Jones fluid of NIST's Standard Reference Simulation Website, configuration 4: 30
//! atoms in a cubic box of edge 8, in reduced units.
//!
//! The coordinates are NIST's and are not part of this project: the test is ignored unless asked
//! for, and takes the folder of `lj_config4.csv` from the environment variable `NIST_LJ_DIR`.
//! Columns: `x`, `y`, `z`; `fpx` … forces of the minimum image, cut at 3; `fox` … without box and
//! cutoff.

use rapier3d_fields::math::{DVec3, Pose, from_dvec3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{Table, assert_at_most, assert_close, insert_ball, weightless};

const EDGE: f64 = 8.0;
const CUTOFF: f64 = 3.0;

/// Energy of the minimum image, cut and not shifted at 3; NIST publishes −16.790.
const PERIODIC: f64 = -16.790321304625856;
const PUBLISHED: (f64, f64) = (-16.790, 5e-4);
/// Energy without box and cutoff.
const OPEN: f64 = -16.5293104722473;

struct Atoms {
    places: Vec<DVec3>,
    periodic: Vec<DVec3>,
    open: Vec<DVec3>,
}

impl Atoms {
    fn read() -> Self {
        let folder = std::env::var("NIST_LJ_DIR").expect("the folder in NIST_LJ_DIR");
        let path = std::path::Path::new(&folder).join("lj_config4.csv");
        let text = std::fs::read_to_string(path).expect("a readable file");
        let table = Table::parse(text.leak());
        let column = |prefix: &str| table.rows().map(|row| row.vector(prefix, "")).collect();
        let atoms = Atoms {
            places: column(""),
            periodic: column("fp"),
            open: column("fo"),
        };
        assert_eq!(atoms.places.len(), 30);
        atoms
    }

    /// Bounds of the rounding errors of the energy and of the force on each atom: for each pair in reach, the
    /// magnitude of its terms times their relative error. A term has some fourteen roundings of its own; those of
    /// places, and of images within twice the edge, enter by the distance. Twice, as the reference is rounded as well.
    fn bounds(&self, images: &[DVec3], cutoff: f64) -> (f64, Vec<f64>) {
        let (mut energy, mut forces) = (0.0, vec![0.0; self.places.len()]);
        for (i, here) in self.places.iter().enumerate() {
            for (j, there) in self.places.iter().enumerate().filter(|(j, _)| *j != i) {
                for r in images
                    .iter()
                    .map(|image| (*there + *image - *here).length())
                {
                    assert!((r - CUTOFF).abs() > 1e-4, "{i} and {j} are at the cutoff");
                    if r > cutoff {
                        continue;
                    }
                    let s6 = r.powi(-6);
                    let relative = 2.0 * 14.0 * (1.0 + 2.0 * EDGE / r) * to_f64(Real::EPSILON);
                    energy += relative * 2.0 * (s6 * s6 + s6);
                    forces[i] += relative * 24.0 * (2.0 * s6 * s6 + s6) / r;
                }
            }
        }
        (energy, forces)
    }

    fn check(
        &self,
        field: Field,
        images: &[DVec3],
        cutoff: f64,
        forces: &[DVec3],
        energy: f64,
    ) -> f64 {
        let mut world = weightless(0.001);
        let place = |at: &DVec3| insert_ball(&mut world, 1.0, from_dvec3(*at), Vector::ZERO);
        let bodies: Vec<RigidBodyHandle> = self.places.iter().map(place).collect();
        let anchors = bodies.iter().flat_map(|handle| {
            images.iter().map(|image| Anchor::Body {
                handle: *handle,
                local_pose: Pose::from_translation(from_dvec3(*image)),
            })
        });
        let fields = Fields::new(Tree::instances(field, anchors)).expect("a valid tree");
        let (energy_bound, force_bounds) = self.bounds(images, cutoff);
        let mut worst: f64 = 0.0;
        for (i, body) in bodies.iter().enumerate() {
            let found = fields.sample(*body, &world);
            let found = to_dvec3(found.expect("finite").expect("dynamic").force);
            let error = found.distance(forces[i]);
            assert_at_most(error, force_bounds[i], format!("force on atom {i}"));
            worst = worst.max(error);
        }
        let found = fields.potential_energy(&world);
        assert_eq!(found.without, 0);
        println!(
            "energy {:.15}, off by {:.1e} (bound {energy_bound:.1e}); forces off by at most {worst:.1e}",
            found.total,
            found.total - energy
        );
        assert_close(found.total, energy, energy_bound, "energy");
        found.total
    }
}

fn images() -> Vec<DVec3> {
    let steps = || [-EDGE, 0.0, EDGE].into_iter();
    let plane = || steps().flat_map(move |y| steps().map(move |z| (y, z)));
    let all = steps().flat_map(|x| plane().map(move |(y, z)| DVec3::new(x, y, z)));
    all.collect()
}

#[test]
#[ignore = "needs NIST's coordinates, in the folder NIST_LJ_DIR"]
fn configuration_4_without_a_box() {
    let atoms = Atoms::read();
    let field = Field::lennard_jones(1.0, 1.0);
    atoms.check(field, &[DVec3::ZERO], f64::INFINITY, &atoms.open, OPEN);
}

/// The box is wider than twice the cutoff, so at most one image of an atom is in reach of another atom.
#[test]
#[ignore = "needs NIST's coordinates, in the folder NIST_LJ_DIR"]
fn configuration_4_in_its_box() {
    let atoms = Atoms::read();
    let field = Field::lennard_jones(1.0, 1.0).within(Region::ball(CUTOFF as Real));
    let energy = atoms.check(field, &images(), CUTOFF, &atoms.periodic, PERIODIC);
    let (published, digits) = PUBLISHED;
    assert_close(energy, published, digits, "the published energy");
}
