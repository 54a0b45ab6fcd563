//! The index by which samples find the fields that reach them, chosen by the number and range of the fields.

use std::fmt;

use super::entries::RadialBatch;
use super::program::Program;
use crate::neighbors::FEWEST_FOR_GRID;

/// Bounded programs of fewer instances get no index: each is tested against every sample.
const FEWEST_FOR_TREE: usize = 16;

/// With fewer sources than this each source is tried, whatever the opening angle.
const FEWEST_FOR_CELLS: usize = 512;

/// The index by which samples find the fields that reach them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum IndexKind {
    /// Every field is tried.
    None,
    /// A uniform grid over the sources.
    Grid,
    /// A list of pairs of bodies in reach of each other, kept from step to step. Each pair of parts is computed
    /// once, for both.
    Neighbours,
    /// A bounding volume hierarchy over the bounds of the instances.
    Bvh,
    /// Cells within cells. A distant cell acts as a whole; see
    /// [`Field::opening_angle`](crate::Field::opening_angle).
    Cells,
}

impl RadialBatch {
    pub(crate) fn index_kind(&self) -> IndexKind {
        if self.law.opening_angle.is_some()
            && self.range.is_none()
            && self.sources.len() >= FEWEST_FOR_CELLS
        {
            IndexKind::Cells
        } else if self.on_colliders * 2 > self.sources.len() {
            IndexKind::Neighbours
        } else if self.range.is_some() && self.sources.len() >= FEWEST_FOR_GRID {
            IndexKind::Grid
        } else {
            IndexKind::None
        }
    }
}

impl Program {
    pub(crate) fn index_kind(&self) -> IndexKind {
        if self.reach.is_some() && self.instances.len() >= FEWEST_FOR_TREE {
            IndexKind::Bvh
        } else {
            IndexKind::None
        }
    }
}

impl fmt::Display for IndexKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            IndexKind::None => "no index",
            IndexKind::Grid => "grid",
            IndexKind::Neighbours => "neighbour list",
            IndexKind::Bvh => "bounding volume hierarchy",
            IndexKind::Cells => "cells within cells",
        })
    }
}
