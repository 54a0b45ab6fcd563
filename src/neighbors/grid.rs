//! A uniform grid over points, for searches that use one range for all points.

use std::ops::{Range, RangeInclusive};

use crate::math::{Real, Vector};

/// With fewer points than this every point is tried, since a grid would cost more than it saves.
pub(crate) const FEWEST_FOR_GRID: usize = 64;

/// Points sorted by cell, with cells in rows along x: the points near a place are a few contiguous ranges.
#[derive(Debug, Default)]
pub(crate) struct PointGrid {
    origin: Vector,
    per_length: Real,
    cells: [usize; 3],
    /// For each cell, where its points start; one more entry at the end of each row.
    starts: Vec<u32>,
    /// The cell of each point.
    cell_of: Vec<u32>,
    /// The point at each place; see [`PointGrid::order`].
    order: Vec<u32>,
    /// The next free place of each cell, while points are sorted.
    next: Vec<u32>,
}

/// Upper bound of cells per point. More cells cost more to clear than they save.
const CELLS_PER_POINT: usize = 4;

impl PointGrid {
    /// Sorts `points` into cells whose side is at least `side` (m). Afterwards [`PointGrid::order`] lists the
    /// points by place.
    pub(crate) fn build(&mut self, points: &[Vector], side: Real) {
        let infinity = Vector::splat(Real::INFINITY);
        let (low, high) = points.iter().fold((infinity, -infinity), |(low, high), p| {
            (low.min(*p), high.max(*p))
        });
        let side = self.shape(high - low, points.len(), side);
        self.origin = low;
        self.per_length = side.recip();
        self.sort(points);
    }

    /// Sets the numbers of cells, of at least `side`, in a box of this extent that holds `count` points.
    /// Returns the side that the cells get.
    fn shape(&mut self, extent: Vector, count: usize, side: Real) -> Real {
        let extent = extent.max(Vector::ZERO);
        let most = (CELLS_PER_POINT * count).max(1);
        let mut side = side.max(Real::MIN_POSITIVE);
        self.cells = loop {
            let cells = extent.to_array().map(|e| (e / side).min(1e6) as usize + 1);
            if cells.iter().product::<usize>() <= most || !extent.is_finite() {
                break cells.map(|n| if extent.is_finite() { n } else { 1 });
            }
            side *= 1.25;
        };
        side
    }

    /// Returns true if a build over `count` points in a box of this extent would make the same cells. If not,
    /// the grid has to be built again.
    pub(crate) fn keeps_shape(&mut self, extent: Vector, count: usize, side: Real) -> bool {
        let before = self.cells;
        self.shape(extent, count, side).recip() == self.per_length && self.cells == before
    }

    /// Counting sort; points of one cell keep their order.
    fn sort(&mut self, points: &[Vector]) {
        let [columns, rows, layers] = self.cells;
        self.cell_of.clear();
        self.starts.clear();
        self.starts.resize((columns + 1) * rows * layers, 0);
        for point in points {
            let cell = self.cell_of(*point);
            self.cell_of.push(cell as u32);
            self.starts[cell + 1] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        self.order.clear();
        self.order.resize(points.len(), 0);
        self.next.clone_from(&self.starts);
        for (point, cell) in self.cell_of.iter().enumerate() {
            let place = &mut self.next[*cell as usize];
            self.order[*place as usize] = point as u32;
            *place += 1;
        }
    }

    /// The number of the point at each place, in the order of cells.
    pub(crate) fn order(&self) -> &[u32] {
        &self.order
    }

    /// The number of the cell that a point is in.
    pub(crate) fn cell_of(&self, point: Vector) -> usize {
        let [x, y, z] = self.cell(point);
        (z * self.cells[1] + y) * (self.cells[0] + 1) + x
    }

    /// The ranges of places of the points of a cell, and of its whole row.
    pub(crate) fn runs(&self, cell: usize) -> [Range<usize>; 2] {
        let row = self.row(cell);
        [(cell, cell + 1), (*row.start(), *row.end())]
            .map(|(from, to)| self.starts[from] as usize..self.starts[to] as usize)
    }

    /// Shifts the starts of later cells in the row, so that a cell holds `by` more points (fewer, if negative).
    pub(crate) fn resize(&mut self, cell: usize, by: i32) {
        let after = cell + 1..=*self.row(cell).end();
        let starts = self.starts[after].iter_mut();
        starts.for_each(|start| *start = start.wrapping_add_signed(by));
    }

    /// Moves the range of places of the row that a cell is in, so that it starts at `to`.
    pub(crate) fn move_row(&mut self, cell: usize, to: usize) {
        let row = self.row(cell);
        let by = to as u32 - self.starts[*row.start()];
        self.starts[row].iter_mut().for_each(|start| *start += by);
    }

    /// The number of the row that a cell is in.
    pub(crate) fn row_of(&self, cell: usize) -> usize {
        cell / (self.cells[0] + 1)
    }

    fn row(&self, cell: usize) -> RangeInclusive<usize> {
        let start = self.row_of(cell) * (self.cells[0] + 1);
        start..=start + self.cells[0]
    }

    fn cell(&self, point: Vector) -> [usize; 3] {
        let scaled = (point - self.origin) * self.per_length;
        let [x, y, z] = scaled.to_array();
        let clamp = |x: Real, n: usize| (x.max(0.0) as usize).min(n - 1);
        [
            clamp(x, self.cells[0]),
            clamp(y, self.cells[1]),
            clamp(z, self.cells[2]),
        ]
    }

    /// Visits ranges of places that together hold all points within `reach` of `centre`, and some farther ones.
    // Always inlined: a visitor that uses wide registers has to be inlined, and cannot be without this.
    #[inline(always)]
    pub(crate) fn for_each_near(
        &self,
        centre: Vector,
        reach: Real,
        mut visit: impl FnMut(Range<usize>),
    ) {
        let margin = Vector::splat(reach * 1.0001);
        let [x0, y0, z0] = self.cell(centre - margin);
        let [x1, y1, z1] = self.cell(centre + margin);
        let side = self.per_length.recip();
        // Slack for rounding, which grows with the distance from the origin and must not lose a point at the
        // reach exactly.
        let far = (centre.abs().max(self.origin.abs())).max_element() + reach;
        let slack = reach * 1e-4 + far * (8.0 * Real::EPSILON);
        let reach2 = (reach + slack) * (reach + slack);
        for z in z0..=z1 {
            let dz = gap(centre.z, self.origin.z, z, self.cells[2], side);
            for y in y0..=y1 {
                // Skips rows whose nearest edge is out of reach: the corners of the block.
                let dy = gap(centre.y, self.origin.y, y, self.cells[1], side);
                if dy * dy + dz * dz > reach2 {
                    continue;
                }
                let row = (z * self.cells[1] + y) * (self.cells[0] + 1);
                let (start, end) = (self.starts[row + x0], self.starts[row + x1 + 1]);
                if start < end {
                    visit(start as usize..end as usize);
                }
            }
        }
    }
}

/// The distance of `x` from a row of cells along one axis, zero within it. The outermost rows extend to
/// infinity, because points are clamped into them.
fn gap(x: Real, origin: Real, cell: usize, cells: usize, side: Real) -> Real {
    let low = origin + cell as Real * side;
    let below = if cell == 0 { 0.0 } else { low - x };
    let above = if cell + 1 == cells {
        0.0
    } else {
        x - (low + side)
    };
    below.max(above).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_in_reach_is_found_once() {
        let spread = [1.0, 30.0, 1e5];
        for scale in spread {
            let points: Vec<Vector> = (0..500)
                .map(|i| {
                    let t = i as Real;
                    Vector::new((t * 0.7).sin(), (t * 1.3).cos(), (t * 2.1).sin()) * scale
                })
                .collect();
            let mut grid = PointGrid::default();
            for side in [0.01, 0.5, 5.0] {
                grid.build(&points, side);
                for (i, centre) in points.iter().enumerate().step_by(17) {
                    let reach = 0.3 * scale;
                    let mut found: Vec<u32> = Vec::new();
                    grid.for_each_near(*centre, reach, |range| {
                        found.extend(&grid.order()[range]);
                    });
                    found.sort_unstable();
                    assert!(
                        found.windows(2).all(|pair| pair[0] < pair[1]),
                        "found twice"
                    );
                    for (j, point) in points.iter().enumerate() {
                        if (*point - *centre).length() <= reach {
                            assert!(found.contains(&(j as u32)), "{i} misses {j} at {scale}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_grid_may_hold_no_points_or_equal_points() {
        let mut grid = PointGrid::default();
        grid.build(&[], 1.0);
        grid.for_each_near(Vector::ZERO, 10.0, |range| {
            panic!("found {range:?} in nothing")
        });
        grid.build(&[Vector::X; 5], 1.0);
        let mut found = 0;
        grid.for_each_near(Vector::X, 0.0, |range| found += range.len());
        assert_eq!(found, 5);
    }
}
