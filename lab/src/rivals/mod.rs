//! Hand-written rivals: the same physics without this crate.

pub mod cell_list;

pub mod lammps;

mod model;

pub mod vectorised;
