//! Meshes as regions, as files have them: triangles without flags, wound either way.
//!
//! Regression: no point was inside of a mesh without the flag `ORIENTED`, and there was no error.

use rapier3d_fields::field::{MeshFault, Query};
use rapier3d_fields::math::{DVec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::parry::shape::TriMeshFlags;
use rapier3d_fields::reference::Reference;

type Mesh = (Vec<Vector>, Vec<[u32; 3]>);

fn cuboid(half: Vector) -> Mesh {
    let shape = SharedShape::cuboid(half.x, half.y, half.z);
    shape.as_cuboid().expect("a cuboid").to_trimesh()
}

/// A torus around the y axis.
fn torus(major: f64, minor: f64, facets: u32) -> Mesh {
    let angle = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(facets);
    let vertex = |i: u32, j: u32| {
        let (around, across) = (angle(i), angle(j));
        let radius = major + minor * across.cos();
        let place = [
            radius * around.cos(),
            minor * across.sin(),
            radius * around.sin(),
        ];
        Vector::from_array(place.map(|x| x as Real))
    };
    let rings = (0..facets).flat_map(|i| (0..facets).map(move |j| [i, j]));
    let vertices = rings.clone().map(|[i, j]| vertex(i, j)).collect();
    let number = |i: u32, j: u32| i % facets * facets + j % facets;
    let quads = rings.flat_map(|[i, j]| {
        let [a, b] = [number(i, j), number(i, j + 1)];
        let [c, d] = [number(i + 1, j), number(i + 1, j + 1)];
        [[a, b, c], [b, d, c]]
    });
    (vertices, quads.collect())
}

fn moved(mesh: &Mesh, by: Vector) -> Mesh {
    (mesh.0.iter().map(|v| *v + by).collect(), mesh.1.clone())
}

fn turned((vertices, triangles): Mesh) -> Mesh {
    let triangles = triangles.into_iter().map(|[a, b, c]| [a, c, b]);
    (vertices, triangles.collect())
}

fn joined(a: &Mesh, b: &Mesh) -> Mesh {
    let shift = a.0.len() as u32;
    let second = b.1.iter().map(|triangle| triangle.map(|v| v + shift));
    let vertices = a.0.iter().chain(&b.0).copied().collect();
    (vertices, a.1.iter().copied().chain(second).collect())
}

/// Each triangle with vertices of its own, as in STL files.
fn soup((vertices, triangles): &Mesh) -> Mesh {
    let corners = triangles.iter().flatten().map(|v| vertices[*v as usize]);
    let corners: Vec<Vector> = corners.collect();
    let count = triangles.len() as u32;
    (
        corners,
        (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(),
    )
}

fn within((vertices, triangles): Mesh) -> Tree {
    let shape = SharedShape::trimesh(vertices, triangles).expect("triangles");
    let field = Field::uniform(Vector::X).named("wind");
    field.within(Region::shape(shape)).into()
}

/// Points of a cube around the origin, the same in every run.
fn points(reach: f64) -> impl Iterator<Item = DVec3> {
    let share = |k: u32, step: f64| (f64::from(k) * step).fract() * 2.0 - 1.0;
    (1..4000).map(move |k| {
        let place = [0.819_172_513, 0.671_043_606, 0.549_700_477];
        DVec3::from_array(place.map(|step| share(k, step) * reach))
    })
}

/// Compares with a signed distance, at points that are not too near the surface.
fn compare(mesh: Mesh, reach: f64, band: f64, distance: impl Fn(DVec3) -> f64) {
    let tree = within(mesh);
    let world = PhysicsWorld::new();
    let reference = Reference::new(&tree).expect("a closed mesh");
    let (mut inside, mut outside) = (0, 0);
    for world_point in points(reach) {
        let distance = distance(world_point);
        if distance.abs() < band {
            continue;
        }
        let query = Query {
            world_point,
            ..Query::default()
        };
        let force = reference.force(&WorldRef::from(&world), &query);
        assert_eq!(force.is_some(), distance < 0.0, "{world_point}: {distance}");
        *(if distance < 0.0 {
            &mut inside
        } else {
            &mut outside
        }) += 1;
    }
    assert!(
        inside > 50 && outside > 50,
        "{inside} inside, {outside} outside"
    );
}

fn from_box(half: Vector, at: Vector) -> impl Fn(DVec3) -> f64 {
    let double = |v: Vector| DVec3::from_array(v.to_array().map(to_f64));
    move |p| ((p - double(at)).abs() - double(half)).max_element()
}

const HALF: Vector = Vector::new(1.0, 0.5, 0.75);

#[test]
fn meshes_of_cuboids_contain_the_points_of_the_cuboid() {
    let mesh = cuboid(HALF);
    for mesh in [
        mesh.clone(),
        soup(&mesh),
        turned(mesh.clone()),
        soup(&turned(mesh)),
    ] {
        let distance = from_box(HALF, Vector::ZERO);
        compare(mesh, 1.5, 1e-4, distance);
    }
}

#[test]
fn meshes_of_tori_contain_the_points_of_the_torus() {
    let (major, minor) = (1.0, 0.4);
    let distance = |p: DVec3| (p.x.hypot(p.z) - major).hypot(p.y) - minor;
    for mesh in [torus(major, minor, 64), turned(torus(major, minor, 64))] {
        // Chords of 64 facets are off by r(1 − cos π/64).
        compare(mesh.clone(), 1.5, 4e-3, distance);
        compare(soup(&mesh), 1.5, 4e-3, distance);
    }
}

/// Two solids, and a solid with a cavity, for either winding of the whole mesh.
#[test]
fn several_closed_surfaces_are_one_solid() {
    let far = Vector::X * 2.5;
    let small = HALF * 0.5;
    let pair = joined(&cuboid(HALF), &moved(&cuboid(HALF), far));
    let hollow = joined(&cuboid(HALF), &turned(cuboid(small)));
    for turn in [false, true] {
        let wound = |mesh: &Mesh| {
            if turn {
                turned(mesh.clone())
            } else {
                mesh.clone()
            }
        };
        let (here, there) = (from_box(HALF, Vector::ZERO), from_box(HALF, far));
        compare(wound(&pair), 3.4, 1e-4, |p| here(p).min(there(p)));
        let inner = from_box(small, Vector::ZERO);
        compare(wound(&hollow), 1.5, 1e-4, |p| here(p).max(-inner(p)));
    }
}

fn fault(mesh: Mesh) -> MeshFault {
    let error = Fields::new(within(mesh)).err().expect("no solid");
    assert!(error.to_string().contains("`wind`"), "{error}");
    match error {
        BuildError::MeshRegion { fault, .. } => fault,
        error => panic!("{error}"),
    }
}

#[test]
fn meshes_that_bound_no_solid_are_refused() {
    let (vertices, mut triangles) = cuboid(HALF);
    let whole = (vertices.clone(), triangles.clone());
    // A triangle is missing: three edges are open.
    let gone = triangles.pop().expect("a triangle");
    let open = fault((vertices.clone(), triangles.clone()));
    let MeshFault::Open { edges: 3, edge } = open else {
        panic!("{open:?}")
    };
    assert!(edge.iter().all(|vertex| gone.contains(vertex)), "{edge:?}");
    assert!(open.to_string().contains("3 of its edges"), "{open}");
    // The triangle is there, but wound the other way.
    let [a, b, c] = gone;
    triangles.push([a, c, b]);
    let against = fault((vertices.clone(), triangles.clone()));
    assert!(
        matches!(against, MeshFault::Winding { edges: 3, .. }),
        "{against:?}"
    );
    // The triangle is there twice, wound both ways.
    triangles.push(gone);
    let crowded = fault((vertices, triangles));
    assert!(
        matches!(
            crowded,
            MeshFault::Crowded {
                edges: 3,
                triangles: 3,
                ..
            }
        ),
        "{crowded:?}"
    );
    // One of two solids inside out; a solid within a solid.
    let far = moved(&turned(cuboid(HALF * 0.5)), Vector::X * 3.0);
    for wrong in [joined(&whole, &far), joined(&whole, &cuboid(HALF * 0.5))] {
        let nested = fault(wrong);
        assert!(matches!(nested, MeshFault::Nesting { .. }), "{nested:?}");
    }
    // Two sides of a triangle enclose nothing.
    let corners = [Vector::ZERO, Vector::X, Vector::Y];
    let flat = fault((corners.to_vec(), vec![[0, 1, 2], [0, 2, 1]]));
    assert_eq!(flat, MeshFault::Flat);
    let far = [Vector::ZERO, Vector::X, Vector::Y * Real::INFINITY];
    let endless = fault((far.to_vec(), vec![[0, 1, 2], [0, 2, 1]]));
    assert_eq!(endless, MeshFault::NotFinite { vertex: 2 });
}

/// A mesh with the flag `ORIENTED` is taken as the user gives it.
#[test]
fn oriented_meshes_are_not_checked() {
    let (vertices, mut triangles) = cuboid(HALF);
    triangles.pop();
    let shape = SharedShape::trimesh_with_flags(vertices, triangles, TriMeshFlags::ORIENTED)
        .expect("a mesh");
    let field = Field::uniform(Vector::X).within(Region::shape(shape));
    assert!(Fields::new(field).is_ok());
}
