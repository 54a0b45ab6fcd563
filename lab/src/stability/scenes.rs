//! The worlds of the stability map, by their fastest rate.

use super::super::fields;
use super::{DT, Damping, Scene};
use fields::math::{DVec3, from_f64, to_dvec3, to_f64};
use fields::prelude::*;
use fields::rapier::na::DMatrix;

/// A body with its colliders.
#[derive(Clone, Debug)]
struct Thing {
    body: RigidBodyHandle,
    parts: Vec<ColliderHandle>,
}

fn insert(
    world: &mut PhysicsWorld,
    body: RigidBodyBuilder,
    parts: impl IntoIterator<Item = ColliderBuilder>,
) -> Thing {
    let body = world.bodies.insert(body);
    let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
    let parts = parts.into_iter();
    let parts = parts.map(|part| colliders.insert_with_parent(part, body, bodies));
    let parts = parts.collect();
    // Otherwise Rapier does this only in its next step.
    world.bodies[body].recompute_mass_properties_from_colliders(&world.colliders);
    Thing { body, parts }
}

fn place(world: &PhysicsWorld, body: RigidBodyHandle) -> DVec3 {
    to_dvec3(world.bodies[body].translation())
}

fn vector(x: f64, y: f64, z: f64) -> Vector {
    Vector::new(from_f64(x), from_f64(y), from_f64(z))
}

/// A world without gravity, in which Rapier's contacts are exact.
fn empty() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    world.integration_parameters.dt = from_f64(DT);
    world.integration_parameters.contact_recycling = false;
    world.integration_parameters.max_ccd_substeps = 0;
    world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
    world
}

/// A ball without contacts.
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

pub(super) fn spring(omega: f64) -> Scene {
    let mut world = empty();
    let body = ghost(&mut world, 1.0, Vector::X, Vector::ZERO).body;
    let stiffness = omega * omega;
    Scene::new(world, Field::spring(from_f64(stiffness)), move |world| {
        0.5 * stiffness * place(world, body).length_squared()
    })
}

pub(super) fn trough(omega: f64) -> Scene {
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

/// Opposite charges at a distance of one from the centre of a body, in a field along x.
pub(super) fn rotor(omega: f64) -> Scene {
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

/// Initial displacements of the beads of a row, along it and across.
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

/// The square of the largest angular frequency of balls in a row on springs of stiffness one; `held` if one more spring
/// holds either end.
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

/// The group of a bead, which interacts with springs only.
fn group_of_bead(number: usize) -> Group {
    Group::from_bits_truncate(1 << number)
}

/// The group of springs.
const SPRINGS: Group = Group::GROUP_32;

/// A spring field from a bead to its neighbours.
fn link(bead: RigidBodyHandle, number: usize, stiffness: f64) -> Tree {
    let before = number.checked_sub(1).map_or(Group::NONE, group_of_bead);
    let neighbours = before | group_of_bead(number + 1);
    let mode = InteractionTestMode::And;
    let spring = Field::spring_damper(from_f64(stiffness), 0.0, 1.0)
        .groups(InteractionGroups::new(SPRINGS, neighbours, mode));
    spring.reacting().at(bead).into()
}

pub(super) fn chain(omega: f64, masses: &[f64]) -> Scene {
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

/// A ball with contacts.
fn ball(world: &mut PhysicsWorld, mass: f64, place: Vector, linvel: Vector) -> Thing {
    let body = RigidBodyBuilder::dynamic()
        .translation(place)
        .linvel(linvel);
    let ball = ColliderBuilder::ball(0.5)
        .mass(from_f64(mass))
        .friction(0.0);
    insert(world, body.can_sleep(false), [ball])
}

/// Inserts walls that face each other, at these positions along x.
fn walls(world: &mut PhysicsWorld, places: [f64; 2]) {
    for (place, side) in places.into_iter().zip([1.0, -1.0]) {
        let wall = ColliderBuilder::new(SharedShape::halfspace(Vector::X * side));
        let wall = wall.friction(0.0).translation(vector(place, 0.0, 0.0));
        world.colliders.insert(wall);
    }
}

/// Balls in a row with contacts by the penalty law.
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
    let parts = balls.iter().flat_map(|ball| &ball.parts);
    let parts = parts.map(|part| Field::contact(law).at(*part).into());
    let tree = Tree::fold::<Tree>(Operator::SumUnion, parts);
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

pub(super) fn penalty_walls(omega: f64, damping: Damping) -> Scene {
    let mut world = empty();
    let ball = ball(&mut world, 1.0, vector(0.013, 0.0, 0.0), Vector::X);
    let places = [-0.6, 0.6];
    walls(&mut world, places);
    let law = (omega * omega, damping.of_law(omega));
    penalty(world, vec![ball], law, Some(places))
}

pub(super) fn penalty_pair(omega: f64, ratio: f64, damping: Damping) -> Scene {
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

/// Neighbours overlap by 0.02; initial displacements are at most a quarter of that. The energy is relative to
/// equilibrium.
pub(super) fn penalty_row(omega: f64, damping: Damping) -> Scene {
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

/// The Lennard-Jones energy at distance `r` for σ = 1, in units of ε, relative to the bottom of the well.
fn repulsion(r: f64) -> f64 {
    4.0 * (r.powi(-12) - r.powi(-6)) + 1.0
}

/// The second derivative of [`repulsion`] at half of σ.
fn overlap_stiffness() -> f64 {
    let r = 0.5_f64;
    4.0 * (156.0 * r.powi(-14) - 42.0 * r.powi(-8))
}

pub(super) fn overlap_fixed(omega: f64) -> Scene {
    let mut world = empty();
    let body = ghost(&mut world, 1.0, Vector::X * 0.5, Vector::ZERO).body;
    let depth = omega * omega / overlap_stiffness();
    let tree = Field::lennard_jones(from_f64(depth), 1.0);
    Scene::new(world, tree, move |world| {
        depth * repulsion(place(world, body).length())
    })
}

pub(super) fn overlap_pair(omega: f64) -> Scene {
    let mut world = empty();
    let half = vector(0.25, 0.0, 0.0);
    let [a, b] = [half, -half].map(|place| ghost(&mut world, 1.0, place, Vector::ZERO).body);
    let depth = 0.5 * omega * omega / overlap_stiffness();
    let tree = Field::lennard_jones(from_f64(depth), 1.0).reacting().at(a);
    Scene::new(world, tree, move |world| {
        depth * repulsion(place(world, a).distance(place(world, b)))
    })
}

/// Distance of the pericentre from the centre, on an ellipse of semi-major axis one.
const NEAREST: f64 = 0.1;

pub(super) fn comet(omega: f64) -> Scene {
    let mut world = empty();
    let strength = omega * omega * NEAREST.powi(3);
    let farthest = 2.0 - NEAREST;
    let speed = (strength * NEAREST / farthest).sqrt();
    let [start, linvel] = [vector(farthest, 0.0, 0.0), vector(0.0, speed, 0.0)];
    let body = ghost(&mut world, 1.0, start, linvel).body;
    let tree = Field::radial(from_f64(-strength), -2.0);
    // Relative to the potential at the pericentre.
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

pub(super) fn gyration(omega: f64) -> Scene {
    charge(omega, 0.0)
}

pub(super) fn trap(omega: f64) -> Scene {
    charge(omega, omega * omega)
}

pub(super) fn drag(omega: f64, quadratic: bool) -> Scene {
    let mut world = empty();
    ghost(&mut world, 1.0, Vector::ZERO, Vector::X * 3.0);
    let tree = match quadratic {
        false => Field::drag(from_f64(omega), 0.0),
        true => Field::drag(0.0, from_f64(omega / 3.0)),
    };
    Scene::new(world, tree, |_| 0.0)
}

/// A ball on an arm of length one, released one radian from where the spring pulls it.
pub(super) fn pendulum(omega: f64, multibody: bool) -> Scene {
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

pub(super) fn rod(omega: f64) -> Scene {
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
