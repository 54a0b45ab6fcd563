//! The cube in which arrows and seeds of stream lines lie.

use super::placed::PlacedField;
use super::style::FieldDebugRenderStyle;
use crate::bridge::WorldRef;
use crate::math::{Real, Vector};

/// A cube in world space, and the plane through its middle.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub centre: Vector,
    pub half_size: Real,
    /// The direction across the slice.
    pub normal: Vector,
    right: Vector,
    up: Vector,
}

impl View {
    /// The view of a style, which follows the bodies and fields where the style leaves it open.
    pub fn new(
        style: &FieldDebugRenderStyle,
        world: WorldRef<'_>,
        fields: &[BoundingBall],
    ) -> Self {
        let bodies: Vec<Vector> = centres_of_mass(world).collect();
        let places = fields.iter().map(|ball| ball.centre);
        let centre = style.centre.unwrap_or_else(|| match bodies[..] {
            [] => mean(places),
            _ => mean(bodies.iter().copied()),
        });
        let farthest = bodies.iter().map(|body| body.distance(centre));
        let ends = fields
            .iter()
            .map(|it| it.centre.distance(centre) + it.radius);
        let sizes = [largest(farthest) * 1.25, largest(ends), 5.0];
        let half_size = style
            .half_size
            .or_else(|| sizes.into_iter().find(|size| *size > 0.0));
        let normal = style.slice_normal.try_normalize().unwrap_or(Vector::Z);
        let (right, up) = normal.any_orthonormal_pair();
        View {
            centre,
            half_size: half_size.unwrap_or_default(),
            normal,
            right,
            up,
        }
    }

    /// A grid of this number of points along each edge of the slice.
    pub fn slice(&self, count: u32) -> Vec<Vector> {
        let rows = offsets(count).flat_map(|y| offsets(count).map(move |x| [x, y]));
        let point = |[x, y]: [Real; 2]| (self.right * x + self.up * y) * self.half_size;
        rows.map(|at| self.centre + point(at)).collect()
    }

    /// A grid of this number of points along each edge of the cube.
    pub fn volume(&self, count: u32) -> Vec<Vector> {
        let across = |point: Vector| {
            let offsets = offsets(count);
            offsets.map(move |z| point + self.normal * (z * self.half_size))
        };
        self.slice(count).into_iter().flat_map(across).collect()
    }

    /// The distance between neighbours in a grid of this number of points along each edge.
    pub fn spacing(&self, count: u32) -> Real {
        2.0 * self.half_size / (count.max(2) - 1) as Real
    }
}

/// A ball in world space that encloses the region of a field.
pub(super) struct BoundingBall {
    centre: Vector,
    radius: Real,
}

impl BoundingBall {
    /// The ball around a field; `None` if its region is not known to be bounded.
    pub fn around(placed: &PlacedField<'_>) -> Option<Self> {
        Some(BoundingBall {
            centre: placed.frame.pose.translation,
            radius: placed.field.region.bounding_radius()?,
        })
    }
}

/// The centres of mass of the bodies that fields can move.
fn centres_of_mass(world: WorldRef<'_>) -> impl Iterator<Item = Vector> {
    let bodies = world.bodies.iter().map(|(_, body)| body);
    let free = bodies.filter(|body| body.is_dynamic() && body.is_enabled());
    let centres = free.map(|body| body.center_of_mass());
    centres.filter(|centre| centre.is_finite())
}

fn mean(points: impl Iterator<Item = Vector>) -> Vector {
    let mut count = 0.0;
    // A running mean, so that no sum can overflow.
    points.fold(Vector::ZERO, |mean, point| {
        count += 1.0;
        mean + (point - mean) / count
    })
}

fn largest(lengths: impl Iterator<Item = Real>) -> Real {
    let finite = lengths.filter(|length| length.is_finite());
    finite.fold(0.0, Real::max)
}

/// Equidistant numbers from −1 to 1; the number 0 if `count` is one.
fn offsets(count: u32) -> impl Iterator<Item = Real> {
    let last = count.saturating_sub(1);
    (0..count).map(move |at| match last {
        0 => 0.0,
        _ => 2.0 * at as Real / last as Real - 1.0,
    })
}
