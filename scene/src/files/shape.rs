//! Shapes of colliders, regions and nearest-point fields.

use serde::{Deserialize, Serialize};

use super::error::{FileError, content};
use super::fields::math::{Real, SharedShape, Vector};
use super::fields::rapier::parry::shape::TypedShape;
use super::number::{Num, Quad, Triple, pose, quad, triple, unless_zero, vector};

/// One of Rapier's shapes. The axis of cylinders and cones is the y axis.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    remote = "Self",
    rename_all = "kebab-case",
    rename_all_fields = "kebab-case",
    deny_unknown_fields
)]
pub(super) enum ShapeDoc {
    Ball {
        radius: Num,
    },
    Cuboid {
        half_extents: Triple,
    },
    Cylinder {
        half_height: Num,
        radius: Num,
    },
    Cone {
        half_height: Num,
        radius: Num,
    },
    /// Around the segment from `from` to `to`.
    Capsule {
        from: Triple,
        to: Triple,
        radius: Num,
    },
    /// The points behind a plane through the origin.
    HalfSpace {
        outward: Triple,
    },
    Segment {
        from: Triple,
        to: Triple,
    },
    Triangle {
        corners: [Triple; 3],
    },
    ConvexHull {
        points: Vec<Triple>,
    },
    /// Triangles, by the numbers of their points. As a region, a mesh must be closed and wound one way, inwards
    /// or outwards; the region is the enclosed volume.
    Mesh {
        points: Vec<Triple>,
        triangles: Vec<[u32; 3]>,
    },
    Compound(Vec<PlacedDoc>),
}

crate::choice::one_of!(ShapeDoc, "shape");

#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct PlacedDoc {
    pub shape: ShapeDoc,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<Triple>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<Quad>,
}

/// Sizes within these bounds have finite volumes and inertias that are not zero.
const SMALLEST: Real = 1e-6;
const LARGEST: Real = 1e6;

fn size(name: &str, value: Num) -> Result<Real, FileError> {
    if (SMALLEST..=LARGEST).contains(&value.0) {
        return Ok(value.0);
    }
    let message = format!(
        "expected a size from {SMALLEST:e} to {LARGEST:e}, found {}",
        value.0
    );
    Err(content(message).within(name))
}

fn place(name: &str, value: Triple) -> Result<Vector, FileError> {
    let v = vector(value);
    if v.abs().max_element() <= LARGEST {
        return Ok(v);
    }
    let message = format!("expected coordinates of at most {LARGEST:e}, found {v}");
    Err(content(message).within(name))
}

fn places(name: &str, values: &[Triple]) -> Result<Vec<Vector>, FileError> {
    let values = values.iter().enumerate();
    values
        .map(|(k, value)| place(&format!("{name}[{k}]"), *value))
        .collect()
}

impl ShapeDoc {
    pub(super) fn read(&self) -> Result<SharedShape, FileError> {
        Ok(match self {
            ShapeDoc::Ball { radius } => SharedShape::ball(size("ball.radius", *radius)?),
            ShapeDoc::Cuboid { half_extents } => {
                let [x, y, z] = half_extents.map(|half| size("cuboid.half-extents", half));
                SharedShape::cuboid(x?, y?, z?)
            }
            ShapeDoc::Cylinder {
                half_height,
                radius,
            } => SharedShape::cylinder(
                size("cylinder.half-height", *half_height)?,
                size("cylinder.radius", *radius)?,
            ),
            ShapeDoc::Cone {
                half_height,
                radius,
            } => SharedShape::cone(
                size("cone.half-height", *half_height)?,
                size("cone.radius", *radius)?,
            ),
            ShapeDoc::Capsule { from, to, radius } => SharedShape::capsule(
                place("capsule.from", *from)?,
                place("capsule.to", *to)?,
                size("capsule.radius", *radius)?,
            ),
            ShapeDoc::HalfSpace { outward } => {
                let outward = vector(*outward);
                let length = outward.length();
                if length.is_nan() || (length - 1.0).abs() > 1e-3 {
                    let message = format!("expected a vector of length one, found {outward}");
                    return Err(content(message).within("half-space.outward"));
                }
                SharedShape::halfspace(outward)
            }
            ShapeDoc::Segment { from, to } => {
                SharedShape::segment(place("segment.from", *from)?, place("segment.to", *to)?)
            }
            ShapeDoc::Triangle { corners } => {
                let [a, b, c] = corners.map(|corner| place("triangle.corners", corner));
                SharedShape::triangle(a?, b?, c?)
            }
            ShapeDoc::ConvexHull { points } => hull(points)?,
            ShapeDoc::Mesh { points, triangles } => mesh(points, triangles)?,
            ShapeDoc::Compound(parts) => compound(parts)?,
        })
    }

    pub(super) fn write(shape: &SharedShape) -> Result<Self, FileError> {
        Ok(match shape.as_typed_shape() {
            TypedShape::Ball(ball) => ShapeDoc::Ball {
                radius: Num(ball.radius),
            },
            TypedShape::Cuboid(cuboid) => ShapeDoc::Cuboid {
                half_extents: triple(cuboid.half_extents),
            },
            TypedShape::Cylinder(cylinder) => ShapeDoc::Cylinder {
                half_height: Num(cylinder.half_height),
                radius: Num(cylinder.radius),
            },
            TypedShape::Cone(cone) => ShapeDoc::Cone {
                half_height: Num(cone.half_height),
                radius: Num(cone.radius),
            },
            TypedShape::Capsule(capsule) => ShapeDoc::Capsule {
                from: triple(capsule.segment.a),
                to: triple(capsule.segment.b),
                radius: Num(capsule.radius),
            },
            TypedShape::HalfSpace(half) => ShapeDoc::HalfSpace {
                outward: triple(half.normal),
            },
            TypedShape::Segment(segment) => ShapeDoc::Segment {
                from: triple(segment.a),
                to: triple(segment.b),
            },
            TypedShape::Triangle(triangle) => ShapeDoc::Triangle {
                corners: [triangle.a, triangle.b, triangle.c].map(triple),
            },
            TypedShape::ConvexPolyhedron(hull) => ShapeDoc::ConvexHull {
                points: hull.points().iter().map(|point| triple(*point)).collect(),
            },
            TypedShape::TriMesh(mesh) => ShapeDoc::Mesh {
                points: mesh.vertices().iter().map(|v| triple(*v)).collect(),
                triangles: mesh.indices().to_vec(),
            },
            TypedShape::Compound(compound) => {
                let parts = compound.shapes().iter().map(|(pose, shape)| {
                    Ok(PlacedDoc {
                        shape: ShapeDoc::write(shape)?,
                        at: unless_zero(pose.translation),
                        rotation: quad(pose.rotation),
                    })
                });
                ShapeDoc::Compound(parts.collect::<Result<_, FileError>>()?)
            }
            _ => {
                let kind = shape.shape_type();
                return Err(content(format!(
                    "shapes of the kind {kind:?} cannot stand in a file"
                )));
            }
        })
    }
}

fn hull(points: &[Triple]) -> Result<SharedShape, FileError> {
    let points = places("convex-hull.points", points)?;
    let flat = || content("expected points with a volume between them").within("convex-hull");
    let hull = (points.len() >= 4).then(|| SharedShape::convex_hull(&points));
    let hull = hull.flatten().ok_or_else(flat)?;
    let volume = hull.mass_properties(1.0).mass();
    if volume > 0.0 && volume.is_finite() {
        return Ok(hull);
    }
    Err(flat())
}

fn mesh(points: &[Triple], triangles: &[[u32; 3]]) -> Result<SharedShape, FileError> {
    let points = places("mesh.points", points)?;
    for (place, triangle) in triangles.iter().enumerate() {
        if let Some(number) = triangle.iter().find(|n| **n as usize >= points.len()) {
            let message = format!("there is no point {number}; there are {}", points.len());
            return Err(content(message).within(&format!("mesh.triangles[{place}]")));
        }
    }
    SharedShape::trimesh(points, triangles.to_vec())
        .map_err(|error| content(error.to_string()).within("mesh"))
}

fn compound(parts: &[PlacedDoc]) -> Result<SharedShape, FileError> {
    let mut shapes = Vec::new();
    for (number, part) in parts.iter().enumerate() {
        let here = |error: FileError| error.within(&format!("compound[{number}]"));
        // Rapier has no compounds of compounds, of meshes, or of unbounded shapes.
        if matches!(
            part.shape,
            ShapeDoc::Compound(_) | ShapeDoc::Mesh { .. } | ShapeDoc::HalfSpace { .. }
        ) {
            let message = "a part of a compound cannot be a compound, a mesh or a half-space";
            return Err(here(content(message).within("shape")));
        }
        let shape = part.shape.read().map_err(|e| here(e.within("shape")))?;
        shapes.push((pose(part.at, part.rotation).map_err(here)?, shape));
    }
    if shapes.is_empty() {
        return Err(content("expected at least one part").within("compound"));
    }
    Ok(SharedShape::compound(shapes))
}
