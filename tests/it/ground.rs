//! Height fields as regions: the points below them are inside.
//!
//! Regression: no point was inside.

use proptest::prelude::*;
use rapier3d_fields::field::Query;
use rapier3d_fields::math::{DVec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::parry::shape::{HeightField, HeightFieldCellStatus, Triangle};
use rapier3d_fields::rapier::parry::utils::Array2;
use rapier3d_fields::reference::Reference;

/// Heights, sizes, and the status of each cell.
#[derive(Clone, Debug)]
struct Plan {
    /// Cells along z and along x.
    cells: [usize; 2],
    heights: Vec<i32>,
    /// Bits: zigzag, left triangle removed, right triangle removed.
    status: Vec<u8>,
    scale: [i32; 3],
}

impl Plan {
    fn field(&self) -> HeightField {
        let [rows, columns] = self.cells;
        let count = (rows + 1) * (columns + 1);
        let heights = self.heights.iter().cycle().take(count);
        let heights = heights.map(|h| *h as Real).collect();
        let scale = Vector::from_array(self.scale.map(|s| s as Real));
        let mut field = HeightField::new(Array2::new(rows + 1, columns + 1, heights), scale);
        for i in 0..rows {
            for j in 0..columns {
                let bits = self.status[(i + j * rows) % self.status.len()];
                field.set_cell_status(i, j, HeightFieldCellStatus::from_bits_truncate(bits));
            }
        }
        field
    }
}

fn plan(holes: bool) -> impl Strategy<Value = Plan> {
    let bits = if holes { 0..8_u8 } else { 0..2 };
    let cells = proptest::array::uniform2(1..=4_usize);
    let heights = proptest::collection::vec(-3..=3, 7..=25);
    let status = proptest::collection::vec(bits, 1..=16);
    let scale = (1..=6, 1..=3, 1..=6).prop_map(|(x, y, z)| [x, y, z]);
    (cells, heights, status, scale).prop_map(|(cells, heights, status, scale)| Plan {
        cells,
        heights,
        status,
        scale,
    })
}

/// The height of a triangle's plane at the x and z of a point; and the distance of the point inside the triangle, seen
/// from above (negative outside).
fn above(triangle: &Triangle, point: DVec3) -> (f64, f64) {
    let double = |v: Vector| DVec3::from_array(v.to_array().map(to_f64));
    let corners = [triangle.a, triangle.b, triangle.c].map(double);
    let flat = |v: DVec3| DVec3::new(v.x, 0.0, v.z);
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let height = a.y - (normal.x * (point.x - a.x) + normal.z * (point.z - a.z)) / normal.y;
    let turn = normal.y.signum();
    let inside = [(a, b), (b, c), (c, a)].map(|(from, to)| {
        let edge = flat(to - from);
        turn * edge.cross(flat(point - from)).y / edge.length()
    });
    (height, inside.into_iter().fold(f64::INFINITY, f64::min))
}

/// By Parry's own triangles, one by one: whether the point is below one of them, and its least distance, vertically
/// from their surfaces and horizontally from their edges.
fn below_a_triangle(field: &HeightField, point: DVec3) -> (bool, f64) {
    let seen: Vec<(f64, f64)> = field.triangles().map(|t| above(&t, point)).collect();
    let held = seen
        .iter()
        .any(|(height, inside)| *inside >= 0.0 && point.y <= *height);
    let off = |(height, inside): &(f64, f64)| {
        if *inside < -1e-5 {
            f64::INFINITY
        } else {
            (height - point.y).abs()
        }
    };
    let off_surfaces = seen.iter().map(off).fold(f64::INFINITY, f64::min);
    let at_edges = seen.iter().map(|(_, inside)| inside.abs());
    (
        held,
        off_surfaces.min(at_edges.fold(f64::INFINITY, f64::min)),
    )
}

fn holds(region: &Region, points: &[DVec3]) -> Vec<bool> {
    let tree = Field::uniform(Vector::X).within(region.clone()).into();
    let world = PhysicsWorld::new();
    let reference = Reference::new(&tree).expect("a valid region");
    let query = |world_point: &DVec3| Query {
        world_point: *world_point,
        ..Query::default()
    };
    let force = |point| reference.force(&WorldRef::from(&world), &query(point));
    points.iter().map(|point| force(point).is_some()).collect()
}

fn points() -> impl Strategy<Value = Vec<DVec3>> {
    let point = proptest::array::uniform3(-1.0..1.0_f64);
    let point = point.prop_map(|[x, y, z]| DVec3::new(4.0 * x, 12.0 * y, 4.0 * z));
    proptest::collection::vec(point, 64)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    /// With both diagonals, removed triangles, and points outside and deep below.
    #[test]
    fn points_below_a_triangle_are_inside(
        plan in prop_oneof![plan(false), plan(true)], points in points(),
    ) {
        let field = plan.field();
        let region = Region::shape(SharedShape::new(field.clone()));
        for (point, held) in points.iter().zip(holds(&region, &points)) {
            let (expected, off) = below_a_triangle(&field, *point);
            if off > 1e-4 {
                prop_assert_eq!(held, expected, "{} of {:?}", point, plan);
            }
        }
    }

    /// `Scalar::depth` is at most the distance from the border, positive inside and negative outside.
    #[test]
    fn depth_is_no_more_than_the_distance_from_the_border(
        plan in prop_oneof![plan(false), plan(true)], points in points(),
    ) {
        let field = plan.field();
        let region = Region::shape(SharedShape::new(field.clone()));
        let tree: Tree = Field::uniform(Vector::X).scaled_by(Scalar::depth(region.clone())).into();
        let world = PhysicsWorld::new();
        let reference = Reference::new(&tree).expect("a valid region");
        let depth = |world_point: DVec3| {
            let query = Query { world_point, ..Query::default() };
            reference.force(&WorldRef::from(&world), &query).expect("everywhere").x
        };
        for point in points {
            let (held, off) = below_a_triangle(&field, point);
            let here = depth(point);
            if off > 1e-4 {
                prop_assert_eq!(here > 0.0, held, "depth {} at {} of {:?}", here, point, plan);
                // All points nearer than the depth are on the same side.
                for toward in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.6, 0.0, 0.8)] {
                    for way in [toward, -toward] {
                        let near = point + way * here.abs() * 0.999;
                        let (beside, off) = below_a_triangle(&field, near);
                        prop_assert!(
                            off < 1e-4 || beside == held,
                            "depth {here} at {point}, {way}, of {plan:?}"
                        );
                    }
                }
            }
        }
    }
}

fn flat(cells: usize) -> HeightField {
    let heights = Array2::repeat(cells + 1, cells + 1, 1.0 as Real);
    HeightField::new(heights, Vector::new(4.0, 2.0, 4.0))
}

/// Points on a plane at y = 2, four by four in size: on corners and diagonals of its cells, at its rim, and beyond it.
#[test]
fn borders_belong_to_the_ground_and_to_its_complement() {
    let ground = Region::shape(SharedShape::new(flat(4)));
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let on = [
        at(0.0, 2.0, 0.0),
        at(0.5, 2.0, 0.5),
        at(0.25, 2.0, 0.6),
        at(2.0, 2.0, -2.0),
    ];
    let rim = [at(2.0, 1.0, 0.0), at(-2.0, -1e6, 2.0), at(0.3, -5.0, 2.0)];
    let off = [
        at(0.0, 2.0 + 1e-9, 0.0),
        at(2.0 + 1e-9, 0.0, 0.0),
        at(0.0, -9.0, -2.1),
    ];
    let within = [at(0.0, 1.9, 0.0), at(1.0, -1e9, 1.0)];
    let everywhere = |region: &Region, points: &[DVec3], held: bool| {
        assert_eq!(
            holds(region, points),
            vec![held; points.len()],
            "{points:?}"
        );
    };
    for points in [&on[..], &rim, &within] {
        everywhere(&ground, points, true);
    }
    everywhere(&ground, &off, false);
    // Sets are regularised, so borders belong to the complement, too.
    let air = ground.clone().complement();
    for points in [&on[..], &rim, &off] {
        everywhere(&air, points, true);
    }
    everywhere(&air, &within, false);
    // A box that stands on the plane shares only a face with the ground.
    let standing = Region::cuboid(Vector::splat(1.0)).at(Vector::Y * 3.0);
    everywhere(&ground.intersection(standing), &on[..3], false);
}

#[test]
fn nothing_is_below_a_hole() {
    let mut field = flat(4);
    field.set_cell_status(1, 2, HeightFieldCellStatus::CELL_REMOVED);
    let ground = Region::shape(SharedShape::new(field));
    // The removed cell reaches from 0 to 1 along x, and from −1 to 0 along z.
    let at = |x: f64, z: f64| DVec3::new(x, 0.0, z);
    let points = [
        at(0.5, -0.5),
        at(0.01, -0.99),
        at(0.5, 0.01),
        at(-0.01, -0.5),
        at(0.0, -0.5),
    ];
    assert_eq!(holds(&ground, &points), [false, false, true, true, true]);
}

/// The region has no lower bound, so its fields reach bodies at any depth.
#[test]
fn bodies_far_below_are_pushed() {
    let mut world = PhysicsWorld::new();
    let at = |y: Real| RigidBodyBuilder::dynamic().translation(Vector::new(0.3, y, 0.2));
    let bodies = [-1e4, 1.0, 3.0].map(|y| world.insert(at(y), ColliderBuilder::ball(0.1)).0);
    let lift = Field::uniform(Vector::Y).coupled_to(Coupling::Each);
    let lift = lift.within(Region::shape(SharedShape::new(flat(2))));
    // Enough instances for an index.
    let tree = Tree::instances(lift, (0..20).map(|k| Vector::X * (0.1 * k as Real)));
    let fields = Fields::new(tree).expect("a valid region");
    let force = |body| {
        let wrench = fields.sample(body, &world);
        wrench.expect("finite").expect("a dynamic body").force.y
    };
    assert_eq!(bodies.map(force), [20.0, 20.0, 0.0]);
}

#[test]
fn invalid_height_fields_are_refused() {
    let refused = |field: HeightField, part: &str| {
        let region = Region::shape(SharedShape::new(field));
        let field = Field::uniform(Vector::X).within(region).named("hills");
        let error = Fields::new(field).err().expect(part).to_string();
        assert!(error.contains("`hills`") && error.contains(part), "{error}");
    };
    let scaled =
        |x: Real, z: Real| HeightField::new(Array2::repeat(2, 2, 0.0), Vector::new(x, 1.0, z));
    refused(scaled(-1.0, 1.0), "the x scale");
    refused(scaled(1.0, 0.0), "the z scale");
    let heights = Array2::new(2, 2, vec![0.0, Real::NAN, 0.0, 0.0]);
    refused(HeightField::new(heights, Vector::ONE), "a scaled height");
    let part = (Pose::IDENTITY, SharedShape::new(scaled(1.0, 1.0)));
    let region = Region::shape(SharedShape::compound(vec![part]));
    let error = Fields::new(Field::uniform(Vector::X).within(region))
        .err()
        .expect("a compound");
    assert!(
        error.to_string().contains("height fields in the compound"),
        "{error}"
    );
}
