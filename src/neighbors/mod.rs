//! Who is near whom: grids, neighbour lists and hierarchies over points and boxes. Knows points
//! only.

mod bvh;
mod grid;
mod verlet;

pub(crate) use bvh::{Hierarchy, hierarchy};
pub(crate) use grid::{FEWEST_FOR_GRID, PointGrid};
pub(crate) use verlet::{Cluster, VerletList};
