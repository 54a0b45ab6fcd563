//! Neighbour search over points, balls and boxes: a uniform grid, a Verlet list of balls, and a hierarchy of
//! bounding boxes. It sees numbers and coordinates only, no bodies or colliders.

mod bvh;
mod grid;
mod verlet;

pub(crate) use bvh::{Hierarchy, hierarchy};
pub(crate) use grid::{FEWEST_FOR_GRID, PointGrid};
pub(crate) use verlet::{Cluster, VerletList};
