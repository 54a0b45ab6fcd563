//! Neighbour search over points and boxes: a uniform grid, and a hierarchy of bounding boxes. Its input is
//! numbers and coordinates, not bodies or colliders.

mod bvh;
mod grid;

pub(crate) use bvh::{Hierarchy, hierarchy};
pub(crate) use grid::{FEWEST_FOR_GRID, PointGrid};
