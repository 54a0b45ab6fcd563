//! Every shape on every floor.

use rapier3d_fields::contact::Capability;

use super::*;

/// Shapes with half extents of about half a unit.
fn shapes() -> Vec<(&'static str, SharedShape)> {
    let [a, b, c, d] = [
        Vector::new(0.5, -0.35, 0.5),
        Vector::new(-0.5, -0.35, 0.5),
        Vector::new(0.0, -0.35, -0.5),
        Vector::new(0.0, 0.45, 0.0),
    ];
    let hull = [a, b, c, d];
    let flat = [a, b, c].map(|it| it - (a + b + c) / 3.0);
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let halves = [-0.3, 0.3].map(|x| {
        let pose = Pose::from_translation(Vector::X * x);
        (pose, SharedShape::cuboid(0.2, 0.3, 0.3))
    });
    let corners: Vec<Vector> = (0..8_u8)
        .map(|k| Vector::new(corner(k, 1), corner(k, 2), corner(k, 4)))
        .collect();
    vec![
        ("ball", SharedShape::ball(0.4)),
        ("cuboid", SharedShape::cuboid(0.4, 0.3, 0.5)),
        (
            "round cuboid",
            SharedShape::round_cuboid(0.3, 0.2, 0.4, 0.1),
        ),
        ("capsule", SharedShape::capsule_x(0.3, 0.25)),
        ("cylinder", SharedShape::cylinder(0.3, 0.4)),
        ("round cylinder", SharedShape::round_cylinder(0.2, 0.3, 0.1)),
        ("cone", SharedShape::cone(0.4, 0.4)),
        ("hull", SharedShape::convex_hull(&hull).expect("a hull")),
        ("compound", SharedShape::compound(halves.to_vec())),
        (
            "box of hull",
            SharedShape::convex_hull(&corners).expect("a hull"),
        ),
        ("round cone", SharedShape::round_cone(0.3, 0.3, 0.1)),
        (
            "voxels",
            SharedShape::voxels_from_points(
                Vector::splat(0.3),
                &[-Vector::X * 0.2, Vector::X * 0.2],
            ),
        ),
        (
            "mesh",
            SharedShape::trimesh(hull.to_vec(), faces.to_vec()).expect("a mesh"),
        ),
        ("triangle", SharedShape::triangle(flat[0], flat[1], flat[2])),
        (
            "segment",
            SharedShape::segment(-Vector::X * 0.4, Vector::X * 0.4),
        ),
    ]
}

fn corner(number: u8, bit: u8) -> Real {
    if number & bit == 0 { -0.35 } else { 0.35 }
}

/// Floors whose upper side is at height zero. None is of voxels: with a ball on one Rapier's own step panics.
fn floors() -> Vec<(&'static str, SharedShape, Pose)> {
    let at = |x: f64, y: f64| Pose::from_translation(Vector::new(from_f64(x), from_f64(y), 0.0));
    let wide = |y: Real| {
        let corners = [(-20.0, -20.0), (-20.0, 20.0), (20.0, 20.0), (20.0, -20.0)];
        corners.map(|(x, z)| Vector::new(x, y, z))
    };
    let mesh = SharedShape::trimesh(wide(0.0).to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
    let heights = rapier3d_fields::rapier::parry::utils::Array2::zeros(5, 5);
    let slab: Vec<Vector> = wide(0.0).into_iter().chain(wide(-1.0)).collect();
    let pieces = vec![
        (at(-10.0, -0.5), SharedShape::cuboid(10.0, 0.5, 20.0)),
        (at(10.0, -0.5), SharedShape::cuboid(10.0, 0.5, 20.0)),
    ];
    vec![
        (
            "half-space",
            SharedShape::halfspace(Vector::Y),
            at(0.0, 0.0),
        ),
        ("slab", SharedShape::cuboid(20.0, 0.5, 20.0), at(0.0, -0.5)),
        (
            "hull",
            SharedShape::convex_hull(&slab).expect("a slab"),
            at(0.0, 0.0),
        ),
        ("mesh", mesh.expect("a mesh"), at(0.0, 0.0)),
        (
            "height field",
            SharedShape::heightfield(heights, Vector::splat(40.0)),
            at(0.0, 0.0),
        ),
        ("compound", SharedShape::compound(pieces), at(0.0, 0.0)),
    ]
}

/// Of all shapes on a floor, those that fall through, rest elsewhere than with Rapier alone, or stay awake.
fn wrong(floor: usize, stuff: Stuff) -> Vec<String> {
    let mut wrong = Vec::new();
    let scene = |shape: &SharedShape| {
        let mut scene = Scene::new(stuff, 60);
        let (_, floor, pose) = floors().swap_remove(floor);
        scene.fixed(ColliderBuilder::new(floor).position(pose));
        let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.3, 0.8, 0.2));
        // A shape without volume has no mass of its own.
        let (density, flat) = (
            shape.mass_properties(1.0),
            MassProperties::new(Vector::ZERO, 0.2, Vector::splat(0.02)),
        );
        let mass = if density.inv_mass > 0.0 {
            density
        } else {
            flat
        };
        let collider = ColliderBuilder::new(shape.clone()).mass_properties(mass);
        scene.add(body, collider);
        scene
    };
    for (name, shape) in shapes() {
        let floor_kind = floors()[floor].1.shape_type();
        if Capability::of(shape.shape_type(), floor_kind) == Capability::None {
            continue;
        }
        let theirs = run(scene(&shape), Way::Rapier, 10.0);
        let rests = theirs.asleep_at.is_some();
        for way in [Way::Both, Way::Discrete, Way::Swept] {
            let ours = run(scene(&shape), way, 10.0);
            let [place, other] = [&ours, &theirs].map(|end| end.scene.places()[0]);
            let what = format!("{name} on {}, {way:?}, {stuff:?}", floors()[floor].0);
            // Flat shapes, and voxels by their corner, lie at height zero; Rapier itself loses flat shapes on thin
            // floors.
            let lies_low = shape.compute_local_aabb().mins.y > -0.05;
            let is_flat = shape.mass_properties(1.0).inv_mass == 0.0;
            let low = if lies_low { -0.1 } else { 0.1 };
            if place.y < low && (other.y > low || !is_flat) {
                wrong.push(format!("{what}: through the floor, at {place}"));
            } else if rests && (place.y - other.y).abs() > 0.01 && stuff.restitution == 0.0 {
                wrong.push(format!("{what}: at {place}, Rapier's at {other}"));
            }
            // With two answers to a rebound a round shape may roll on, as it may by chance with Rapier alone.
            let is_to_sleep = stuff.friction > 0.0 && way != Way::Both;
            if rests && is_to_sleep && ours.asleep_at.is_none() {
                wrong.push(format!("{what}: awake at {place}"));
            }
        }
    }
    wrong
}

fn all_right(floor: usize) {
    let stuffs = [(0.0, 0.0), (0.0, 0.5), (0.5, 0.0), (0.5, 0.5)];
    let stuffs = stuffs.map(|(restitution, friction)| Stuff {
        restitution,
        friction,
    });
    let wrong: Vec<String> = stuffs
        .into_iter()
        .flat_map(|stuff| wrong(floor, stuff))
        .collect();
    assert!(
        wrong.is_empty(),
        "{} wrong:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}

#[test]
fn all_shapes_rest_on_a_half_space() {
    all_right(0);
}

#[test]
fn all_shapes_rest_on_a_slab() {
    all_right(1);
}

#[test]
fn all_shapes_rest_on_a_hull() {
    all_right(2);
}

#[test]
fn all_shapes_rest_on_a_mesh() {
    all_right(3);
}

#[test]
fn all_shapes_rest_on_a_height_field() {
    all_right(4);
}

#[test]
fn all_shapes_rest_on_a_compound() {
    all_right(5);
}
