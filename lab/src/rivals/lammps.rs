//! The state of a box as input of LAMMPS, which `benches/lammps.sh` runs.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use crate::single::scenes::ammonia::{BoxOfAmmonia, SITES};
use rapier3d_fields::Fields;
use rapier3d_fields::math::{DVec3, to_dpose3, to_dvec3};

/// Writes a data file of LAMMPS (`units metal`, `atom_style full`), in which type 1 is nitrogen and type 2 hydrogen;
/// and a file of the same name ending in `.forces` with the force of `fields` on each molecule, in amu Å/ps².
///
/// # Errors
/// A file cannot be written, or the fields are refused.
pub fn write(
    scene: &BoxOfAmmonia,
    fields: &Fields,
    data: &Path,
) -> Result<(), Box<dyn Error + Send + Sync>> {
    let world = &scene.world;
    let mut file = BufWriter::new(File::create(data)?);
    let count = scene.molecules.len();
    writeln!(file, "rigid ammonia\n\n{} atoms\n2 atom types\n", 4 * count)?;
    for (axis, half) in ["x", "y", "z"]
        .into_iter()
        .zip(scene.half_extents.to_array())
    {
        writeln!(file, "{} {half} {axis}lo {axis}hi", -half)?;
    }
    let [nitrogen, hydrogen, ..] = SITES;
    writeln!(file, "\nMasses\n\n1 {}\n2 {}", nitrogen.mass, hydrogen.mass)?;
    let (mut places, mut velocities) = (String::new(), String::new());
    for (number, molecule) in scene.molecules.iter().enumerate() {
        let body = &world.bodies[molecule.body];
        let (pose, centre) = (to_dpose3(body.position()), to_dvec3(body.center_of_mass()));
        let (linvel, angvel) = (to_dvec3(body.linvel()), to_dvec3(body.angvel()));
        for (atom, site) in SITES.iter().enumerate() {
            let (id, kind) = (4 * number + atom + 1, 1 + usize::from(atom > 0));
            let place = pose.transform_point(DVec3::from_array(site.local_point));
            let [x, y, z] = place.to_array();
            let charge = site.charge;
            places += &format!("{id} {} {kind} {charge} {x} {y} {z}\n", number + 1);
            let [u, v, w] = (linvel + angvel.cross(place - centre)).to_array();
            velocities += &format!("{id} {u} {v} {w}\n");
        }
    }
    write!(
        file,
        "\nAtoms # full\n\n{places}\nVelocities\n\n{velocities}"
    )?;
    let mut file = BufWriter::new(File::create(data.with_extension("forces"))?);
    let dt = world.integration_parameters.dt;
    for (_, wrench) in fields.sample_all(dt, world)? {
        let [x, y, z] = wrench.force.to_array();
        writeln!(file, "{x} {y} {z}")?;
    }
    Ok(())
}
