//! Hand-written rivals: the same physics without this crate.

pub mod cell_list;

mod model;

pub mod vectorised;
