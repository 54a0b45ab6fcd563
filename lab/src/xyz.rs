//! Trajectories as extended XYZ, which OVITO, VMD and ASE read.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use rapier3d_fields::math::DVec3;

use crate::{AnyError, make_folder_of};

/// A trajectory being written.
pub struct Trajectory {
    file: BufWriter<File>,
    half_extents: DVec3,
}

impl Trajectory {
    /// Starts a file for a box around the origin.
    pub fn create(path: &Path, half_extents: DVec3) -> Result<Self, AnyError> {
        make_folder_of(path)?;
        let file = File::create(path)
            .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        Ok(Self {
            file: BufWriter::new(file),
            half_extents,
        })
    }

    /// Writes one frame. `comment` are further `key=value` pairs for its second line.
    ///
    /// Positions are relative to the lower corner of the box, where all readers put the origin of the lattice.
    pub fn frame(&mut self, comment: &str, atoms: &[(&str, DVec3)]) -> Result<(), AnyError> {
        let [x, y, z] = (2.0 * self.half_extents).to_array();
        writeln!(self.file, "{}", atoms.len())?;
        writeln!(
            self.file,
            "Lattice=\"{x} 0 0 0 {y} 0 0 0 {z}\" Properties=species:S:1:pos:R:3 pbc=\"F F F\" {comment}"
        )?;
        for (species, position) in atoms {
            let [x, y, z] = (*position + self.half_extents).to_array();
            writeln!(self.file, "{species} {x:.4} {y:.4} {z:.4}")?;
        }
        Ok(())
    }

    /// Flushes the file; a failed write is an error.
    pub fn finish(mut self) -> Result<(), AnyError> {
        Ok(self.file.flush()?)
    }
}
