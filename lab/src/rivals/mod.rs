//! Hand-written implementations of the same physics without this crate, to compare with.

pub mod cell_list;

pub mod lammps;

mod model;

pub mod vectorised;
