//! Scenes of known energy that a scheme may blow up, at any ratio of step to swing, and what comes of a run.
//!
//! In each of them nothing adds energy, so what has gained any has it from the scheme.

use rapier3d_fields::math::{DVec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::na::DMatrix;

use super::build;
use super::collide::{Thing, arena, insert, touch};

pub const DT: f64 = 1.0 / 60.0;
/// So long a run is: `ExternalForce` doubles the energy of a swing of dt·ω = 0.1 in it.
pub const STEPS: usize = 200;
/// What has so many times the energy of the start has exploded.
pub const EXPLODED: f64 = 2.0;
/// A run ends here: beyond there is nothing more to learn.
const GONE: f64 = 1e12;

/// What swings, turns or slows down at a rate that is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A ball in a spring.
    Spring,
    /// A ball that swings slowly along a trough whose walls are stiff.
    Trough,
    /// A dumbbell that a field turns.
    Rotor,
    /// Two bodies on a spring that reacts, of this ratio of masses.
    Pair(f64),
    /// Ten bodies in a row on springs that react, every other one so many times as heavy.
    Chain(f64),
    /// A ball to and fro between walls of the penalty law.
    PenaltyWalls,
    /// Two balls that meet, of this ratio of masses.
    PenaltyPair(f64),
    /// Five balls squeezed in between two walls.
    PenaltyRow,
    /// An atom half inside one that stands still.
    OverlapFixed,
    /// Two atoms half inside each other.
    OverlapPair,
    /// A planet that falls towards a centre; the rate is that where it is nearest.
    Comet,
    /// A charge in a magnetic field.
    Gyration,
    /// A charge in a magnetic field and in a spring of the same rate.
    Trap,
    /// A ball that linear drag slows down.
    Drag,
    /// The same of quadratic drag, at the first speed.
    QuadraticDrag,
    /// A ball on an arm, pulled by a spring.
    Pendulum,
    /// Two bodies that are joined, in a spring.
    Rod,
    /// The pendulum as a multibody.
    Link,
}

impl Kind {
    pub const ALL: [Kind; 21] = [
        Kind::Spring,
        Kind::Trough,
        Kind::Rotor,
        Kind::Pair(1.0),
        Kind::Pair(100.0),
        Kind::Chain(1.0),
        Kind::Chain(100.0),
        Kind::PenaltyWalls,
        Kind::PenaltyPair(1.0),
        Kind::PenaltyPair(100.0),
        Kind::PenaltyRow,
        Kind::OverlapFixed,
        Kind::OverlapPair,
        Kind::Comet,
        Kind::Gyration,
        Kind::Trap,
        Kind::Drag,
        Kind::QuadraticDrag,
        Kind::Pendulum,
        Kind::Rod,
        Kind::Link,
    ];

    /// The scene whose fastest rate is `omega`.
    pub fn scene(self, omega: f64, damping: Damping) -> Scene {
        let mut scene = match self {
            Kind::Spring => spring(omega),
            Kind::Trough => trough(omega),
            Kind::Rotor => rotor(omega),
            Kind::Pair(ratio) => chain(omega, &[1.0, ratio]),
            Kind::Chain(ratio) => chain(omega, &[1.0, ratio].repeat(5)),
            Kind::PenaltyWalls => penalty_walls(omega, damping),
            Kind::PenaltyPair(ratio) => penalty_pair(omega, ratio, damping),
            Kind::PenaltyRow => penalty_row(omega, damping),
            Kind::OverlapFixed => overlap_fixed(omega),
            Kind::OverlapPair => overlap_pair(omega),
            Kind::Comet => comet(omega),
            Kind::Gyration => gyration(omega),
            Kind::Trap => trap(omega),
            Kind::Drag => drag(omega, false),
            Kind::QuadraticDrag => drag(omega, true),
            Kind::Pendulum => pendulum(omega, false),
            Kind::Link => pendulum(omega, true),
            Kind::Rod => rod(omega),
        };
        if !self.touches() || matches!(damping, Damping::Rapier(_)) {
            scene.damp(omega, damping);
        }
        scene
    }

    /// Whether its contacts are damped by their law.
    fn touches(self) -> bool {
        matches!(
            self,
            Kind::PenaltyWalls | Kind::PenaltyPair(_) | Kind::PenaltyRow
        )
    }
}

/// What takes energy, by the share of the damping that stops a swing from coming back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damping {
    None,
    /// Rapier's own, of all bodies.
    Rapier(f64),
    /// A drag; of contacts, that of their law.
    Field(f64),
}

impl Damping {
    pub const ALL: [Damping; 5] = [
        Damping::None,
        Damping::Rapier(0.05),
        Damping::Rapier(5.0),
        Damping::Field(0.05),
        Damping::Field(5.0),
    ];

    /// The damping of a law of contacts, for bodies of mass one.
    fn of_law(self, omega: f64) -> f64 {
        match self {
            Damping::Field(ratio) => 2.0 * ratio * omega,
            _ => 0.0,
        }
    }
}

/// The potential energy of what is in a world.
type Potential = Box<dyn Fn(&PhysicsWorld) -> f64>;

/// A world with fields, and what energy they give it.
pub struct Scene {
    world: PhysicsWorld,
    tree: Tree,
    charged: Vec<(ColliderHandle, f64)>,
    potential: Potential,
}

impl Scene {
    fn new(
        world: PhysicsWorld,
        tree: impl Into<Tree>,
        potential: impl Fn(&PhysicsWorld) -> f64 + 'static,
    ) -> Self {
        Scene {
            world,
            tree: tree.into(),
            charged: Vec::new(),
            potential: Box::new(potential),
        }
    }

    fn damp(&mut self, omega: f64, damping: Damping) {
        match damping {
            Damping::None => {}
            Damping::Rapier(ratio) => {
                for (_, body) in self.world.bodies.iter_mut() {
                    body.set_linear_damping(from_f64(2.0 * ratio * omega));
                    body.set_angular_damping(from_f64(2.0 * ratio * omega));
                }
            }
            Damping::Field(ratio) => {
                let drag = Field::drag(from_f64(2.0 * ratio * omega), 0.0);
                self.tree = std::mem::take(&mut self.tree).sum_union(drag);
            }
        }
    }

    fn energy(&self) -> f64 {
        let bodies = self.world.bodies.iter();
        let kinetic = bodies.map(|(_, body)| {
            let turning = body.mass_properties().local_mprops.principal_inertia();
            let spin = body.rotation().inverse() * body.angvel();
            let [moments, spin] = [turning, spin].map(to_dvec3);
            let speed2 = to_dvec3(body.linvel()).length_squared();
            to_f64(body.mass()) * speed2 + (moments * spin * spin).element_sum()
        });
        0.5 * kinetic.sum::<f64>() + (self.potential)(&self.world)
    }
}

/// What came of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fate {
    /// The largest energy as a share of that of the start, and the last.
    pub most: f64,
    pub last: f64,
    /// The step at which it had exploded.
    pub exploded: Option<usize>,
    /// The first step with a warning that has to do with stability, or that was refused.
    pub told: Option<usize>,
    pub refused: bool,
}

impl Fate {
    /// Whether it exploded before anybody was told.
    pub fn is_silent(self) -> bool {
        let told = self.told.unwrap_or(usize::MAX);
        self.exploded.is_some_and(|exploded| exploded < told)
    }
}

/// Runs a scene.
pub fn fate(mut scene: Scene, scheme: Scheme) -> Fate {
    let mut fields = build(std::mem::take(&mut scene.tree), scheme);
    for (part, charge) in &scene.charged {
        let charge = ColliderProperties::new().charge(from_f64(*charge));
        let set = fields.set_properties(*part, charge, &scene.world.colliders);
        set.expect("a collider of the world");
    }
    let first = scene.energy();
    let mut fate = Fate::default();
    for step in 0..STEPS {
        fate.refused = fields.step(&mut scene.world).is_err();
        if fate.refused || fields.warnings().iter().any(tells) {
            fate.told.get_or_insert(step);
        }
        let share = scene.energy() / first;
        let share = if share.is_nan() { f64::INFINITY } else { share };
        fate.last = share;
        fate.most = fate.most.max(share);
        if share > EXPLODED {
            fate.exploded.get_or_insert(step);
        }
        if fate.refused || share > GONE {
            break;
        }
    }
    fate
}

/// Whether a warning tells of a scheme that does not follow its fields.
fn tells(warning: &StepWarning) -> bool {
    matches!(
        warning,
        StepWarning::Stiff { .. } | StepWarning::ToleranceMissed { .. }
    )
}

fn place(world: &PhysicsWorld, body: RigidBodyHandle) -> DVec3 {
    to_dvec3(world.bodies[body].translation())
}

fn vector(x: f64, y: f64, z: f64) -> Vector {
    Vector::new(from_f64(x), from_f64(y), from_f64(z))
}

fn empty() -> PhysicsWorld {
    arena(from_f64(DT))
}

/// A ball that nothing touches.
fn ghost(world: &mut PhysicsWorld, mass: f64, place: Vector, linvel: Vector) -> Thing {
    let body = RigidBodyBuilder::dynamic()
        .translation(place)
        .linvel(linvel);
    let ball = ColliderBuilder::ball(0.1).mass(from_f64(mass));
    let ball = ball.collision_groups(InteractionGroups::none());
    insert(
        world,
        body.can_sleep(false).allow_fast_rotation(true),
        [ball],
    )
}

fn spring(omega: f64) -> Scene {
    let mut world = empty();
    let body = ghost(&mut world, 1.0, Vector::X, Vector::ZERO).body;
    let stiffness = omega * omega;
    Scene::new(world, Field::spring(from_f64(stiffness)), move |world| {
        0.5 * stiffness * place(world, body).length_squared()
    })
}

fn trough(omega: f64) -> Scene {
    let mut world = empty();
    let start = vector(1.0, 1e-3, 0.0);
    let body = ghost(&mut world, 1.0, start, Vector::ZERO).body;
    let (along, across) = ((0.05 / DT).powi(2), omega * omega);
    let well = Field::closure([], move |sample: &Sample| {
        let p = sample.local_point;
        Vector::new(-from_f64(along) * p.x, -from_f64(across) * p.y, 0.0)
    });
    Scene::new(world, well, move |world| {
        let p = place(world, body);
        0.5 * (along * p.x * p.x + across * p.y * p.y)
    })
}

/// Charges at an arm's length of one from the middle of a body, in a field along x.
fn rotor(omega: f64) -> Scene {
    let mut world = empty();
    let body = RigidBodyBuilder::dynamic()
        .rotation(Vector::Z)
        .can_sleep(false)
        .allow_fast_rotation(true);
    let ends = [1.0, -1.0].map(|side| {
        let ball = ColliderBuilder::ball(0.1).mass(1.0);
        let ball = ball.collision_groups(InteractionGroups::none());
        ball.translation(Vector::X * side)
    });
    let rotor = insert(&mut world, body, ends);
    let inertia = 2.0 * (1.0 + 0.4 * 0.01);
    let pull = 0.5 * omega * omega * inertia;
    let tree = Field::uniform(Vector::X * from_f64(pull)).coupled_to_axis(Axis::Charge);
    let body = rotor.body;
    let mut scene = Scene::new(world, tree, move |world| {
        let axis = *world.bodies[body].rotation() * Vector::X;
        2.0 * pull * (1.0 - to_f64(axis.x))
    });
    scene.charged = rotor.parts.into_iter().zip([1.0, -1.0]).collect();
    scene
}

/// How far off the beads of a row are at the start, along it and across.
const OFF: [[f64; 2]; 10] = [
    [0.0, 0.01],
    [0.02, 0.0],
    [-0.03, 0.0],
    [0.01, -0.01],
    [0.04, 0.02],
    [-0.02, 0.0],
    [0.03, -0.01],
    [0.0, 0.0],
    [-0.01, 0.02],
    [0.02, 0.0],
];

/// The square of the fastest frequency of balls in a row on springs of stiffness one; `held`: with one
/// more at either end.
fn fastest2(masses: &[f64], held: bool) -> f64 {
    let count = masses.len();
    let mut matrix = DMatrix::zeros(count, count);
    for (number, mass) in masses.iter().enumerate() {
        let at_an_end = number == 0 || number == count - 1;
        let springs = if at_an_end && !held { 1.0 } else { 2.0 };
        matrix[(number, number)] = springs / mass;
        if number > 0 {
            let between = -1.0 / (mass * masses[number - 1]).sqrt();
            matrix[(number, number - 1)] = between;
            matrix[(number - 1, number)] = between;
        }
    }
    matrix.symmetric_eigenvalues().max()
}

/// The group of a bead, which meets nothing but springs.
fn group_of_bead(number: usize) -> Group {
    Group::from_bits_truncate(1 << number)
}

/// The group of springs.
const SPRINGS: Group = Group::GROUP_32;

/// A spring from a bead to its neighbours.
fn link(bead: RigidBodyHandle, number: usize, stiffness: f64) -> Tree {
    let before = number.checked_sub(1).map_or(Group::NONE, group_of_bead);
    let neighbours = before | group_of_bead(number + 1);
    let mode = InteractionTestMode::And;
    let spring = Field::spring_damper(from_f64(stiffness), 0.0, 1.0)
        .groups(InteractionGroups::new(SPRINGS, neighbours, mode));
    spring.reacting().at(bead).into()
}

fn chain(omega: f64, masses: &[f64]) -> Scene {
    let mut world = empty();
    let stiffness = omega * omega / fastest2(masses, false);
    let beads = masses.iter().zip(OFF).enumerate();
    let beads = beads.map(|(number, (mass, [along, aside]))| {
        let start = vector(number as f64 + along, aside, 0.0);
        let bead = ghost(&mut world, *mass, start, Vector::ZERO);
        let mode = InteractionTestMode::And;
        let groups = InteractionGroups::new(group_of_bead(number), SPRINGS, mode);
        world.colliders[bead.parts[0]].set_collision_groups(groups);
        bead.body
    });
    let beads: Vec<RigidBodyHandle> = beads.collect();
    let links = beads.iter().enumerate().step_by(2);
    let links = links.map(|(number, bead)| link(*bead, number, stiffness));
    let tree = Tree::fold(Operator::SumUnion, links);
    Scene::new(world, tree, move |world| {
        let stretches = beads.windows(2).map(|pair| {
            let way = place(world, pair[0]) - place(world, pair[1]);
            way.length() - 1.0
        });
        0.5 * stiffness * stretches.map(|stretch| stretch * stretch).sum::<f64>()
    })
}

/// A ball that touches what it meets.
fn ball(world: &mut PhysicsWorld, mass: f64, place: Vector, linvel: Vector) -> Thing {
    let body = RigidBodyBuilder::dynamic()
        .translation(place)
        .linvel(linvel);
    let ball = ColliderBuilder::ball(0.5)
        .mass(from_f64(mass))
        .friction(0.0);
    insert(world, body.can_sleep(false), [ball])
}

/// Walls that face each other along x, at these places.
fn walls(world: &mut PhysicsWorld, places: [f64; 2]) {
    for (place, side) in places.into_iter().zip([1.0, -1.0]) {
        let wall = ColliderBuilder::new(SharedShape::halfspace(Vector::X * side));
        let wall = wall.friction(0.0).translation(vector(place, 0.0, 0.0));
        world.colliders.insert(wall);
    }
}

/// Balls in a row that push whatever they overlap.
fn penalty(
    world: PhysicsWorld,
    balls: Vec<Thing>,
    (stiffness, damping): (f64, f64),
    walls: Option<[f64; 2]>,
) -> Scene {
    let law = ContactLaw::Penalty {
        stiffness: from_f64(stiffness),
        damping: from_f64(damping),
    };
    let tree = touch(balls.iter().flat_map(|ball| ball.parts.clone()), law);
    Scene::new(world, tree, move |world| {
        let places: Vec<DVec3> = balls.iter().map(|ball| place(world, ball.body)).collect();
        let between = places
            .windows(2)
            .map(|pair| 1.0 - pair[0].distance(pair[1]));
        let mut depths: Vec<f64> = between.collect();
        for ball in &places {
            if let Some([left, right]) = walls {
                depths.extend([left + 0.5 - ball.x, ball.x + 0.5 - right]);
            }
        }
        let squares = depths.iter().map(|depth| depth.max(0.0).powi(2));
        0.5 * stiffness * squares.sum::<f64>()
    })
}

fn penalty_walls(omega: f64, damping: Damping) -> Scene {
    let mut world = empty();
    let ball = ball(&mut world, 1.0, vector(0.013, 0.0, 0.0), Vector::X);
    let places = [-0.6, 0.6];
    walls(&mut world, places);
    let law = (omega * omega, damping.of_law(omega));
    penalty(world, vec![ball], law, Some(places))
}

fn penalty_pair(omega: f64, ratio: f64, damping: Damping) -> Scene {
    let mut world = empty();
    let still = ball(&mut world, ratio, Vector::X * -0.5, Vector::ZERO);
    let start = vector(0.613, 0.05, 0.0);
    let meets = ball(&mut world, 1.0, start, -Vector::X);
    let law = (
        omega * omega / fastest2(&[1.0, ratio], false),
        damping.of_law(omega),
    );
    penalty(world, vec![still, meets], law, None)
}

/// Each overlaps by 0.02, and is off by a quarter of that at most; energy counts from where they rest.
fn penalty_row(omega: f64, damping: Damping) -> Scene {
    let mut world = empty();
    let balls = OFF[..5].iter().enumerate().map(|(number, [along, _])| {
        let start = vector(0.98 * number as f64 + 0.1 * along, 0.0, 0.0);
        ball(&mut world, 1.0, start, Vector::ZERO)
    });
    let balls = balls.collect();
    let places = [-0.48, 4.0 * 0.98 + 0.48];
    walls(&mut world, places);
    let stiffness = omega * omega / fastest2(&[1.0; 5], true);
    let law = (stiffness, damping.of_law(omega));
    let mut scene = penalty(world, balls, law, Some(places));
    let least = 6.0 * 0.5 * stiffness * 0.02 * 0.02;
    let all = scene.potential;
    scene.potential = Box::new(move |world| all(world) - least);
    scene
}

/// Of two atoms of size one so far apart, in units of their depth; from the bottom of the well.
fn repulsion(r: f64) -> f64 {
    4.0 * (r.powi(-12) - r.powi(-6)) + 1.0
}

/// The second derivative of that at half of the size.
fn overlap_stiffness() -> f64 {
    let r = 0.5_f64;
    4.0 * (156.0 * r.powi(-14) - 42.0 * r.powi(-8))
}

fn overlap_fixed(omega: f64) -> Scene {
    let mut world = empty();
    let body = ghost(&mut world, 1.0, Vector::X * 0.5, Vector::ZERO).body;
    let depth = omega * omega / overlap_stiffness();
    let tree = Field::lennard_jones(from_f64(depth), 1.0);
    Scene::new(world, tree, move |world| {
        depth * repulsion(place(world, body).length())
    })
}

fn overlap_pair(omega: f64) -> Scene {
    let mut world = empty();
    let half = vector(0.25, 0.0, 0.0);
    let [a, b] = [half, -half].map(|place| ghost(&mut world, 1.0, place, Vector::ZERO).body);
    let depth = 0.5 * omega * omega / overlap_stiffness();
    let tree = Field::lennard_jones(from_f64(depth), 1.0).reacting().at(a);
    Scene::new(world, tree, move |world| {
        depth * repulsion(place(world, a).distance(place(world, b)))
    })
}

/// From far away on an ellipse of size one, whose nearest point is this far from the centre.
const NEAREST: f64 = 0.1;

fn comet(omega: f64) -> Scene {
    let mut world = empty();
    let strength = omega * omega * NEAREST.powi(3);
    let farthest = 2.0 - NEAREST;
    let speed = (strength * NEAREST / farthest).sqrt();
    let [start, linvel] = [vector(farthest, 0.0, 0.0), vector(0.0, speed, 0.0)];
    let body = ghost(&mut world, 1.0, start, linvel).body;
    let tree = Field::radial(from_f64(-strength), -2.0);
    // From the bottom of where it comes.
    Scene::new(world, tree, move |world| {
        strength * (NEAREST.recip() - place(world, body).length().recip())
    })
}

/// A charge in a magnetic field and a spring.
fn charge(rate: f64, stiffness: f64) -> Scene {
    let mut world = empty();
    let linvel = vector(1.0, -0.3, 0.5);
    let ion = ghost(&mut world, 1.0, Vector::ZERO, linvel);
    let magnetic = Field::magnetic(vector(0.6 * rate, 0.0, 0.8 * rate));
    let tree = match stiffness {
        0.0 => magnetic.into(),
        _ => magnetic.sum_union(Field::spring(from_f64(stiffness))),
    };
    let body = ion.body;
    let mut scene = Scene::new(world, tree, move |world| {
        0.5 * stiffness * place(world, body).length_squared()
    });
    scene.charged = vec![(ion.parts[0], 1.0)];
    scene
}

fn gyration(omega: f64) -> Scene {
    charge(omega, 0.0)
}

fn trap(omega: f64) -> Scene {
    charge(omega, omega * omega)
}

fn drag(omega: f64, quadratic: bool) -> Scene {
    let mut world = empty();
    ghost(&mut world, 1.0, Vector::ZERO, Vector::X * 3.0);
    let tree = match quadratic {
        false => Field::drag(from_f64(omega), 0.0),
        true => Field::drag(0.0, from_f64(omega / 3.0)),
    };
    Scene::new(world, tree, |_| 0.0)
}

/// On an arm of one, one radian from where the spring pulls it.
fn pendulum(omega: f64, multibody: bool) -> Scene {
    let mut world = empty();
    let start = vector(1.0_f64.sin(), 1.0_f64.cos(), 0.0);
    let body = ghost(&mut world, 1.0, start, Vector::ZERO).body;
    let post = world.bodies.insert(RigidBodyBuilder::fixed());
    match multibody {
        true => {
            let joint = RevoluteJointBuilder::new(Vector::Z).local_anchor2(-start);
            let joint = world.insert_multibody_joint(post, body, joint);
            joint.expect("a chain of one");
        }
        false => {
            let joint = SphericalJointBuilder::new().local_anchor2(-start);
            world.insert_impulse_joint(post, body, joint);
        }
    }
    let stiffness = omega * omega * (1.0 + 0.4 * 0.01);
    let tree = Field::spring(from_f64(stiffness)).at(Vector::Y);
    Scene::new(world, tree, move |world| {
        0.5 * stiffness * place(world, body).distance_squared(DVec3::Y)
    })
}

fn rod(omega: f64) -> Scene {
    let mut world = empty();
    let ends = [0.5, 1.5].map(|x| ghost(&mut world, 1.0, vector(x, 0.0, 0.0), Vector::ZERO).body);
    let joint = FixedJointBuilder::new().local_anchor1(Vector::X * 0.5);
    let joint = joint.local_anchor2(Vector::X * -0.5);
    world.insert_impulse_joint(ends[0], ends[1], joint);
    let stiffness = omega * omega;
    Scene::new(world, Field::spring(from_f64(stiffness)), move |world| {
        let squares = ends.map(|end| place(world, end).length_squared());
        0.5 * stiffness * (squares[0] + squares[1])
    })
}
