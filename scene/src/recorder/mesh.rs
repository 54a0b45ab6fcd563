//! Shapes as balls, triangles and lines.

use std::collections::HashMap;

use super::super::fields::math::{DVec3, Vector, to_dvec3};
use super::super::fields::rapier::parry::shape::{Shape, TypedShape};
use super::super::fields::rapier::parry::transformation::try_convex_hull;
use super::bodies::radius_of_ball;
use super::bounds::{Bounds, Part};
use super::frames::{Counts, four_digits};
use crate::page::DrawnShape;

/// The number of segments of a circle.
const ROUND: u32 = 20;

/// Corners of a mesh are rounded to its size divided by this.
const FINE: f64 = 1e3;

/// An edge is a crease if the cosine between the normals of its faces is below this: 25 degrees.
const CREASE: f64 = 0.906;

/// Points, and the triangles or lines between them.
struct Mesh {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Only for shapes without triangles.
    lines: Vec<[u32; 2]>,
    is_convex: bool,
}

impl Mesh {
    fn new(points: &[Vector], triangles: Vec<[u32; 3]>) -> Self {
        Mesh {
            points: points.iter().map(|it| to_dvec3(*it)).collect(),
            triangles,
            lines: Vec::new(),
            is_convex: false,
        }
    }

    fn lines(points: &[Vector], lines: Vec<[u32; 2]>) -> Self {
        Mesh {
            lines,
            ..Mesh::new(points, Vec::new())
        }
    }
}

/// The shape of a part as it is drawn.
pub(super) fn drawn(part: &Part, bounds: &Bounds, counts: &Counts) -> DrawnShape {
    match radius_of_ball(part) {
        Some(radius) => DrawnShape::Ball {
            radius: counts.fine(radius),
        },
        None => mesh(part, bounds).drawn(counts),
    }
}

fn mesh(part: &Part, bounds: &Bounds) -> Mesh {
    match part.shape.as_typed_shape() {
        TypedShape::Segment(it) => Mesh::lines(&[it.a, it.b], vec![[0, 1]]),
        TypedShape::Polyline(it) => Mesh::lines(it.vertices(), it.indices().to_vec()),
        TypedShape::Triangle(it) => Mesh::new(&[it.a, it.b, it.c], vec![[0, 1, 2]]),
        TypedShape::TriMesh(it) => Mesh::new(it.vertices(), it.indices().to_vec()),
        TypedShape::HeightField(it) => {
            let (points, triangles) = it.to_trimesh();
            Mesh::new(&points, triangles)
        }
        TypedShape::Voxels(it) => {
            let (points, triangles) = it.to_trimesh();
            Mesh::new(&points, triangles)
        }
        TypedShape::HalfSpace(it) => patch(part, to_dvec3(it.normal), bounds),
        _ => {
            let (points, triangles) = hull(&*part.shape.0);
            Mesh {
                is_convex: true,
                ..Mesh::new(&points, triangles)
            }
        }
    }
}

/// The points and triangles of a convex shape.
fn hull(shape: &dyn Shape) -> (Vec<Vector>, Vec<[u32; 3]>) {
    match shape.as_typed_shape() {
        TypedShape::Cuboid(it) => it.to_trimesh(),
        TypedShape::Capsule(it) => it.to_trimesh(ROUND, ROUND / 2),
        TypedShape::Cylinder(it) => it.to_trimesh(ROUND),
        TypedShape::Cone(it) => it.to_trimesh(ROUND),
        TypedShape::ConvexPolyhedron(it) => it.to_trimesh(),
        // Rounded shapes and custom shapes.
        _ => outermost(shape).unwrap_or_else(|| shape.compute_local_aabb().to_trimesh()),
    }
}

/// A square of the plane of a half-space, as large as the box that is shown and near its centre.
fn patch(part: &Part, outward: DVec3, bounds: &Bounds) -> Mesh {
    let center = part.first.inverse() * bounds.center;
    let foot = center - outward * outward.dot(center);
    let (u, v) = outward.any_orthonormal_pair();
    let reach = bounds.half.length();
    let corners = [-u - v, u - v, u + v, v - u].map(|it| foot + it * reach);
    Mesh {
        points: corners.into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        lines: Vec::new(),
        is_convex: false,
    }
}

/// The hull of a shape's support points in many directions, if the shape has a support map.
fn outermost(shape: &dyn Shape) -> Option<(Vec<Vector>, Vec<[u32; 3]>)> {
    let map = shape.as_support_map()?;
    let points = directions().map(|direction| map.local_support_point(direction));
    try_convex_hull(&points.collect::<Vec<Vector>>()).ok()
}

/// Unit vectors in all directions: a grid on the faces of a cube.
fn directions() -> impl Iterator<Item = Vector> {
    const SIDE: i32 = 4;
    let steps = || -SIDE..=SIDE;
    let all = steps().flat_map(move |x| steps().flat_map(move |y| steps().map(move |z| [x, y, z])));
    let outer = all.filter(|it| it.iter().any(|c| c.abs() == SIDE));
    outer.map(|[x, y, z]| Vector::new(x as _, y as _, z as _).normalize())
}

impl Mesh {
    /// The mesh in the form of a page. Corners that round to the same point are merged.
    fn drawn(&self, counts: &Counts) -> DrawnShape {
        let size = self.points.iter().map(|it| it.abs().max_element());
        let size = size.fold(f64::MIN_POSITIVE, f64::max);
        let fine = size / FINE;
        let mut known = HashMap::new();
        let mut points = Vec::new();
        let mut number_of = |point: &DVec3| {
            let key = (*point / fine).to_array().map(|it| it.round() as i64);
            *known.entry(key).or_insert_with(|| {
                points.extend(key);
                points.len() as u32 / 3 - 1
            })
        };
        let numbers: Vec<u32> = self.points.iter().map(&mut number_of).collect();
        let scale = four_digits(counts.length(fine));
        if !self.lines.is_empty() {
            let lines = self.lines.iter().flatten();
            let lines = lines.map(|it| numbers[*it as usize]).collect();
            return DrawnShape::Lines {
                scale,
                points,
                lines,
            };
        }
        let triangles = self.triangles.iter();
        let triangles = triangles.map(|it| it.map(|corner| numbers[corner as usize]));
        let triangles: Vec<[u32; 3]> = triangles
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect();
        let faces = with_creases(&points, &triangles);
        DrawnShape::Mesh {
            scale,
            points,
            faces,
            convex: self.is_convex,
        }
    }
}

/// Four numbers of each triangle: its corners, and the bits of the edges that are creases.
fn with_creases(points: &[i64], triangles: &[[u32; 3]]) -> Vec<u32> {
    let point = |number: u32| {
        let at = 3 * number as usize;
        DVec3::new(
            points[at] as f64,
            points[at + 1] as f64,
            points[at + 2] as f64,
        )
    };
    let normal = |[a, b, c]: [u32; 3]| {
        let cross = (point(b) - point(a)).cross(point(c) - point(a));
        cross.normalize_or_zero()
    };
    let mut beside: HashMap<[u32; 2], Vec<DVec3>> = HashMap::new();
    for triangle in triangles {
        for edge in edges(*triangle) {
            beside.entry(edge).or_default().push(normal(*triangle));
        }
    }
    let is_crease = |edge: [u32; 2]| match &beside[&edge][..] {
        [one, other] => one.dot(*other).abs() < CREASE,
        _ => true,
    };
    let faces = triangles.iter().flat_map(|triangle| {
        let bits = edges(*triangle).map(is_crease);
        let mask = bits
            .iter()
            .rev()
            .fold(0, |mask, bit| mask << 1 | u32::from(*bit));
        triangle.iter().copied().chain([mask])
    });
    faces.collect()
}

/// The edges of a triangle, each from the lower to the higher number.
fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)])
}
