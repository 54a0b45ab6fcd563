//! Overlap of two shapes: of two balls exactly, of other shapes by Parry's contact manifolds.

use std::sync::Arc;

use super::capability::Capability;
use super::separation::Separations;
use crate::math::{ColliderHandle, Pose, Real, SharedShape, Vector};
use crate::rapier::geometry::Aabb;
use crate::rapier::parry::query::details::closest_points_support_map_support_map_with_params as closest_points;
use crate::rapier::parry::query::gjk::{GJKResult, VoronoiSimplex};
use crate::rapier::parry::query::{
    self, Contact, ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher, Unsupported,
};
use crate::rapier::parry::shape::Shape;

/// A point at which two shapes overlap, in world space unless a function says otherwise.
#[derive(Clone, Copy, Debug)]
pub(super) struct OverlapPoint {
    /// The middle of the overlap.
    pub world_point: Vector,
    /// Unit vector from the first shape to the second.
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

/// A ball at its place; the radius includes the contact skin.
#[derive(Clone, Copy, Debug, PartialEq)]
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

impl PartialEq for PlacedShape {
    fn eq(&self, other: &Self) -> bool {
        let same_shape = Arc::ptr_eq(&self.shape.0, &other.shape.0);
        self.pose == other.pose && self.skin == other.skin && same_shape
    }
}

impl PlacedBall {
    pub(super) fn bounds(&self) -> Aabb {
        Aabb::from_half_extents(self.centre, Vector::splat(self.radius))
    }

    pub(super) fn overlap(&self, other: &PlacedBall) -> Option<OverlapPoint> {
        let apart = other.centre - self.centre;
        let reach = self.radius + other.radius;
        if apart.length_squared() >= reach * reach {
            return None;
        }
        let distance = apart.length();
        // With equal centres any direction is valid; Rapier takes +y too.
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

/// A point at which two shapes are near each other, in the frames of both.
#[derive(Clone, Copy, Debug)]
pub(super) struct ManifoldPoint {
    /// The point on each surface, in the frame of its shape.
    pub local_points: [Vector; 2],
    /// Unit vector from the first shape to the second, in the frame of the first.
    pub local_normal: Vector,
}

impl ManifoldPoint {
    /// The point in the frame of the first shape, for a pose of the second relative to the first.
    pub(super) fn placed(&self, relative: &Pose) -> OverlapPoint {
        let [one, two] = self.local_points;
        let two = relative.transform_point(two);
        OverlapPoint {
            world_point: (one + two) * 0.5,
            world_normal: self.local_normal,
            depth: (one - two).dot(self.local_normal),
        }
    }
}

/// The points of Parry's manifolds at which two shapes are less than `margin` apart; `relative` is the pose of the
/// second relative to the first. Empty for shapes between which Parry has no manifolds.
pub(super) fn manifold_points(
    shapes: [&SharedShape; 2],
    relative: &Pose,
    margin: Real,
) -> Vec<ManifoldPoint> {
    let [first, second] = shapes.map(|shape| &*shape.0);
    let mut manifolds: Vec<ContactManifold<(), ()>> = Vec::new();
    if Capability::of(first.shape_type(), second.shape_type()) == Capability::None {
        return Vec::new();
    }
    // Shapes without manifolds that the table does not name, for example inside a compound, have no contact, as in
    // Rapier.
    let _ = DefaultQueryDispatcher.contact_manifolds(
        relative,
        first,
        second,
        margin,
        &mut manifolds,
        &mut None,
    );
    let points = manifolds.iter().flat_map(|manifold| {
        let near = manifold.points.iter().map(move |point| point.dist < margin);
        points_of(manifold, false).zip(near)
    });
    let near = points.filter(|(_, near)| *near);
    near.map(|(point, _)| point).collect()
}

/// The nearest points of two shapes, if they are within `far`; none if that is negative or NaN, for which Parry panics. An
/// error for shapes between which Parry has manifolds only.
pub(super) fn nearest(
    shapes: [&SharedShape; 2],
    relative: &Pose,
    far: Real,
) -> Result<Option<Contact>, Unsupported> {
    // Inside a compound, Parry treats shapes that it does not support as far away.
    let [first, second] = shapes.map(|shape| &*shape.0);
    if has_voxels(first) || has_voxels(second) {
        return Err(Unsupported);
    }
    if far.is_nan() || far < 0.0 {
        return Ok(None);
    }
    query::contact(&Pose::IDENTITY, first, relative, second, far)
}

/// A lower bound of the distance of two shapes; `far` if it is larger, zero if they overlap. `None` where [`nearest`]
/// returns an error.
pub(super) fn distance(shapes: [&SharedShape; 2], relative: &Pose, far: Real) -> Option<Real> {
    // The penetration depth, which [`nearest`] would find too, would be most of the cost.
    let round = shapes.iter().any(|shape| shape.as_ball().is_some());
    let maps = shapes.map(|shape| shape.as_support_map().filter(|_| !round));
    if let [Some(first), Some(second)] = maps {
        let direction = relative.translation.try_normalize().unwrap_or(Vector::X);
        let (simplex, start) = (&mut VoronoiSimplex::new(), Some(direction));
        let found = closest_points(relative, first, second, far, simplex, start);
        return Some(match found {
            GJKResult::ClosestPoints(one, two, normal) => (two - one).dot(normal),
            GJKResult::NoIntersection(_) => far,
            GJKResult::Intersection | GJKResult::Proximity(_) => 0.0,
        });
    }
    let found = nearest(shapes, relative, far).ok()?;
    Some(found.map_or(far, |contact| contact.dist))
}

/// Returns true if a shape is made of voxels, or has a piece that is.
pub(crate) fn has_voxels(shape: &dyn Shape) -> bool {
    let pieces = shape.as_compound().map(|compound| compound.shapes());
    let mut pieces = pieces.into_iter().flatten();
    shape.as_voxels().is_some() || pieces.any(|(_, piece)| has_voxels(&*piece.0))
}

/// The points of a manifold, in the frames of its shapes; `swapped` exchanges the two.
pub(super) fn points_of<M, C>(
    manifold: &ContactManifold<M, C>,
    swapped: bool,
) -> impl Iterator<Item = ManifoldPoint> + '_ {
    let one = manifold.subshape_pos1().copied().unwrap_or(Pose::IDENTITY);
    let two = manifold.subshape_pos2().copied().unwrap_or(Pose::IDENTITY);
    let local_normal = if swapped {
        two.rotation * manifold.local_n2
    } else {
        one.rotation * manifold.local_n1
    };
    manifold.points.iter().map(move |point| {
        let on_one = one.transform_point(point.local_p1);
        let on_two = two.transform_point(point.local_p2);
        ManifoldPoint {
            local_points: if swapped {
                [on_two, on_one]
            } else {
                [on_one, on_two]
            },
            local_normal,
        }
    })
}

impl PlacedShape {
    /// Adds the points at which it overlaps a ball.
    pub(super) fn overlaps_ball(&self, ball: &PlacedBall, points: &mut Vec<OverlapPoint>) {
        let convex = self.shape.is_convex() && self.shape.as_composite_shape().is_none();
        if convex || self.shape.as_halfspace().is_some() {
            points.extend(self.nearest(ball));
            return;
        }
        let other = PlacedShape {
            pose: Pose::from_translation(ball.centre),
            shape: SharedShape::ball(ball.radius),
            skin: 0.0,
        };
        self.place(&other, &self.near(&other), points);
    }

    /// The overlap of a ball with a convex shape or a half-space.
    fn nearest(&self, ball: &PlacedBall) -> Option<OverlapPoint> {
        let local = self.pose.inverse_transform_point(ball.centre);
        let (distance, outward) = match self.shape.as_halfspace() {
            // A half-space has no bounds: its projection would lose digits far from its origin.
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

    /// Returns true if it is known to be clear of another shape, by the distance kept for the pair.
    pub(super) fn is_apart(
        &self,
        other: &PlacedShape,
        pair: [ColliderHandle; 2],
        known: &mut Separations,
    ) -> bool {
        if self
            .shape
            .as_halfspace()
            .or(other.shape.as_halfspace())
            .is_some()
        {
            // The manifold of a half-space costs less than its distance.
            return false;
        }
        let relative = self.pose.inv_mul(&other.pose);
        let shapes = [&self.shape, &other.shape];
        let measure = |reach: Real| distance(shapes, &relative, 0.25 * reach);
        let near = self.skin + other.skin;
        known.are_apart(pair, shapes, &relative, near, measure)
    }

    /// The points at which it is nearer to another shape than their skins.
    pub(super) fn near(&self, other: &PlacedShape) -> Vec<ManifoldPoint> {
        let relative = self.pose.inv_mul(&other.pose);
        let skins = self.skin + other.skin;
        manifold_points([&self.shape, &other.shape], &relative, skins)
    }

    /// Adds the points of a pair as they lie at its present poses, without those that do not overlap any more.
    pub(super) fn place(
        &self,
        other: &PlacedShape,
        near: &[ManifoldPoint],
        points: &mut Vec<OverlapPoint>,
    ) {
        let relative = self.pose.inv_mul(&other.pose);
        let skins = self.skin + other.skin;
        let placed = near.iter().map(|point| point.placed(&relative));
        let placed = placed.filter(|point| point.depth + skins > 0.0);
        // The middle between the two skins, which lie along the normal from the surfaces.
        let off = (self.skin - other.skin) * 0.5;
        points.extend(placed.map(|point| OverlapPoint {
            world_point: (self.pose).transform_point(point.world_point + point.world_normal * off),
            world_normal: self.pose.rotation * point.world_normal,
            depth: point.depth + skins,
        }));
    }
}

/// Unit vector out of a shape at a point of its surface, where the projection gives no direction: that of the
/// neighbouring point, along one of the axes, which is farthest outside.
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
