//! Closed triangle meshes of shapes, for cutting bodies at borders.

use super::moments::{Moments, outer};
use super::surface::add_triangles;
use crate::math::{DMat3, DVec3, Pose, SharedShape, to_dpose3};
use crate::rapier::parry::shape::TypedShape;
use crate::sample::clip::{Content, Triangle, content};
use crate::sample::part_shape::Mesh;

/// Facets around round shapes. Corners stand out by half a percent.
const FACETS: u32 = 24;

/// Bound of the rounding of the areas of closed meshes in `f32`, as a share of the area.
const ROUNDING: f64 = 1e-4;

/// The surface of a shape; `None` if it has no mesh, or the mesh is not closed.
///
/// Flat faces are taken as they are. The mesh of a round shape gets the shape's moments up to the second, so
/// that it is partly outside and partly inside of the shape.
pub(super) fn of(shape: &SharedShape) -> Option<Mesh> {
    let mut triangles = Vec::new();
    add(shape, &mut triangles)?;
    let content = content(&triangles);
    let Content { volume, centre } = content;
    let sound = volume.abs() > 0.0 && volume.is_finite() && centre.is_finite();
    (sound && is_closed(&triangles)).then(|| Mesh::new(triangles, content))
}

fn add(shape: &SharedShape, triangles: &mut Vec<Triangle>) -> Option<()> {
    if let Some(compound) = shape.as_compound() {
        for (local_pose, part) in compound.shapes() {
            let start = triangles.len();
            add(part, triangles)?;
            let pose = to_dpose3(local_pose);
            let added = triangles[start..].iter_mut();
            added.for_each(|triangle| *triangle = triangle.map(|p| pose.transform_point(p)));
        }
        return Some(());
    }
    let start = triangles.len();
    add_triangles(shape, &Pose::IDENTITY, FACETS, triangles);
    if has_flat_faces(shape) {
        return Some(());
    }
    let added = &mut triangles[start..];
    let (wanted, have) = (Moments::of(shape)?, moments(added));
    let map = have.map_onto(&wanted)?;
    let moved = |corner: DVec3| wanted.centre + map * (corner - have.centre);
    added
        .iter_mut()
        .for_each(|triangle| *triangle = triangle.map(moved));
    Some(())
}

fn has_flat_faces(shape: &SharedShape) -> bool {
    matches!(
        shape.as_typed_shape(),
        TypedShape::Cuboid(_)
            | TypedShape::ConvexPolyhedron(_)
            | TypedShape::TriMesh(_)
            | TypedShape::Voxels(_)
    )
}

/// Moments of the volume that triangles enclose, as a sum over the tetrahedra that the triangles form with its centre:
/// ∫ x xᵀ = V/20 (Σ v vᵀ + (Σ v)(Σ v)ᵀ) for a tetrahedron of volume V with corners v.
fn moments(triangles: &[Triangle]) -> Moments {
    let Content { volume, centre } = content(triangles);
    let mut second = DMat3::ZERO;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| corner - centre);
        let volume = a.dot(b.cross(c)) / 6.0;
        let corners = outer(a) + outer(b) + outer(c) + outer(a + b + c);
        second += corners * (volume / 20.0);
    }
    Moments {
        measure: volume,
        centre,
        second: second * volume.recip(),
    }
}

/// Returns true if the area vectors add up to zero, to rounding, as those of a closed surface do.
fn is_closed(triangles: &[Triangle]) -> bool {
    let areas = triangles.iter().map(|[a, b, c]| (b - a).cross(c - a));
    let (sum, size) = areas.fold((DVec3::ZERO, 0.0), |(sum, size), area| {
        (sum + area, size + area.length())
    });
    sum.length() <= size * ROUNDING
}
