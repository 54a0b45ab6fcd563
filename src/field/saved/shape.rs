//! Parry's shapes as data, checked on reading.
//!
//! Simple shapes are saved as Parry saves them. Of meshes and compounds only the parts are saved; the rest
//! (bounding volumes, topology, normals) is made again on reading. Parry trusts the data that it reads, so an
//! index out of range would end in a panic, and compounds within compounds in a stack overflow.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::field::any_shape::AnyShape;
use crate::math::{Pose, Real, SharedShape, Vector};
use crate::rapier::parry::shape::{
    Ball, Capsule, Cone, Cuboid, Cylinder, HalfSpace, HeightField, HeightFieldCellStatus,
    HeightFieldFlags, RoundCone, RoundCuboid, RoundCylinder, Segment, Shape, TriMeshFlags,
    Triangle, TypedShape,
};
use crate::rapier::parry::utils::Array2;

#[derive(Serialize, Deserialize)]
enum SavedShape {
    One(Simple),
    Compound(Vec<(Pose, Simple)>),
    Mesh {
        vertices: Vec<Vector>,
        indices: Vec<[u32; 3]>,
        flags: u16,
    },
    Polyline {
        vertices: Vec<Vector>,
        indices: Vec<[u32; 2]>,
    },
    HeightField {
        /// The number of heights along z.
        rows: usize,
        heights: Vec<Real>,
        /// The status of each cell, in Parry's order.
        status: Vec<u8>,
        scale: Vector,
        flags: u8,
    },
}

/// Shapes without parts.
#[derive(Serialize, Deserialize)]
enum Simple {
    Ball(Ball),
    Cuboid(Cuboid),
    Capsule(Capsule),
    Segment(Segment),
    Triangle(Triangle),
    HalfSpace(HalfSpace),
    Cylinder(Cylinder),
    Cone(Cone),
    RoundCuboid(RoundCuboid),
    RoundCylinder(RoundCylinder),
    RoundCone(RoundCone),
    Hull(Vec<Vector>),
}

impl Simple {
    fn of(shape: &SharedShape) -> Result<Self, String> {
        Ok(match shape.as_typed_shape() {
            TypedShape::Ball(shape) => Simple::Ball(*shape),
            TypedShape::Cuboid(shape) => Simple::Cuboid(*shape),
            TypedShape::Capsule(shape) => Simple::Capsule(*shape),
            TypedShape::Segment(shape) => Simple::Segment(*shape),
            TypedShape::Triangle(shape) => Simple::Triangle(*shape),
            TypedShape::HalfSpace(shape) => Simple::HalfSpace(*shape),
            TypedShape::Cylinder(shape) => Simple::Cylinder(*shape),
            TypedShape::Cone(shape) => Simple::Cone(*shape),
            TypedShape::RoundCuboid(shape) => Simple::RoundCuboid(*shape),
            TypedShape::RoundCylinder(shape) => Simple::RoundCylinder(*shape),
            TypedShape::RoundCone(shape) => Simple::RoundCone(*shape),
            TypedShape::ConvexPolyhedron(hull) => Simple::Hull(hull.points().to_vec()),
            _ => {
                let kind = shape.shape_type();
                return Err(format!("a shape of the kind {kind:?} cannot be saved"));
            }
        })
    }

    fn shape(self) -> Result<SharedShape, String> {
        match self {
            Simple::Ball(shape) => bounded(shape),
            Simple::Cuboid(shape) => bounded(shape),
            Simple::Capsule(shape) => bounded(shape),
            Simple::Segment(shape) => bounded(shape),
            Simple::Triangle(shape) => bounded(shape),
            Simple::Cylinder(shape) => bounded(shape),
            Simple::Cone(shape) => bounded(shape),
            Simple::RoundCuboid(shape) => round(shape.border_radius, shape),
            Simple::RoundCylinder(shape) => round(shape.border_radius, shape),
            Simple::RoundCone(shape) => round(shape.border_radius, shape),
            Simple::HalfSpace(shape) if (shape.normal.length() - 1.0).abs() <= 1e-3 => {
                Ok(SharedShape::new(shape))
            }
            Simple::HalfSpace(_) => Err("the normal of a half-space must be of length one".into()),
            Simple::Hull(points) => hull(&points),
        }
    }
}

fn bounded(shape: impl Shape) -> Result<SharedShape, String> {
    let bounds = shape.compute_local_aabb();
    let extents = bounds.half_extents();
    if extents.is_finite() && bounds.center().is_finite() && extents.min_element() >= 0.0 {
        return Ok(SharedShape::new(shape));
    }
    Err("a shape must be finite, and its sizes not negative".into())
}

/// Parry panics at a negative border.
fn round(border: Real, shape: impl Shape) -> Result<SharedShape, String> {
    if border >= 0.0 {
        return bounded(shape);
    }
    Err("the border of a round shape must not be negative".into())
}

fn hull(points: &[Vector]) -> Result<SharedShape, String> {
    let fits = points.len() >= 4 && points.iter().all(|point| point.is_finite());
    let hull = fits.then(|| SharedShape::convex_hull(points)).flatten();
    let has_volume = |hull: &SharedShape| {
        let volume = hull.mass_properties(1.0).mass();
        volume > 0.0 && volume.is_finite()
    };
    let hull = hull.filter(has_volume);
    hull.ok_or_else(|| "a convex hull needs finite points with a volume between them".into())
}

fn check_indices<const N: usize>(vertices: &[Vector], indices: &[[u32; N]]) -> Result<(), String> {
    if indices.is_empty() || !vertices.iter().all(|vertex| vertex.is_finite()) {
        return Err("a mesh needs triangles, or segments, of finite vertices".into());
    }
    let missing = |index: &&u32| **index as usize >= vertices.len();
    match indices.iter().flatten().find(missing) {
        Some(index) => Err(format!("a mesh has no vertex {index}")),
        None => Ok(()),
    }
}

fn height_field(rows: usize, heights: Vec<Real>, scale: Vector) -> Result<HeightField, String> {
    let columns = heights.len().checked_div(rows).unwrap_or(0);
    if rows < 2 || columns < 2 || rows * columns != heights.len() {
        return Err("a height field needs two rows and two columns at least, all full".into());
    }
    let scaled = heights.iter().map(|height| height * scale.y);
    if !scale.is_finite() || !scaled.into_iter().all(Real::is_finite) {
        return Err("the heights and the scale of a height field must be finite".into());
    }
    Ok(HeightField::new(Array2::new(rows, columns, heights), scale))
}

impl SavedShape {
    fn of(shape: &SharedShape) -> Result<Self, String> {
        Ok(match shape.as_typed_shape() {
            TypedShape::TriMesh(mesh) => SavedShape::Mesh {
                vertices: mesh.vertices().to_vec(),
                indices: mesh.indices().to_vec(),
                flags: mesh.flags().bits(),
            },
            TypedShape::Polyline(line) => SavedShape::Polyline {
                vertices: line.vertices().to_vec(),
                indices: line.indices().to_vec(),
            },
            TypedShape::HeightField(field) => SavedShape::HeightField {
                rows: field.heights().nrows(),
                heights: field.heights().data().to_vec(),
                status: field
                    .cells_statuses()
                    .data()
                    .iter()
                    .map(|s| s.bits())
                    .collect(),
                scale: field.scale(),
                flags: field.flags().bits(),
            },
            TypedShape::Compound(compound) => {
                let parts = compound.shapes().iter();
                let parts = parts.map(|(pose, shape)| Ok((*pose, Simple::of(shape)?)));
                SavedShape::Compound(parts.collect::<Result<_, String>>()?)
            }
            _ => SavedShape::One(Simple::of(shape)?),
        })
    }

    fn shape(self) -> Result<SharedShape, String> {
        match self {
            SavedShape::One(simple) => simple.shape(),
            SavedShape::Mesh {
                vertices,
                indices,
                flags,
            } => {
                check_indices(&vertices, &indices)?;
                let flags = TriMeshFlags::from_bits_truncate(flags);
                let mesh = SharedShape::trimesh_with_flags(vertices, indices, flags);
                mesh.map_err(|error| error.to_string())
            }
            SavedShape::Polyline { vertices, indices } => {
                check_indices(&vertices, &indices)?;
                Ok(SharedShape::polyline(vertices, Some(indices)))
            }
            SavedShape::HeightField {
                rows,
                heights,
                status,
                scale,
                flags,
            } => {
                let mut field = height_field(rows, heights, scale)?;
                let cells = field.cells_statuses_mut().data_mut();
                if cells.len() != status.len() {
                    return Err("a height field needs a status for each cell".into());
                }
                for (cell, bits) in cells.iter_mut().zip(status) {
                    *cell = HeightFieldCellStatus::from_bits_truncate(bits);
                }
                field.set_flags(HeightFieldFlags::from_bits_truncate(flags));
                Ok(SharedShape::new(field))
            }
            SavedShape::Compound(parts) => {
                let mut shapes = Vec::new();
                for (pose, part) in parts {
                    let length = pose.rotation.length();
                    let rigid = pose.is_finite() && (length - 1.0).abs() <= 1e-3;
                    if !rigid || matches!(part, Simple::HalfSpace(_)) {
                        return Err("a part of a compound needs a pose and a size".into());
                    }
                    shapes.push((pose, part.shape()?));
                }
                if shapes.is_empty() {
                    return Err("a compound needs a part".into());
                }
                Ok(SharedShape::compound(shapes))
            }
        }
    }
}

impl Serialize for AnyShape {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let saved = SavedShape::of(&self.0).map_err(serde::ser::Error::custom)?;
        saved.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for AnyShape {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let saved = SavedShape::deserialize(deserializer)?;
        saved
            .shape()
            .map(AnyShape)
            .map_err(serde::de::Error::custom)
    }
}
