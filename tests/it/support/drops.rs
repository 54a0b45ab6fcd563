//! Bodies dropped on a ground, many at once that pass through each other: which of them fall through the ground?

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::parry::math::IVector;
use rapier3d_fields::rapier::parry::utils::Array2;
use rapier3d_fields::{Detection, StepWarning};

/// The kinds of ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ground {
    Mesh,
    HeightField,
    /// Boxes in one collider.
    Compound,
    /// Cubes in steps.
    Voxels,
}

/// How the ground moves: not at all, or sideways and up and down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Carried {
    Fixed,
    Led,
}

/// The shapes of falling bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dropped {
    Ball,
    Box,
    Cone,
    Hull,
    Cylinder,
    Capsule,
    /// Two balls and a box in one collider.
    Compound,
}

/// Whether Rapier or fields answer contacts, and the sides that carry a contact field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    Rapier,
    Fields(Detection, Side),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    Body,
    Ground,
    Both,
}

/// Drops of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Drops {
    pub ground: Ground,
    /// How far the ground goes up and down from level.
    pub bumps: f64,
    pub carried: Carried,
    pub shape: Dropped,
    pub count: usize,
    pub seed: u64,
}

/// The end of a run.
#[derive(Clone, Debug, Default)]
pub struct Fallen {
    /// The drops that are below the ground, by number.
    pub lost: Vec<usize>,
    /// Warnings of all steps.
    pub warnings: Vec<StepWarning>,
}

pub const SHAPES: [Dropped; 7] = [
    Dropped::Ball,
    Dropped::Box,
    Dropped::Cone,
    Dropped::Hull,
    Dropped::Cylinder,
    Dropped::Capsule,
    Dropped::Compound,
];
/// Half of the side of a ground, and of one of its squares.
const EXTENT: f64 = 15.0;
const SQUARES: i32 = 20;
const RESTITUTION: Real = 0.3;
const FRICTION: Real = 0.5;
const SECONDS: f64 = 6.0;
const HERTZ: f64 = 60.0;

/// A plain generator, the same in both precisions.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        let state = &mut self.0;
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> Real {
        from_f64(low + (high - low) * self.unit())
    }

    fn vector(&mut self, size: f64) -> Vector {
        let mut axis = || self.between(-size, size);
        Vector::new(axis(), axis(), axis())
    }
}

impl Ground {
    /// Whether Rapier 0.36.1 can step such bodies on this ground: alone, it panics on balls on voxels ("stale
    /// ContactRef manifold ordinal").
    pub fn bears(self, shape: Dropped) -> bool {
        (self, shape) != (Ground::Voxels, Dropped::Ball)
    }

    fn collider(self, bumps: f64) -> ColliderBuilder {
        let side = 2.0 * EXTENT / f64::from(SQUARES);
        let height = |x: i32, z: i32| bumps * (1.3 * f64::from(x) + f64::from(z)).sin();
        let place = |x: f64, y: f64, z: f64| Vector::new(from_f64(x), from_f64(y), from_f64(z));
        let half = SQUARES / 2;
        let squares = move || (-half..half).flat_map(move |x| (-half..half).map(move |z| (x, z)));
        match self {
            Ground::Mesh => {
                let rows = SQUARES + 1;
                let corners = (0..rows).flat_map(|i| (0..rows).map(move |j| (i - half, j - half)));
                let at = |(x, z)| place(f64::from(x) * side, height(x, z), f64::from(z) * side);
                let corner = |i: i32, j: i32| (i * rows + j) as u32;
                let halves = squares().flat_map(|(x, z)| {
                    let (i, j) = (x + half, z + half);
                    let [a, b] = [corner(i, j), corner(i, j + 1)];
                    let [c, d] = [corner(i + 1, j), corner(i + 1, j + 1)];
                    [[a, b, c], [b, d, c]]
                });
                ColliderBuilder::trimesh(corners.map(at).collect(), halves.collect())
                    .expect("a mesh")
            }
            Ground::HeightField => {
                let rows = (SQUARES + 1) as usize;
                let mut heights = Array2::zeros(rows, rows);
                for (i, j) in (0..rows).flat_map(|i| (0..rows).map(move |j| (i, j))) {
                    let [x, z] = [j, i].map(|it| it as i32 - half);
                    heights[(i, j)] = from_f64(height(x, z));
                }
                let whole = from_f64(2.0 * EXTENT);
                ColliderBuilder::heightfield(heights, Vector::new(whole, 1.0, whole))
            }
            Ground::Compound => {
                let tile = |(x, z): (i32, i32)| {
                    let (i, j) = (f64::from(x) + 0.5, f64::from(z) + 0.5);
                    let middle = place(i * side, height(x, z) - 0.5, j * side);
                    let half = from_f64(0.5 * side);
                    let shape = SharedShape::cuboid(half, 0.5, half);
                    (Pose::from_parts(middle, Rotation::IDENTITY), shape)
                };
                ColliderBuilder::compound(squares().map(tile).collect())
            }
            Ground::Voxels => {
                // Cubes of half a square each way, their tops at the nearest step below the height.
                let size = 0.5 * side;
                let column = |(x, z): (i32, i32)| {
                    let top = (height(x / 2, z / 2) / size).floor() as i32 - 1;
                    [top - 1, top].map(|y| IVector::new(x as _, y as _, z as _))
                };
                let all =
                    (-2 * half..2 * half).flat_map(|x| (-2 * half..2 * half).map(move |z| (x, z)));
                let cubes: Vec<_> = all.flat_map(column).collect();
                ColliderBuilder::voxels(Vector::splat(from_f64(size)), &cubes)
            }
        }
    }
}

impl Dropped {
    /// Its longest half extent is about `s`.
    fn collider(self, s: Real) -> ColliderBuilder {
        let at = |x: Real, y: Real| Pose::from_translation(Vector::new(x, y, 0.0));
        match self {
            Dropped::Ball => ColliderBuilder::ball(s),
            Dropped::Box => ColliderBuilder::cuboid(s, 0.8 * s, 0.6 * s),
            Dropped::Cone => ColliderBuilder::cone(s, 0.7 * s),
            Dropped::Hull => {
                let corners = [
                    [1.0, 0.1, 0.2],
                    [-0.9, 0.2, -0.1],
                    [0.1, 0.9, 0.0],
                    [0.0, -0.8, 0.3],
                    [0.2, 0.1, 0.8],
                    [-0.1, -0.2, -0.9],
                    [0.6, 0.6, 0.4],
                    [-0.5, -0.6, 0.4],
                ];
                let corner = |it: [f64; 3]| Vector::from(it.map(from_f64)) * s;
                let corners: Vec<Vector> = corners.into_iter().map(corner).collect();
                ColliderBuilder::convex_hull(&corners).expect("a hull")
            }
            Dropped::Cylinder => ColliderBuilder::cylinder(0.6 * s, 0.7 * s),
            Dropped::Capsule => ColliderBuilder::capsule_y(0.6 * s, 0.4 * s),
            Dropped::Compound => ColliderBuilder::compound(vec![
                (at(-0.6 * s, 0.0), SharedShape::ball(0.4 * s)),
                (at(0.6 * s, 0.0), SharedShape::ball(0.4 * s)),
                (
                    at(0.0, 0.2 * s),
                    SharedShape::cuboid(0.5 * s, 0.3 * s, 0.3 * s),
                ),
            ]),
        }
    }
}

impl Drops {
    /// Drops the bodies, and looks for those that are below the ground.
    pub fn run(&self, answer: Answer) -> Fallen {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::Y * -9.81;
        world.integration_parameters.dt = from_f64(HERTZ.recip());
        let [ground_group, body_group] = [Group::GROUP_1, Group::GROUP_2];
        let groups = |memberships, filter| InteractionGroups {
            memberships,
            filter,
            ..InteractionGroups::all()
        };
        let stuff =
            |collider: ColliderBuilder| collider.restitution(RESTITUTION).friction(FRICTION);
        let ground = stuff(self.ground.collider(self.bumps));
        let carrier = match self.carried {
            Carried::Fixed => RigidBodyBuilder::fixed(),
            Carried::Led => RigidBodyBuilder::kinematic_position_based(),
        };
        let ground = match self.carried {
            Carried::Fixed => ground,
            // Rapier takes the velocity of a kinematic body at its centre of mass, which is far away for an open mesh:
            // alone it loses a quarter of all cones. Without mass, the centre is the origin.
            Carried::Led => ground.density(0.0),
        };
        let (carrier, ground) = world.insert(
            carrier,
            ground.collision_groups(groups(ground_group, body_group)),
        );
        let mut random = Random(self.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let mut sides = vec![ground];
        let mut bodies = Vec::new();
        for number in 0..self.count {
            let size = random.between(0.15, 0.4);
            let [x, z] = [random.between(-5.0, 5.0), random.between(-5.0, 5.0)];
            let up = from_f64(self.bumps) + size + random.between(0.5, 3.0);
            let body = RigidBodyBuilder::dynamic()
                .translation(Vector::new(x, up, z))
                .rotation(random.vector(3.0))
                .linvel(random.vector(2.0))
                .angvel(random.vector(4.0))
                .gyroscopic_forces_enabled(number % 2 == 1);
            let collider = stuff(self.shape.collider(size));
            let groups = groups(body_group, ground_group);
            let (body, collider) = world.insert(body, collider.collision_groups(groups));
            bodies.push(body);
            sides.push(collider);
        }
        let mut fields = match answer {
            Answer::Rapier => None,
            Answer::Fields(detection, side) => {
                let sides = match side {
                    Side::Ground => &sides[..1],
                    Side::Body => &sides[1..],
                    Side::Both => &sides[..],
                };
                let law = ContactLaw::restitution(RESTITUTION).with_friction(FRICTION);
                let contacts = sides
                    .iter()
                    .map(|it| Tree::from(Field::contact(law).at(*it)));
                let tree = Tree::fold(Operator::SumUnion, contacts);
                let fields = Fields::builder(tree).detection(detection).build();
                Some(fields.expect("a valid tree"))
            }
        };
        let mut fallen = Fallen::default();
        let mut gone = vec![false; self.count];
        for step in 0..(SECONDS * HERTZ) as usize {
            if self.carried == Carried::Led {
                let phase = step as f64 / HERTZ;
                let way = [0.3 * phase.sin(), 0.2 * (1.7 * phase).sin(), 0.0];
                let place = Vector::from(way.map(from_f64));
                world.bodies[carrier].set_next_kinematic_translation(place);
            }
            match &mut fields {
                None => world.step(),
                Some(fields) => {
                    fields.step(&mut world).expect("a step");
                    fallen.warnings.extend_from_slice(fields.warnings());
                }
            }
            for (number, body) in bodies.iter().enumerate() {
                if gone[number] {
                    continue;
                }
                let at = world.bodies[*body].translation();
                let inside = |it: Real| to_f64(it).abs() < EXTENT - 1.0;
                // A body whose position is not finite is lost as well.
                gone[number] = at.y <= -1.5 || !at.is_finite();
                // A body that has rolled off is not lost.
                if gone[number] && (!at.is_finite() || inside(at.x) && inside(at.z)) {
                    fallen.lost.push(number);
                }
            }
        }
        fallen
    }
}
