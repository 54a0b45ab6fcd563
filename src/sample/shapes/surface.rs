//! Samples of the surfaces of shapes, and triangle meshes of these surfaces.

use super::moments::{Moments, matched, outer};
use super::rule::{Quadrature, bounds};
use crate::math::{DMat3, DVec3, Pose, SharedShape, Vector, to_dvec3, to_f64};
use crate::rapier::parry::shape::TypedShape;

/// Facets around round shapes.
const FACETS: u32 = 96;

/// Patches along each edge of a shape's bounds.
const PATCHES: f64 = 3.0;

/// Triangles are cut into four until they are smaller than half a patch, but at most this often.
const MOST_CUTS: u32 = 4;

type Triangle = [DVec3; 3];

/// Points on the surface with their shares of its area; `None` for shapes without a mesh or bounds.
pub(super) fn rule(shape: &SharedShape) -> Option<Quadrature> {
    if let Some(cuboid) = shape.as_cuboid() {
        return Some(of_points(cuboid_points(to_dvec3(cuboid.half_extents))));
    }
    if let Some(ball) = shape.as_ball() {
        let radius = to_f64(ball.radius);
        let axes = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
        return Some(of_points(axes.map(|axis| (axis * radius, 1.0)).collect()));
    }
    let (low, high) = bounds(shape)?;
    let mut triangles = Vec::new();
    add_triangles(shape, &Pose::IDENTITY, FACETS, &mut triangles);
    let patch = ((high - low) / PATCHES).max(DVec3::splat(f64::MIN_POSITIVE));
    let points = patches(&triangles, low, patch);
    let moments = of_triangles(&triangles)?;
    let matched = matched(&points, &moments).map(|(points, _)| points);
    Some(of_points(matched.unwrap_or(points)))
}

fn of_points(points: Vec<(DVec3, f64)>) -> Quadrature {
    let total: f64 = points.iter().map(|(_, area)| area).sum();
    let points = points.into_iter();
    Quadrature::of(
        points.map(|(point, area)| (point, area / total)),
        DMat3::ZERO,
    )
}

/// 2 × 2 Gauss points on each face.
fn cuboid_points(half: DVec3) -> Vec<(DVec3, f64)> {
    let gauss = 3.0_f64.sqrt().recip();
    let mut points = Vec::with_capacity(24);
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for corner in 0..8_usize {
            let sign = |bit: usize| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let mut point = DVec3::ZERO;
            point[axis] = half[axis] * sign(0);
            point[u] = half[u] * sign(1) * gauss;
            point[v] = half[v] * sign(2) * gauss;
            points.push((point, half[u] * half[v]));
        }
    }
    points
}

/// Appends the surface of a shape as triangles, with this number of `facets` around round shapes. Shapes that
/// have no mesh add none.
pub(super) fn add_triangles(
    shape: &SharedShape,
    pose: &Pose,
    facets: u32,
    triangles: &mut Vec<Triangle>,
) {
    let (points, indices): (Vec<Vector>, Vec<[u32; 3]>) = match shape.as_typed_shape() {
        TypedShape::Capsule(shape) => shape.to_trimesh(facets, facets / 4),
        TypedShape::Cylinder(shape) => shape.to_trimesh(facets),
        TypedShape::Cone(shape) => shape.to_trimesh(facets),
        TypedShape::Ball(shape) => shape.to_trimesh(facets, facets / 2),
        TypedShape::Cuboid(shape) => shape.to_trimesh(),
        TypedShape::ConvexPolyhedron(shape) => shape.to_trimesh(),
        TypedShape::HeightField(shape) => shape.to_trimesh(),
        TypedShape::Voxels(shape) => shape.to_trimesh(),
        TypedShape::TriMesh(shape) => (shape.vertices().to_vec(), shape.indices().to_vec()),
        TypedShape::RoundCuboid(shape) => shape.inner_shape.to_trimesh(),
        TypedShape::RoundCylinder(shape) => shape.inner_shape.to_trimesh(facets),
        TypedShape::RoundCone(shape) => shape.inner_shape.to_trimesh(facets),
        TypedShape::RoundConvexPolyhedron(shape) => shape.inner_shape.to_trimesh(),
        TypedShape::Compound(shape) => {
            for (local_pose, part) in shape.shapes() {
                add_triangles(part, &(*pose * *local_pose), facets, triangles);
            }
            return;
        }
        _ => return,
    };
    let corner = |index: u32| {
        points
            .get(index as usize)
            .map(|p| to_dvec3(pose.transform_point(*p)))
    };
    triangles.extend(
        indices
            .iter()
            .filter_map(|[a, b, c]| Some([corner(*a)?, corner(*b)?, corner(*c)?])),
    );
}

fn area(&[a, b, c]: &Triangle) -> f64 {
    (b - a).cross(c - a).length() * 0.5
}

fn middle(&[a, b, c]: &Triangle) -> DVec3 {
    (a + b + c) / 3.0
}

/// Moments of the surface: ∫ x xᵀ = A/12 (Σ v vᵀ + 9 c cᵀ) for a triangle of area A with corners v and middle c.
fn of_triangles(triangles: &[Triangle]) -> Option<Moments> {
    let points: Vec<_> = triangles.iter().map(|t| (middle(t), area(t))).collect();
    let mut moments = Moments::of_points(&points);
    let mut second = DMat3::ZERO;
    for (triangle, (middle, area)) in triangles.iter().zip(&points) {
        let about = |point: DVec3| outer(point - moments.centre);
        let corners = triangle
            .iter()
            .fold(DMat3::ZERO, |sum, corner| sum + about(*corner));
        second += (corners + about(*middle) * 9.0) * (*area / 12.0);
    }
    moments.second = second * moments.measure.recip();
    (moments.measure > 0.0 && moments.second.is_finite()).then_some(moments)
}

/// One point for the part of the surface in each cell of a grid.
fn patches(triangles: &[Triangle], low: DVec3, patch: DVec3) -> Vec<(DVec3, f64)> {
    let mut cells = [[0.0; 4]; 27];
    let mut open: Vec<(Triangle, u32)> = triangles.iter().map(|t| (*t, 0)).collect();
    while let Some((triangle, cuts)) = open.pop() {
        let [a, b, c] = triangle;
        let extent = a.max(b).max(c) - a.min(b).min(c);
        if cuts < MOST_CUTS && extent.cmpgt(patch * 0.5).any() {
            let (ab, bc, ca) = ((a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5);
            let four = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
            open.extend(four.map(|part| (part, cuts + 1)));
            continue;
        }
        let (centre, area) = (middle(&triangle), area(&triangle));
        let [x, y, z] = ((centre - low) / patch)
            .to_array()
            .map(|x| x.clamp(0.0, PATCHES - 0.5) as usize);
        let sum = &mut cells[(x * 3 + y) * 3 + z];
        let more = [area, area * centre.x, area * centre.y, area * centre.z];
        (0..4).for_each(|k| sum[k] += more[k]);
    }
    let filled = cells.iter().filter(|sum| sum[0] > 0.0);
    filled
        .map(|[area, x, y, z]| (DVec3::new(*x, *y, *z) / *area, *area))
        .collect()
}
