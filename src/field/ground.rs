//! The solid below a height field.

mod cells;

use super::error::{BuildError, FINITE, POSITIVE, require};
use super::surface::Surface;
use crate::math::{DVec2, DVec3, SharedShape, to_dvec3, to_f64};
use crate::number::constant;
use cells::{Cell, Cells, Triangle};

/// The points below a height field, within its rectangle, at any depth. Points below removed cells and
/// triangles are outside.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    shape: SharedShape,
    /// A lower bound of the distance from the ground, as a share of the height above it: the cosine of the steepest
    /// slope.
    least_share: f64,
    has_holes: bool,
}

impl PartialEq for Ground {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::addr_eq(&*self.shape, &*other.shape)
    }
}

impl Ground {
    /// The ground under a shape, if it is a height field.
    pub fn of(shape: &SharedShape) -> Option<Self> {
        let cells = Cells::of(shape.as_heightfield()?);
        let slopes = cells
            .all()
            .flat_map(Cell::triangles)
            .map(|t| t.gradient.length());
        let steepest = slopes.fold(0.0, f64::max);
        Some(Ground {
            shape: shape.clone(),
            least_share: 1.0 / steepest.hypot(1.0),
            has_holes: cells.all().flat_map(Cell::triangles).any(|t| !t.is_there),
        })
    }

    /// Visits the sides of the rectangle and, as one surface, the ground and the walls of holes.
    pub fn for_each_surface(&self, point: DVec3, mut visit: impl FnMut(Surface)) {
        let Some(field) = self.shape.as_heightfield() else {
            return visit(Surface::new(f64::INFINITY, DVec3::ZERO));
        };
        let cells = Cells::of(field);
        for axis in [0, 2] {
            let outward = DVec3::AXES[axis] * point[axis].signum();
            let distance = point[axis].abs() - 0.5 * cells.scale[axis];
            visit(Surface::new(distance, outward));
        }
        let near = cells.clamp(point);
        let top = self.top(cells.at(near), near, point.y);
        let wall = self.has_holes.then(|| wall(cells, near));
        visit(match wall {
            Some(wall) if wall.distance >= top.distance => wall,
            _ => top,
        });
    }

    /// The ground with holes filled in, as seen from a height.
    fn top(&self, mut here: impl Iterator<Item = Triangle>, near: DVec2, height: f64) -> Surface {
        let Some(first) = here.next() else {
            return Surface::new(f64::INFINITY, DVec3::ZERO);
        };
        let gap = height - first.height_at(near);
        let bound = gap * self.least_share;
        // The distance is zero only on the surface.
        let vanished = bound == 0.0 && gap != 0.0;
        let distance = if vanished {
            f64::MIN_POSITIVE.copysign(gap)
        } else {
            bound
        };
        let normal = DVec3::new(-first.gradient.x, 1.0, -first.gradient.y);
        // A fold has no plane, so the set is taken as closed there.
        let folded = gap == 0.0 && here.any(|other| other.gradient != first.gradient);
        Surface {
            distance,
            outward: constant(if folded { DVec3::ZERO } else { normal }),
            slope: self.least_share * normal.length(),
        }
    }

    pub fn validate(&self, field: &str) -> Result<(), BuildError> {
        let Some(heights) = self.shape.as_heightfield() else {
            return Ok(());
        };
        let scale = to_dvec3(heights.scale());
        for (axis, quantity) in [
            (0, "the x scale of the region's height field"),
            (2, "the z scale of the region's height field"),
        ] {
            let fits = scale[axis] > 0.0 && scale[axis].is_finite();
            require(fits, field, quantity, POSITIVE, scale[axis])?;
        }
        let quantity = "a scaled height of the region's height field";
        let mut heights = heights.heights().data().iter();
        heights.try_for_each(|height| {
            let height = to_f64(*height) * scale.y;
            require(height.is_finite(), field, quantity, FINITE, height)
        })
    }
}

/// The nearest wall of a hole; if no cell around has one, a surface without direction at the end of these cells.
fn wall(cells: Cells<'_>, near: DVec2) -> Surface {
    let mut here = cells.at(near).map(|triangle| triangle.is_there);
    let solid = here.next().unwrap_or(false);
    if here.any(|other| other != solid) {
        return Surface::new(0.0, DVec3::ZERO);
    }
    let (around, beyond) = cells.around(near);
    let others = around.filter(|triangle| triangle.is_there != solid);
    let ways = others.map(|triangle| triangle.way_from(near));
    let way = ways.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let sign = if solid { -1.0 } else { 1.0 };
    match way.filter(|way| way.length() <= beyond) {
        Some(way) => Surface::new(sign * way.length(), -sign * DVec3::new(way.x, 0.0, way.y)),
        None => Surface {
            distance: sign * beyond,
            outward: constant(DVec3::ZERO),
            slope: 0.0,
        },
    }
}
