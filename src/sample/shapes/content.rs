//! The geometry of a shape as a list of numbers: shapes with equal lists are sampled alike.

use crate::math::{Pose, Real, SharedShape, Vector, to_f64};
use crate::rapier::parry::shape::{ConvexPolyhedron, Shape, TypedShape};

/// Writes all numbers of a shape's geometry, bit for bit; `None` for shapes of other types.
pub(super) fn of(shape: &SharedShape, words: &mut Vec<u64>) -> Option<()> {
    add(shape.0.as_ref(), words)
}

fn add(shape: &dyn Shape, words: &mut Vec<u64>) -> Option<()> {
    words.push(shape.shape_type() as u64);
    let of_vector = |vector: Vector| vector.to_array();
    match shape.as_typed_shape() {
        TypedShape::Ball(shape) => numbers(words, [shape.radius]),
        TypedShape::Cuboid(shape) => numbers(words, of_vector(shape.half_extents)),
        TypedShape::Capsule(shape) => {
            numbers(words, of_vector(shape.segment.a));
            numbers(words, of_vector(shape.segment.b));
            numbers(words, [shape.radius]);
        }
        TypedShape::Cylinder(shape) => numbers(words, [shape.half_height, shape.radius]),
        TypedShape::Cone(shape) => numbers(words, [shape.half_height, shape.radius]),
        TypedShape::RoundCuboid(shape) => {
            numbers(words, of_vector(shape.inner_shape.half_extents));
            numbers(words, [shape.border_radius]);
        }
        TypedShape::RoundCylinder(shape) => {
            let inner = &shape.inner_shape;
            let all = [inner.half_height, inner.radius, shape.border_radius];
            numbers(words, all);
        }
        TypedShape::RoundCone(shape) => {
            let inner = &shape.inner_shape;
            let all = [inner.half_height, inner.radius, shape.border_radius];
            numbers(words, all);
        }
        TypedShape::ConvexPolyhedron(shape) => add_polyhedron(shape, words),
        TypedShape::RoundConvexPolyhedron(shape) => {
            add_polyhedron(&shape.inner_shape, words);
            numbers(words, [shape.border_radius]);
        }
        TypedShape::TriMesh(shape) => {
            words.push(u64::from(shape.flags().bits()));
            add_points(shape.vertices(), words);
            words.push(shape.indices().len() as u64);
            words.extend(shape.indices().iter().flatten().map(|it| u64::from(*it)));
        }
        TypedShape::Compound(shape) => {
            words.push(shape.shapes().len() as u64);
            for (pose, part) in shape.shapes() {
                add_pose(pose, words);
                add(part.0.as_ref(), words)?;
            }
        }
        _ => return None,
    }
    Some(())
}

fn numbers<const N: usize>(words: &mut Vec<u64>, numbers: [Real; N]) {
    words.extend(numbers.map(|number| to_f64(number).to_bits()));
}

fn add_points(points: &[Vector], words: &mut Vec<u64>) {
    words.push(points.len() as u64);
    points
        .iter()
        .for_each(|point| numbers(words, point.to_array()));
}

fn add_polyhedron(shape: &ConvexPolyhedron, words: &mut Vec<u64>) {
    add_points(shape.points(), words);
    for face in shape.faces() {
        words.push(u64::from(face.num_vertices_or_edges));
    }
    let corners = shape.vertices_adj_to_face();
    words.extend(corners.iter().map(|it| u64::from(*it)));
}

fn add_pose(pose: &Pose, words: &mut Vec<u64>) {
    numbers(words, pose.translation.to_array());
    numbers(words, pose.rotation.to_array());
}
