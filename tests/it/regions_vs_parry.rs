//! Regions of this crate against Parry's shapes: which of thousands of points are inside.
//!
//! Points within `BAND` of the surface, by Parry's own projection, are left out: there the two
//! round differently.

use proptest::prelude::*;
use rapier3d_fields::field::Query;
use rapier3d_fields::math::{Pose, to_dvec3};
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::parry::math::IVector;
use rapier3d_fields::rapier::parry::shape::{HalfSpace, Shape, TriMeshFlags};
use rapier3d_fields::reference::Reference;

use crate::support::cases;

/// Hundreds of roundings at the distances used here, in `f32`.
const BAND: Real = 1e-3;

/// The largest coordinate of points.
const REACH: Real = 4.0;

const POINTS: usize = 64;

fn size() -> impl Strategy<Value = Real> {
    (0.1..2.5_f64).prop_map(|x| x as Real)
}

fn point(reach: Real) -> impl Strategy<Value = Vector> {
    let coordinate = move || (-1.0..1.0_f64).prop_map(move |x| x as Real * reach);
    (coordinate(), coordinate(), coordinate()).prop_map(|(x, y, z)| Vector::new(x, y, z))
}

fn pose() -> impl Strategy<Value = Pose> {
    (point(2.0), point(3.0)).prop_map(|(place, turn)| {
        let mut pose = Pose::from_translation(place);
        pose.rotation = Rotation::from_scaled_axis(turn);
        pose
    })
}

/// The pose of a region in the field's frame, and of the field in the world.
fn placement() -> impl Strategy<Value = (Pose, Pose)> {
    let still = || Just(Pose::IDENTITY);
    (prop_oneof![still(), pose()], prop_oneof![still(), pose()])
}

fn points() -> impl Strategy<Value = Vec<Vector>> {
    proptest::collection::vec(point(REACH), POINTS)
}

/// Compares at points given in the frame of the shape.
fn compare(
    region: Region,
    shape: &dyn Shape,
    (in_field, in_world): (Pose, Pose),
    points: &[Vector],
) -> Result<(), TestCaseError> {
    let tree = Field::uniform(Vector::X)
        .within(region.at(in_field))
        .at(in_world)
        .into();
    let world = PhysicsWorld::new();
    let reference = Reference::new(&tree).expect("a valid region");
    for point in points {
        let projection = shape.project_local_point(*point, false);
        if (projection.point - *point).length() < BAND {
            continue;
        }
        let query = Query {
            world_point: to_dvec3((in_world * in_field).transform_point(*point)),
            ..Query::default()
        };
        let ours = reference.force(&WorldRef::from(&world), &query).is_some();
        let parry = shape.contains_local_point(*point);
        prop_assert_eq!(
            ours,
            parry,
            "{:?} at {} in its frame (ours, Parry's)",
            shape.shape_type(),
            point
        );
    }
    Ok(())
}

/// Compares a shape with its [`Region::shape`].
fn compare_shape(
    shape: SharedShape,
    placement: (Pose, Pose),
    points: &[Vector],
) -> Result<(), TestCaseError> {
    compare(Region::shape(shape.clone()), &*shape.0, placement, points)
}

/// Corners of a solid that is not too flat: an octahedron, and anything added.
fn corners() -> impl Strategy<Value = Vec<Vector>> {
    proptest::collection::vec(point(2.5), 0..12).prop_map(|extra| {
        let octahedron = Vector::AXES.into_iter().flat_map(|axis| [axis, -axis]);
        octahedron.chain(extra).collect()
    })
}

proptest! {
    #![proptest_config(cases(250))]

    #[test]
    fn balls(r in size(), at in placement(), points in points()) {
        compare(Region::ball(r), &*SharedShape::ball(r).0, at, &points)?;
    }

    /// Balls and half-spaces over the axes x, y and z are those in space.
    #[test]
    fn balls_and_half_spaces_over_axes(
        r in size(), toward in point(1.0), offset in -2.0..2.0_f64,
        at in placement(), points in points(),
    ) {
        let ball = Region::ball_over([Axis::X, Axis::Y, Axis::Z].map(|axis| (axis, 0.0, r)));
        compare(ball, &*SharedShape::ball(r).0, at, &points)?;
        prop_assume!(toward.length() > 0.1);
        let (outward, offset) = (toward.normalize(), offset as Real);
        // Twice as steep is the same half-space.
        let steep = outward * 2.0;
        let coefficients = [(Axis::X, steep.x), (Axis::Y, steep.y), (Axis::Z, steep.z)];
        let to_plane = Pose::from_translation(outward * -offset);
        let half_space = Region::half_space_over(coefficients, 2.0 * offset).at(to_plane);
        compare(half_space, &HalfSpace::new(outward), at, &points)?;
    }

    #[test]
    fn cuboids(half in [size(), size(), size()], at in placement(), points in points()) {
        let [x, y, z] = half;
        compare(Region::cuboid(Vector::new(x, y, z)), &*SharedShape::cuboid(x, y, z).0, at, &points)?;
    }

    #[test]
    fn cylinders(h in size(), r in size(), at in placement(), points in points()) {
        compare(Region::cylinder(h, r), &*SharedShape::cylinder(h, r).0, at, &points)?;
    }

    #[test]
    fn cones(h in size(), r in size(), at in placement(), points in points()) {
        compare(Region::cone(h, r), &*SharedShape::cone(h, r).0, at, &points)?;
    }

    #[test]
    fn capsules(h in size(), r in size(), at in placement(), points in points()) {
        compare(Region::capsule(h, r), &*SharedShape::capsule_y(h, r).0, at, &points)?;
    }

    #[test]
    fn half_spaces(toward in point(1.0), offset in -2.0..2.0_f64, at in placement(), points in points()) {
        prop_assume!(toward.length() > 0.1);
        let (outward, offset) = (toward.normalize(), offset as Real);
        let shape = HalfSpace::new(outward);
        // Parry's half-space has its plane through the origin.
        let to_plane = Pose::from_translation(outward * -offset);
        compare(Region::half_space(outward, offset).at(to_plane), &shape, at, &points)?;
    }

    #[test]
    fn primitives_as_shapes(h in size(), r in size(), at in placement(), points in points()) {
        for shape in [
            SharedShape::ball(r), SharedShape::cuboid(h, r, h), SharedShape::cylinder(h, r),
            SharedShape::cone(h, r), SharedShape::capsule_y(h, r),
        ] {
            compare_shape(shape, at, &points)?;
        }
    }

    #[test]
    fn convex_hulls(corners in corners(), at in placement(), points in points()) {
        let Some(shape) = SharedShape::convex_hull(&corners) else {
            return Err(TestCaseError::reject("no hull"));
        };
        compare_shape(shape, at, &points)?;
    }

    /// Parry finds the inside of a mesh by pseudo-normals, if it is flagged as oriented.
    #[test]
    fn meshes(half in [size(), size(), size()], at in placement(), points in points()) {
        let [x, y, z] = half;
        let cuboid = SharedShape::cuboid(x, y, z);
        let (vertices, indices) = cuboid.as_cuboid().expect("a cuboid").to_trimesh();
        let flags = TriMeshFlags::ORIENTED;
        let plain = SharedShape::trimesh(vertices.clone(), indices.clone()).expect("a closed mesh");
        let shape = SharedShape::trimesh_with_flags(vertices, indices, flags).expect("a closed mesh");
        compare_shape(shape.clone(), at, &points)?;
        compare(Region::shape(plain), &*shape.0, at, &points)?;
        // The mesh and the box it was made from hold the same points.
        compare(Region::cuboid(Vector::new(x, y, z)), &*shape.0, at, &points)?;
    }

    #[test]
    fn voxels(cells in proptest::collection::vec(proptest::array::uniform3(-1..=1_i32), 1..9),
        at in placement(), points in points()) {
        let cells: Vec<_> = cells.into_iter().map(|[x, y, z]| IVector::new(x as _, y as _, z as _)).collect();
        compare_shape(SharedShape::voxels(Vector::splat(1.3), &cells), at, &points)?;
    }

    #[test]
    fn compounds(r in size(), h in size(), apart in 0.0..3.0_f64, at in placement(), points in points()) {
        let shift = |x: Real| Pose::from_translation(Vector::X * x);
        let apart = apart as Real;
        let shape = SharedShape::compound(vec![
            (shift(-apart), SharedShape::ball(r)),
            (shift(apart), SharedShape::cuboid(h, r, h)),
        ]);
        let region = Region::ball(r).at(shift(-apart))
            .union(Region::cuboid(Vector::new(h, r, h)).at(shift(apart)));
        for point in &points {
            // Points near the surface of either part are skipped by hand, since Parry projects on one of the parts.
            let near = [(-apart, SharedShape::ball(r)), (apart, SharedShape::cuboid(h, r, h))]
                .into_iter()
                .any(|(x, part)| {
                    let local = *point - Vector::X * x;
                    (part.project_local_point(local, false).point - local).length() < BAND
                });
            if !near {
                compare(region.clone(), &*shape.0, at, &[*point])?;
                compare_shape(shape.clone(), at, &[*point])?;
            }
        }
    }
}

/// Regression: fields within surfaces and lines were accepted and acted nowhere, since these have no interior. They are
/// refused, and so are compounds with such a part.
#[test]
fn surfaces_and_lines_are_refused() {
    let corners = [[-1, -1], [1, -1], [1, 1]].map(|[x, z]| Vector::new(x as Real, 0.0, z as Real));
    let triangle = SharedShape::triangle(corners[0], corners[1], corners[2]);
    let line = SharedShape::polyline(corners.to_vec(), None);
    let segment = SharedShape::segment(corners[0], corners[1]);
    let part = |shape: &SharedShape| (Pose::IDENTITY, shape.clone());
    let mixed = SharedShape::compound(vec![part(&SharedShape::ball(0.5)), part(&triangle)]);
    let shapes = [
        (triangle, "triangle"),
        (line, "polyline"),
        (segment, "segment"),
        (mixed, "triangle"),
    ];
    for (shape, kind) in shapes {
        let region = Region::ball(3.0).difference(Region::shape(shape).at(Vector::X));
        let field = Field::uniform(Vector::X).within(region).named("sheet");
        match Fields::new(field).err() {
            Some(BuildError::FlatRegion { field, shape, .. }) => {
                assert_eq!((field.to_string().as_str(), shape), ("field `sheet`", kind));
            }
            other => panic!("{kind}: {other:?}"),
        }
    }
}

#[test]
fn shapes_of_solids_become_the_regions_of_their_names() {
    let pairs = [
        (SharedShape::ball(1.5), Region::ball(1.5)),
        (
            SharedShape::cuboid(1.0, 2.0, 3.0),
            Region::cuboid(Vector::new(1.0, 2.0, 3.0)),
        ),
        (SharedShape::cylinder(1.0, 0.5), Region::cylinder(1.0, 0.5)),
        (SharedShape::cone(1.0, 0.5), Region::cone(1.0, 0.5)),
        (SharedShape::capsule_y(1.0, 0.5), Region::capsule(1.0, 0.5)),
        (
            SharedShape::halfspace(Vector::Y),
            Region::half_space(Vector::Y, 0.0),
        ),
    ];
    for (shape, region) in pairs {
        assert_eq!(Region::shape(shape), region);
    }
    let lying = SharedShape::capsule_x(1.0, 0.5);
    assert_ne!(Region::shape(lying), Region::capsule(1.0, 0.5));
    let aside = SharedShape::capsule(Vector::ZERO, Vector::Y, 0.5);
    assert_ne!(Region::shape(aside), Region::capsule(0.5, 0.5));
}
