//! The cells and triangles of a height field, scaled and in 64-bit precision.

use crate::math::{DVec2, DVec3, to_dvec3, to_f64};
use crate::rapier::parry::shape::{HeightField, HeightFieldCellStatus};

/// A height field as seen from above, with z as the second coordinate.
#[derive(Clone, Copy)]
pub(super) struct Cells<'a> {
    field: &'a HeightField,
    pub scale: DVec3,
    /// The numbers of cells along x and along z.
    counts: [usize; 2],
    /// The size of a cell.
    size: DVec2,
}

/// A cell of a height field.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    low: DVec2,
    size: DVec2,
    /// Heights at the corners: low x and low z; low x and high z; high x and low z; high x and high z.
    heights: [f64; 4],
    status: HeightFieldCellStatus,
}

/// One of the two triangles of a cell.
#[derive(Clone, Copy)]
pub(super) struct Triangle {
    /// True if it was not removed.
    pub is_there: bool,
    corners: [DVec2; 3],
    /// The height at the first corner.
    height: f64,
    /// The slope of the height along x and along z.
    pub gradient: DVec2,
}

impl<'a> Cells<'a> {
    pub fn of(field: &'a HeightField) -> Self {
        let counts = [field.ncols(), field.nrows()];
        let scale = to_dvec3(field.scale());
        let size = DVec2::new(scale.x / counts[0] as f64, scale.z / counts[1] as f64);
        Cells {
            field,
            scale,
            counts,
            size,
        }
    }

    pub fn all(self) -> impl Iterator<Item = Cell> + 'a {
        let [across, along] = self.counts;
        (0..across).flat_map(move |x| (0..along).map(move |z| self.cell([x, z])))
    }

    /// The point of the rectangle below or above a point, or nearest to it.
    pub fn clamp(&self, point: DVec3) -> DVec2 {
        let half = 0.5 * DVec2::new(self.scale.x, self.scale.z);
        DVec2::new(point.x, point.z).max(-half).min(half)
    }

    /// The triangles that contain a point of the rectangle: several if it is on an edge.
    pub fn at(self, point: DVec2) -> impl Iterator<Item = Triangle> + Clone + 'a {
        let [[x, last_x], [z, last_z]] = [self.holding(0, point.x), self.holding(1, point.y)];
        let cells = (x..=last_x).flat_map(move |x| (z..=last_z).map(move |z| [x, z]));
        cells.flat_map(move |place| self.cell(place).triangles_at(point))
    }

    /// The triangles of the cell that contains a point of the rectangle, and of the cells around it; and a
    /// lower bound of the distance from all others.
    pub fn around(self, point: DVec2) -> (impl Iterator<Item = Triangle> + 'a, f64) {
        let middle = [self.holding(0, point.x)[0], self.holding(1, point.y)[0]];
        let least = middle.map(|k| k.saturating_sub(1));
        let most = [0, 1].map(|axis| (middle[axis] + 1).min(self.counts[axis] - 1));
        let mut beyond = f64::INFINITY;
        for (axis, x) in [point.x, point.y].into_iter().enumerate() {
            if least[axis] > 0 {
                beyond = beyond.min(x - self.border(axis, least[axis]));
            }
            if most[axis] + 1 < self.counts[axis] {
                beyond = beyond.min(self.border(axis, most[axis] + 1) - x);
            }
        }
        let cells = (least[0]..=most[0])
            .flat_map(move |x| (least[1]..=most[1]).map(move |z| self.cell([x, z])));
        (cells.flat_map(Cell::triangles), beyond)
    }

    /// The coordinate at which a cell begins, along x or z.
    fn border(&self, axis: usize, number: usize) -> f64 {
        let share = number as f64 / self.counts[axis] as f64 - 0.5;
        share * [self.scale.x, self.scale.z][axis]
    }

    /// The first and the last cell that contain a coordinate: two if it is on their border.
    fn holding(&self, axis: usize, x: f64) -> [usize; 2] {
        let last = self.counts[axis] - 1;
        let place = (x / [self.scale.x, self.scale.z][axis] + 0.5) * self.counts[axis] as f64;
        // Negative numbers and NaN become zero.
        let cell = (place.floor() as usize).min(last);
        let on_border = place == cell as f64 && cell > 0;
        [cell - usize::from(on_border), cell]
    }

    fn cell(self, [x, z]: [usize; 2]) -> Cell {
        let heights = self.field.heights();
        let height = |x: usize, z: usize| to_f64(heights[(z, x)]) * self.scale.y;
        Cell {
            low: DVec2::new(self.border(0, x), self.border(1, z)),
            size: self.size,
            heights: [
                height(x, z),
                height(x, z + 1),
                height(x + 1, z),
                height(x + 1, z + 1),
            ],
            status: self.field.cell_status(z, x),
        }
    }
}

impl Cell {
    /// Parry's left and right triangles. They share the diagonal from low x and high z to high x and low z, or the
    /// other one in a zigzag.
    pub fn triangles(self) -> [Triangle; 2] {
        let [h00, h01, h10, h11] = self.heights;
        let DVec2 { x: w, y: l } = self.size;
        let corner = |x: f64, z: f64| self.low + DVec2::new(x * w, z * l);
        let [p00, p01, p10, p11] = [
            corner(0.0, 0.0),
            corner(0.0, 1.0),
            corner(1.0, 0.0),
            corner(1.0, 1.0),
        ];
        let is_there = |removed| !self.status.contains(removed);
        let left = is_there(HeightFieldCellStatus::LEFT_TRIANGLE_REMOVED);
        let right = is_there(HeightFieldCellStatus::RIGHT_TRIANGLE_REMOVED);
        let triangle = |is_there, corners, height, rise: [f64; 2]| Triangle {
            is_there,
            corners,
            height,
            gradient: DVec2::new(rise[0] / w, rise[1] / l),
        };
        if self.is_zigzag() {
            [
                triangle(left, [p00, p01, p11], h00, [h11 - h01, h01 - h00]),
                triangle(right, [p00, p11, p10], h00, [h10 - h00, h11 - h10]),
            ]
        } else {
            [
                triangle(left, [p00, p01, p10], h00, [h10 - h00, h01 - h00]),
                triangle(right, [p11, p10, p01], h11, [h11 - h01, h11 - h10]),
            ]
        }
    }

    fn is_zigzag(&self) -> bool {
        let zigzag = HeightFieldCellStatus::ZIGZAG_SUBDIVISION;
        self.status.contains(zigzag)
    }

    /// The triangles that contain a point of the cell: both if it is on their diagonal.
    fn triangles_at(self, point: DVec2) -> impl Iterator<Item = Triangle> + Clone {
        let share = (point - self.low) / self.size;
        let beyond = if self.is_zigzag() {
            share.x - share.y
        } else {
            share.x + share.y - 1.0
        };
        let [left, right] = self.triangles();
        let left = (beyond <= 0.0).then_some(left);
        left.into_iter().chain((beyond >= 0.0).then_some(right))
    }
}

impl Triangle {
    /// The height of its plane at a point.
    pub fn height_at(&self, point: DVec2) -> f64 {
        self.height + self.gradient.dot(point - self.corners[0])
    }

    /// The vector from a point outside to the nearest point of the triangle, as seen from above.
    pub fn way_from(&self, point: DVec2) -> DVec2 {
        let [a, b, c] = self.corners;
        let to_edge = |(a, b): (DVec2, DVec2)| {
            let edge = b - a;
            let along = (point - a).dot(edge) / edge.length_squared();
            a + edge * along.clamp(0.0, 1.0) - point
        };
        let ways = [(a, b), (b, c), (c, a)].map(to_edge);
        let shorter = |a: DVec2, b: DVec2| {
            if b.length_squared() < a.length_squared() {
                b
            } else {
                a
            }
        };
        shorter(shorter(ways[0], ways[1]), ways[2])
    }
}
