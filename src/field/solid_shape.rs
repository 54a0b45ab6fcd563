//! Parry's shapes as solids.

use super::any_shape::AnyShape;
use super::closed_mesh::{MeshFault, oriented};
use super::error::{BuildError, require};
use super::ground::Ground;
use super::surface::{Face, Surface};
use crate::math::{DVec3, Pose, Real, SharedShape, Vector, from_dvec3, to_dvec3, to_f64};
use crate::number::{Plain, Vec3, constant, real};

/// A shape of Parry's together with its inside; see [`Region::shape`](crate::Region::shape).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(from = "AnyShape", into = "AnyShape")
)]
pub struct SolidShape {
    shape: AnyShape,
    inside: Inside,
}

/// The inside of a shape.
#[derive(Clone, Debug, PartialEq)]
enum Inside {
    /// Nothing: the shape is a surface or a line of this kind.
    Nothing(&'static str),
    /// The inside of a shape by Parry's definition.
    Shape(Core),
    /// The points below a height field.
    Below(Ground),
    /// Not defined: the mesh is not the surface of a solid.
    Unknown(MeshFault),
}

impl Inside {
    fn of(shape: &SharedShape) -> Self {
        if let Some(ground) = Ground::of(shape) {
            return Inside::Below(ground);
        }
        if let Some(kind) = flat(shape) {
            return Inside::Nothing(kind);
        }
        match shape.as_trimesh() {
            // A mesh that is flagged as wound outwards is taken as it is.
            Some(mesh) if mesh.pseudo_normals_if_oriented().is_none() => match oriented(mesh) {
                Ok(mesh) => Inside::Shape(Core::new(mesh, 0.0)),
                Err(fault) => Inside::Unknown(fault),
            },
            _ => Inside::Shape(Core::of(shape)),
        }
    }
}

/// A shape, or the shape that was rounded to make it and the radius, by which the surface is further out. Parry projects
/// onto rounded shapes by an iteration that takes three to sixteen times as long and is off by up to 2e-3.
#[derive(Clone, Debug, PartialEq)]
struct Core {
    shape: AnyShape,
    skin: f64,
}

impl Core {
    fn new(shape: SharedShape, skin: Real) -> Self {
        let (shape, skin) = (AnyShape(shape), to_f64(skin));
        Core { shape, skin }
    }

    fn of(shape: &SharedShape) -> Self {
        if let Some(round) = shape.as_round_cuboid() {
            return Core::new(SharedShape::new(round.inner_shape), round.border_radius);
        }
        if let Some(round) = shape.as_round_cylinder() {
            return Core::new(SharedShape::new(round.inner_shape), round.border_radius);
        }
        if let Some(round) = shape.as_round_cone() {
            return Core::new(SharedShape::new(round.inner_shape), round.border_radius);
        }
        if let Some(round) = shape.as_round_convex_polyhedron() {
            let inner_shape = SharedShape::new(round.inner_shape.clone());
            return Core::new(inner_shape, round.border_radius);
        }
        Core::new(shape.clone(), 0.0)
    }

    /// The nearest surface.
    fn surface(&self, point: DVec3) -> Surface {
        let mut near = nearest_surface(&self.shape.0, point);
        if self.skin != 0.0 && near.distance == 0.0 {
            // On the surface of the core, the direction is taken from a point beside it.
            let beside = DVec3::splat(self.skin * to_f64(NEXT));
            near = nearest_surface(&self.shape.0, point + beside);
        }
        Surface::new(near.distance - self.skin, real(near.outward))
    }
}

impl From<AnyShape> for SolidShape {
    fn from(shape: AnyShape) -> Self {
        let inside = Inside::of(&shape.0);
        SolidShape { shape, inside }
    }
}

impl From<SolidShape> for AnyShape {
    fn from(solid: SolidShape) -> Self {
        solid.shape
    }
}

impl SolidShape {
    /// The shape as it was given.
    pub fn shape(&self) -> &SharedShape {
        &self.shape.0
    }

    /// Visits the surfaces whose inner sides intersect in the solid, in its own frame.
    pub(super) fn for_each_surface<P: Plain>(
        &self,
        point: Vec3<P>,
        mut visit: impl FnMut(Surface<P>),
    ) {
        let number = |axis: usize| point[axis].single();
        let (Some(x), Some(y), Some(z)) = (number(0), number(1), number(2)) else {
            return visit(Surface::new(f64::NAN, DVec3::ZERO).lift());
        };
        let point = DVec3::new(x, y, z);
        match &self.inside {
            Inside::Nothing(_) | Inside::Unknown(_) => {
                visit(Surface::new(f64::INFINITY, DVec3::ZERO).lift());
            }
            Inside::Shape(core) => visit(core.surface(point).lift()),
            Inside::Below(ground) => ground.for_each_surface(point, |seen| visit(seen.lift())),
        }
    }

    /// The surface as one face, as seen from a point of the solid's frame. Its curvature within a distance is
    /// estimated from its deviation from the tangent plane; it is infinite if there seems to be another face
    /// within that distance.
    pub(super) fn face(&self, point: DVec3, within: f64) -> Face {
        let seen = self.outermost(point);
        let mut face = Face::curved(&seen, f64::INFINITY, None);
        let Some(outward) = real(seen.outward).try_normalize() else {
            return face;
        };
        let foot = point - outward * face.distance;
        let (u, v) = outward.any_orthonormal_pair();
        let off = [u, -u, v, -v].map(|way| self.outermost(foot + way * within).distance.abs());
        let bend = 2.0 * off.into_iter().fold(0.0, f64::max) / (within * within);
        let may_differ = (bend * within).max(SAME) * within;
        let is_as_one_face = |way: DVec3| {
            let one = face.distance + outward.dot(way);
            let all = self.outermost(point + way).distance;
            (one < 0.0) == (all < 0.0) || (one - all).abs() <= may_differ
        };
        if around().all(|way| is_as_one_face(way * within)) {
            face.curvature = bend;
        }
        face
    }

    /// The surface of greatest signed distance from a point of the solid's frame.
    fn outermost(&self, point: DVec3) -> Surface {
        let mut found = Surface::new(f64::NEG_INFINITY, DVec3::ZERO);
        self.for_each_surface(constant(point), |surface: Surface| {
            if surface.distance > found.distance {
                found = surface;
            }
        });
        found
    }

    /// A bound of the distance of the solid from its own origin; `None` if it is not bounded.
    pub(super) fn extent(&self) -> Option<Real> {
        if matches!(self.inside, Inside::Below(_)) {
            return None;
        }
        let bounds = self.shape.0.compute_local_bounding_sphere();
        let extent = bounds.center.length() + bounds.radius;
        extent.is_finite().then_some(extent)
    }

    pub(super) fn validate(&self, field: &str) -> Result<(), BuildError> {
        match &self.inside {
            Inside::Unknown(fault) => Err(BuildError::MeshRegion {
                field: field.into(),
                fault: fault.clone(),
            }),
            Inside::Nothing(shape) => Err(BuildError::FlatRegion {
                field: field.into(),
                shape,
            }),
            Inside::Below(ground) => ground.validate(field),
            _ => self.validate_parts(field),
        }
    }

    /// Parry's compounds may contain height fields, but do not count the points below these as inside.
    fn validate_parts(&self, field: &str) -> Result<(), BuildError> {
        let compound = self.shape.0.as_compound();
        let parts = compound.map_or(&[][..], |compound| compound.shapes());
        let is_ground = |(_, part): &&(Pose, SharedShape)| part.as_heightfield().is_some();
        let grounds = parts.iter().filter(is_ground).count();
        let quantity = "the number of height fields in the compound of the region";
        let none = "zero (a height field can be a region of its own)";
        require(grounds == 0, field, quantity, none, grounds as f64)
    }
}

/// Distances that differ by less than this share of a body's size count as equal.
const SAME: f64 = 1e-6;

/// Directions all around: every direction is within 28° of one of them. A face that passes between them cuts off less
/// than 1/100 of a ball.
fn around() -> impl Iterator<Item = DVec3> {
    let signs = |n: u8| f64::from(n) - 1.0;
    let cube = (0..27_u8).map(move |n| DVec3::new(signs(n % 3), signs(n / 3 % 3), signs(n / 9)));
    cube.filter_map(DVec3::try_normalize)
}

/// The kind of a shape that has no points inside, if it is one.
fn flat(shape: &SharedShape) -> Option<&'static str> {
    let compound = shape.as_compound().map_or(&[][..], |it| it.shapes());
    match () {
        () if shape.as_triangle().is_some() => Some("triangle"),
        () if shape.as_segment().is_some() => Some("segment"),
        () if shape.as_polyline().is_some() => Some("polyline"),
        () => compound.iter().find_map(|(_, part)| flat(part)),
    }
}

/// The nearest surface of a shape for which Parry defines an inside.
fn nearest_surface(shape: &SharedShape, point: DVec3) -> Surface {
    let local_point = from_dvec3(point);
    let mut projection = shape.project_local_point(local_point, false);
    // For these Parry projects onto the nearest part, which need not contain the point.
    let in_parts = shape.as_compound().is_some() || shape.as_voxels().is_some();
    let mut is_inside = projection.is_inside;
    if !is_inside && in_parts {
        is_inside = shape.contains_local_point(local_point);
    }
    if !projection.point.is_finite() || is_inside != projection.is_inside {
        // At the very centre of a ball Parry finds no nearest point, and in a compound it finds that of another part.
        let reach = shape.compute_local_bounding_sphere().radius;
        let beside = local_point + Vector::X * (reach * NEXT);
        let near = shape.project_local_point(beside, false);
        if near.is_inside {
            projection = near;
        }
    }
    let outward = point - to_dvec3(projection.point);
    let sign = if is_inside { -1.0 } else { 1.0 };
    Surface::new(sign * outward.length(), sign * outward)
}

/// The distance from the centre of a ball at which the projection is repeated, as a share of the shape's size.
const NEXT: Real = 1e-6;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::rapier::parry::query::PointQuery;
    use crate::rapier::parry::shape::Triangle;

    fn corners() -> Vec<Vector> {
        let corners = [0.0, 2.1, 4.2].map(|turn: Real| Vector::new(turn.cos(), -0.4, turn.sin()));
        [corners.as_slice(), &[Vector::Y, Vector::NEG_Y]].concat()
    }

    /// The signed distance from a box about the origin, in any number of dimensions.
    fn from_box(off: DVec3) -> f64 {
        off.max(DVec3::ZERO).length() + off.max_element().min(0.0)
    }

    /// The signed distance from a cone of unit radius and half height, from that of its half section, a triangle.
    fn from_cone(point: DVec3) -> f64 {
        let [x, y] = [point.x.hypot(point.z), point.y];
        let from_segment = |[a, b]: [(f64, f64); 2]| {
            let along = (b.0 - a.0, b.1 - a.1);
            let t = (x - a.0) * along.0 + (y - a.1) * along.1;
            let t = (t / (along.0 * along.0 + along.1 * along.1)).clamp(0.0, 1.0);
            (x - a.0 - t * along.0).hypot(y - a.1 - t * along.1)
        };
        let (tip, rim, foot) = ((0.0, 1.0), (1.0, -1.0), (0.0, -1.0));
        let apart = from_segment([tip, rim]).min(from_segment([rim, foot]));
        let is_inside = y > -1.0 && 2.0 * x + y < 1.0;
        if is_inside { -apart } else { apart }
    }

    /// The signed distance from a hull, from the planes of its faces and the nearest of its triangles.
    fn from_hull(point: DVec3) -> f64 {
        let hull = SharedShape::convex_hull(&corners()).expect("corners of a solid");
        let (places, faces) = hull.as_convex_polyhedron().expect("a hull").to_trimesh();
        let triangles = faces.iter().map(|face| face.map(|n| places[n as usize]));
        let local_point = from_dvec3(point);
        let from = |[a, b, c]: [Vector; 3]| {
            let foot = Triangle::new(a, b, c).project_local_point(local_point, false);
            let outward = (b - a).cross(c - a);
            let apart = point.distance(to_dvec3(foot.point));
            (apart, outward.dot(local_point - a) > 0.0)
        };
        let all: Vec<(f64, bool)> = triangles.map(from).collect();
        let apart = all.iter().map(|it| it.0).fold(f64::INFINITY, f64::min);
        let is_outside = all.iter().any(|it| it.1);
        if is_outside { apart } else { -apart }
    }

    proptest! {
        #[test]
        fn distances_from_rounded_shapes_are_exact(
            [x, y, z] in prop::array::uniform3(-2.0..2.0_f64)
        ) {
            let point = DVec3::new(x, y, z);
            let off = DVec3::new(x.hypot(z) - 0.4, y.abs() - 0.6, f64::NEG_INFINITY);
            let hull = SharedShape::round_convex_hull(&corners(), 0.25);
            let cases = [
                (SharedShape::round_cuboid(0.5, 0.8, 0.3, 0.2), 0.2),
                (SharedShape::round_cylinder(0.6, 0.4, 0.1), 0.1),
                (SharedShape::round_cone(1.0, 1.0, 0.3), 0.3),
                (hull.expect("corners of a solid"), 0.25),
            ];
            let from_cores = [
                from_box(point.abs() - DVec3::new(0.5, 0.8, 0.3)),
                from_box(off),
                from_cone(point),
                from_hull(point),
            ];
            for ((shape, radius), from_core) in cases.into_iter().zip(from_cores) {
                let kind = shape.shape_type();
                let own = SolidShape::from(AnyShape(shape)).outermost(point).distance;
                let expected = from_core - radius;
                prop_assert!((own - expected).abs() < 1e-5, "{kind:?}: {own} {expected}");
            }
        }
    }

    #[test]
    fn points_on_the_core_of_a_rounded_shape_have_a_direction() {
        let solid = SolidShape::from(AnyShape(SharedShape::round_cuboid(1.0, 1.0, 1.0, 0.25)));
        for point in [
            DVec3::X,
            DVec3::NEG_Y,
            DVec3::ONE,
            DVec3::new(1.0, 0.5, 0.5),
        ] {
            let seen = solid.outermost(point);
            assert!(
                (seen.distance + 0.25).abs() < 1e-5,
                "{point}: {}",
                seen.distance
            );
            let outward = real(seen.outward).try_normalize();
            assert!(
                outward.is_some_and(|it| it.dot(point) > 0.5),
                "{point}: {outward:?}"
            );
        }
    }

    #[test]
    fn the_centre_of_a_ball_is_inside() {
        let ball = SharedShape::ball(2.0);
        let beside = Pose::from_translation(Vector::Y * 3.0);
        let far = Pose::from_translation(Vector::Y * -9.0);
        let parts = vec![(beside, ball.clone()), (far, ball.clone())];
        let compound = SharedShape::compound(parts);
        for (shape, centre) in [(ball, DVec3::ZERO), (compound, DVec3::Y * 3.0)] {
            let solid = SolidShape::from(AnyShape(shape));
            for off in [DVec3::ZERO, DVec3::Z * 1e-30, DVec3::X * 0.5] {
                let distance = solid.outermost(centre + off).distance;
                let expected = off.length() - 2.0;
                assert!((distance - expected).abs() < 1e-5, "{off}: {distance}");
            }
        }
    }
}
