//! Solids cut into cells, each with what it holds of the solid.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::math::{DPose3, DVec3, Pose};

/// A part that can be cut into cells.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub body: u32,
    /// The number of its site.
    pub site: u32,
    /// Its frame on the body.
    pub local_pose: Pose,
    /// Its frame in the world.
    pub pose: DPose3,
    /// Angular velocity of the body.
    pub angvel: DVec3,
    pub cells: Cells,
}

/// A solid in a box of its own frame, filled uniformly; its content is one.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    low: DVec3,
    /// Edges of the finest cells whose content is known.
    edge: DVec3,
    counts: [usize; 3],
    /// Without it, the solid fills its box.
    content: Option<Arc<Content>>,
}

/// What is in the cells of a grid: for each corner, the sums over all cells below it of content
/// and of content times place, in cells.
#[derive(Debug)]
pub(crate) struct Content {
    counts: [usize; 3],
    sums: Vec<[f64; 4]>,
}

/// A cell: a box of a solid's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    pub low: DVec3,
    pub high: DVec3,
    /// The finest cells it is made of.
    from: [usize; 3],
    to: [usize; 3],
    /// What it holds of the solid.
    pub content: f64,
    /// The centre of that.
    pub centre: DVec3,
    /// Whether the solid fills the cell.
    is_full: bool,
}

impl Content {
    /// Sums up the content of cells, given by their places; negative content counts as none.
    /// Nothing if there is none at all.
    pub(crate) fn new(counts: [usize; 3], of: impl Fn(DVec3) -> f64) -> Option<Self> {
        let corners = counts.map(|count| count + 1);
        let mut sums = vec![[0.0; 4]; corners.iter().product()];
        for x in 0..counts[0] {
            for y in 0..counts[1] {
                for z in 0..counts[2] {
                    let middle = DVec3::new(x as f64, y as f64, z as f64) + 0.5;
                    let content = of(middle).max(0.0);
                    sums[index(counts, [x + 1, y + 1, z + 1])] = [
                        content,
                        content * middle.x,
                        content * middle.y,
                        content * middle.z,
                    ];
                }
            }
        }
        // Along one axis after the other, single cells become sums over all that lie below.
        for axis in 0..3 {
            for x in 0..corners[0] {
                for y in 0..corners[1] {
                    for z in 0..corners[2] {
                        let here = [x, y, z];
                        if here[axis] == 0 {
                            continue;
                        }
                        let mut below = here;
                        below[axis] -= 1;
                        let below = sums[index(counts, below)];
                        let sum = &mut sums[index(counts, here)];
                        (0..4).for_each(|k| sum[k] += below[k]);
                    }
                }
            }
        }
        let total = sums.last().map_or(0.0, |sum| sum[0]);
        let normal = total > 0.0 && total.is_finite();
        sums.iter_mut().flatten().for_each(|sum| *sum /= total);
        normal.then_some(Content { counts, sums })
    }

    /// Content, and content times place, of the cells from one corner to another.
    fn within(&self, from: [usize; 3], to: [usize; 3]) -> [f64; 4] {
        let mut total = [0.0; 4];
        for corner in 0..8_usize {
            let mut sign = 1.0;
            let mut at = to;
            for axis in 0..3 {
                if corner >> axis & 1 == 1 {
                    at[axis] = from[axis];
                    sign = -sign;
                }
            }
            let sum = self.sums[index(self.counts, at)];
            (0..4).for_each(|k| total[k] += sign * sum[k]);
        }
        total
    }
}

fn index(counts: [usize; 3], [x, y, z]: [usize; 3]) -> usize {
    (x * (counts[1] + 1) + y) * (counts[2] + 1) + z
}

impl Cells {
    /// A box.
    pub(crate) fn filled(low: DVec3, high: DVec3) -> Self {
        Cells {
            low,
            edge: high - low,
            counts: [1; 3],
            content: None,
        }
    }

    /// A solid in a box, with the content of the box's cells; moved so that its centre is where
    /// it should be.
    pub(crate) fn partly(low: DVec3, high: DVec3, content: Arc<Content>, centre: DVec3) -> Self {
        let counts = content.counts;
        let count = DVec3::new(counts[0] as f64, counts[1] as f64, counts[2] as f64);
        let mut cells = Cells {
            low,
            edge: (high - low) / count,
            counts,
            content: Some(content),
        };
        cells.low += centre - cells.root().centre;
        cells
    }

    /// The whole solid.
    pub(crate) fn root(&self) -> Cell {
        self.cell([0; 3], self.counts)
    }

    /// Cuts the solid into about that many cells; empty ones are left out.
    pub(crate) fn cut(&self, count: usize, cells: &mut Vec<Cell>) {
        cells.clear();
        cells.push(self.root());
        while cells.len() < count && !cells.is_empty() {
            let before = cells.len();
            for number in 0..before {
                let halves = self.halves(&cells[number]).into_iter();
                cells.extend(halves.filter(|cell| cell.content > 0.0));
            }
            cells.drain(..before);
        }
    }

    fn cell(&self, from: [usize; 3], to: [usize; 3]) -> Cell {
        let corner = |at: [usize; 3]| {
            self.low + DVec3::new(at[0] as f64, at[1] as f64, at[2] as f64) * self.edge
        };
        let (low, high) = (corner(from), corner(to));
        let (content, centre) = match &self.content {
            None => (1.0, (low + high) * 0.5),
            Some(known) => {
                let [content, x, y, z] = known.within(from, to);
                let centre = self.low + DVec3::new(x, y, z) / content * self.edge;
                // Of what holds next to nothing, rounding leaves no centre.
                if content > 1e-12 {
                    (content, centre.clamp(low, high))
                } else {
                    (0.0, (low + high) * 0.5)
                }
            }
        };
        Cell {
            low,
            high,
            from,
            to,
            content,
            centre,
            is_full: self.content.is_none(),
        }
    }

    /// Cuts a cell in two, across its longest edge; below the finest known cells, evenly.
    pub(crate) fn halves(&self, cell: &Cell) -> [Cell; 2] {
        let edges = cell.high - cell.low;
        let known = |axis: usize| cell.to[axis] - cell.from[axis] > 1;
        let longest = |axes: &mut dyn Iterator<Item = usize>| {
            axes.max_by(|a, b| edges[*a].total_cmp(&edges[*b]))
        };
        if let Some(axis) = longest(&mut (0..3).filter(|axis| known(*axis))) {
            let (mut to, mut from) = (cell.to, cell.from);
            let middle = (cell.from[axis] + cell.to[axis]) / 2;
            (to[axis], from[axis]) = (middle, middle);
            return [self.cell(cell.from, to), self.cell(from, cell.to)];
        }
        let axis = longest(&mut (0..3)).unwrap_or(0);
        let middle = (cell.low[axis] + cell.high[axis]) * 0.5;
        let half = |low: DVec3, high: DVec3| Cell {
            low,
            high,
            content: cell.content * 0.5,
            centre: (low + high) * 0.5,
            ..*cell
        };
        let (mut high, mut low) = (cell.high, cell.low);
        (high[axis], low[axis]) = (middle, middle);
        [half(cell.low, high), half(low, cell.high)]
    }
}

impl Cell {
    /// Which fraction of what the cell holds is surely within a distance of its centre.
    pub(crate) fn within(&self, distance: f64) -> f64 {
        let edges = self.high - self.low;
        let radius = distance.min(edges.min_element() * 0.5);
        let ball = PI * 4.0 / 3.0 * radius.powi(3);
        if self.is_full {
            ball / edges.element_product()
        } else {
            0.0
        }
    }

    /// The farthest that any point of the cell is from its centre.
    pub(crate) fn radius(&self) -> f64 {
        (self.high - self.centre)
            .max(self.centre - self.low)
            .length()
    }
}
