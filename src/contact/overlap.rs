//! Where two shapes overlap: balls exactly, all else by Parry's contact manifolds.

use crate::math::{Pose, Real, SharedShape, Vector};
use crate::rapier::parry::query::{
    ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher,
};

/// A point at which two shapes overlap.
#[derive(Clone, Copy, Debug)]
pub(super) struct OverlapPoint {
    /// The middle of the overlap.
    pub world_point: Vector,
    /// From the first to the second.
    pub world_normal: Vector,
    pub depth: Real,
}

impl OverlapPoint {
    pub(super) fn flipped(self) -> Self {
        OverlapPoint {
            world_normal: -self.world_normal,
            ..self
        }
    }
}

/// A ball at its place; its radius is that with the skin.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedBall {
    pub centre: Vector,
    pub radius: Real,
}

/// Any other shape at its place.
#[derive(Clone, Debug)]
pub(super) struct PlacedShape {
    pub pose: Pose,
    pub shape: SharedShape,
    pub skin: Real,
}

impl PlacedBall {
    pub(super) fn overlap(&self, other: &PlacedBall) -> Option<OverlapPoint> {
        let apart = other.centre - self.centre;
        let reach = self.radius + other.radius;
        if apart.length_squared() >= reach * reach {
            return None;
        }
        let distance = apart.length();
        // Of two equal centres no direction is better; Rapier takes +y too.
        let normal = if distance > 0.0 {
            apart / distance
        } else {
            Vector::Y
        };
        let depth = reach - distance;
        Some(OverlapPoint {
            world_point: self.centre + normal * (self.radius - depth * 0.5),
            world_normal: normal,
            depth,
        })
    }
}

/// Parry's manifolds between any two shapes, and room for them.
#[derive(Default)]
pub(super) struct Manifolds(Vec<ContactManifold<(), ()>>);

impl std::fmt::Debug for Manifolds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Manifolds")
    }
}

impl Manifolds {
    /// The points of two shapes that are at most `margin` apart, the second's frame given in the
    /// first's; in the first's frame. None for shapes that Parry has no manifolds of.
    pub(super) fn points(
        &mut self,
        shapes: [&SharedShape; 2],
        relative: &Pose,
        margin: Real,
    ) -> impl Iterator<Item = OverlapPoint> {
        self.0.clear();
        let [first, second] = shapes.map(|shape| &*shape.0);
        // Of what Parry does not know there is no contact, as in Rapier.
        let _ = DefaultQueryDispatcher.contact_manifolds(
            relative,
            first,
            second,
            margin,
            &mut self.0,
            &mut None,
        );
        let (manifolds, relative) = (&self.0, *relative);
        manifolds.iter().flat_map(move |manifold| {
            let frame = manifold.subshape_pos1().copied().unwrap_or(Pose::IDENTITY);
            let other = manifold.subshape_pos2().copied().unwrap_or(Pose::IDENTITY);
            let normal = frame.rotation * manifold.local_n1;
            let near = manifold.points.iter().filter(move |it| it.dist < margin);
            near.map(move |point| {
                let one = frame.transform_point(point.local_p1);
                let two = relative.transform_point(other.transform_point(point.local_p2));
                OverlapPoint {
                    world_point: (one + two) * 0.5,
                    world_normal: normal,
                    depth: -point.dist,
                }
            })
        })
    }
}

impl PlacedShape {
    /// Where it overlaps a ball.
    pub(super) fn overlaps_ball(
        &self,
        ball: &PlacedBall,
        manifolds: &mut Manifolds,
        points: &mut Vec<OverlapPoint>,
    ) {
        let convex = self.shape.is_convex() && self.shape.as_composite_shape().is_none();
        if convex || self.shape.as_halfspace().is_some() {
            points.extend(self.nearest(ball));
            return;
        }
        let shape = SharedShape::ball(ball.radius);
        let place = Pose::from_translation(ball.centre);
        let other = PlacedShape {
            pose: place,
            shape,
            skin: 0.0,
        };
        self.overlaps(&other, manifolds, points);
    }

    /// The overlap of a ball with what is in one piece.
    fn nearest(&self, ball: &PlacedBall) -> Option<OverlapPoint> {
        let local = self.pose.inverse_transform_point(ball.centre);
        let (distance, outward) = match self.shape.as_halfspace() {
            // The one shape without bounds: its projection would lose digits far from its origin.
            Some(half_space) => (half_space.normal.dot(local), half_space.normal),
            None => {
                let projection = self.shape.project_local_point(local, false);
                let away = local - projection.point;
                let sign = if projection.is_inside { -1.0 } else { 1.0 };
                let outward = away.try_normalize().map(|away| away * sign);
                let outward =
                    outward.unwrap_or_else(|| outward_at(&self.shape, local, ball.radius));
                (away.length() * sign, outward)
            }
        };
        let depth = ball.radius + self.skin - distance;
        if depth <= 0.0 {
            return None;
        }
        let normal = self.pose.rotation * outward;
        Some(OverlapPoint {
            world_point: ball.centre - normal * (ball.radius - depth * 0.5),
            world_normal: normal,
            depth,
        })
    }

    /// Where it overlaps another shape.
    pub(super) fn overlaps(
        &self,
        other: &PlacedShape,
        manifolds: &mut Manifolds,
        points: &mut Vec<OverlapPoint>,
    ) {
        let relative = self.pose.inv_mul(&other.pose);
        let skins = self.skin + other.skin;
        let found = manifolds.points([&self.shape, &other.shape], &relative, skins);
        points.extend(found.map(|point| OverlapPoint {
            world_point: self.pose.transform_point(point.world_point),
            world_normal: self.pose.rotation * point.world_normal,
            depth: point.depth + skins,
        }));
    }
}

/// Unit vector out of a shape at a point of its surface, where the projection shows no direction:
/// the one in which a point a little beside it is farthest outside.
fn outward_at(shape: &SharedShape, local: Vector, radius: Real) -> Vector {
    let step = local.length().max(radius) * Real::EPSILON.sqrt();
    let away = |axis: Vector| {
        let beside = local + axis * step;
        let projection = shape.project_local_point(beside, false);
        (!projection.is_inside).then(|| beside - projection.point)
    };
    Vector::AXES
        .into_iter()
        .flat_map(|axis| [away(axis), away(-axis)])
        .flatten()
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        .and_then(Vector::try_normalize)
        .unwrap_or(Vector::Y)
}
