//! Touches of swept detection, judged by the gap between the parts at the time of the touch.

use rapier3d_fields::cross_check::{CrossCheckReport, TouchCounts};
use rapier3d_fields::math::{Real, Vector, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use super::mutants::{MADE, Made};
use super::report;
use crate::support::collide::*;
use crate::support::{assert_at_most, either};

/// Two parts that fly at each other without turning, and meet in the first step at `speed`.
fn shot(made: Made, speed: f64, aside: f64) -> (PhysicsWorld, Fields) {
    let mut world = arena(from_f64(0.1));
    let place = Vector::new(2.0, from_f64(aside), 0.1);
    let things = [Vector::ZERO, place].map(|place| made.insert(&mut world, place, Vector::ZERO));
    world.bodies[things[1].body].set_linvel(Vector::X * from_f64(-speed), true);
    let tree = touch(parts(&[&things[0], &things[1]]), ELASTIC);
    let builder = Fields::builder(tree).detection(Detection::Swept);
    let fields = builder.cross_check(true).build().expect("a valid tree");
    (world, fields)
}

fn touches(made: Made, speed: f64, aside: f64) -> TouchCounts {
    let (mut world, mut fields) = shot(made, speed, aside);
    step(&mut fields, &mut world);
    assert_eq!(
        report(&fields).disagreed(),
        0,
        "{made:?}\n{}",
        report(&fields)
    );
    report(&fields).touches
}

#[test]
fn the_gap_vanishes_at_the_time_of_a_touch() {
    for made in MADE {
        for aside in [0.0, 0.1, 0.3] {
            let found = touches(made, 14.0, aside);
            println!("{made:?}, {aside} aside: {found:?}");
            // A hull that was hit aside turns, and may hit again.
            assert!(found.agreed >= 1, "{made:?}: {found:?}");
            assert_eq!(found.agreed, found.total(), "{made:?}: {found:?}");
            let error = to_f64(found.gap_error);
            assert_at_most(error, either(1e-4, 1e-9), "gap");
        }
        assert_eq!(touches(made, 1.0, 0.0).total(), 0, "too slow to meet");
    }
}

#[test]
fn touches_that_sampling_would_miss_are_counted() {
    for made in MADE {
        // At 80 parts of a length of at most 1.4 move by 8 and pass through; at 14 they still overlap after the step.
        assert_eq!(touches(made, 80.0, 0.1).missed_by_sampling, 1, "{made:?}");
        assert_eq!(touches(made, 14.0, 0.1).missed_by_sampling, 0, "{made:?}");
    }
}

/// Parry takes a half-space first, so the pair has to be turned round where it is second.
#[test]
fn the_normal_on_a_half_space_is_right_whichever_came_first() {
    for made in MADE {
        for floor_first in [true, false] {
            let mut world = arena(from_f64(0.1));
            let tilt = Vector::new(0.2, 1.0, -0.1).normalize();
            let floor = |world: &mut PhysicsWorld| {
                let body = RigidBodyBuilder::fixed().translation(Vector::Y * -1.5);
                insert(
                    world,
                    body,
                    [ColliderBuilder::new(SharedShape::halfspace(tilt))],
                )
            };
            let first = floor_first.then(|| floor(&mut world));
            let part = made.insert(&mut world, Vector::ZERO, Vector::new(0.4, 0.2, -0.3));
            let floor = first.unwrap_or_else(|| floor(&mut world));
            world.bodies[part.body].set_linvel(Vector::Y * -14.0, true);
            let tree = touch(parts(&[&part, &floor]), ELASTIC);
            let builder = Fields::builder(tree).detection(Detection::Swept);
            let mut fields = builder.cross_check(true).build().expect("a valid tree");
            step(&mut fields, &mut world);
            let found = report(&fields);
            println!("{made:?}: {:?}", found.touches);
            assert_eq!(found.disagreed(), 0, "{made:?}\n{found}");
            assert!(found.touches.agreed >= 1, "{made:?}\n{found}");
        }
    }
}

#[test]
fn discrete_detection_has_no_touches() {
    let (mut world, things) = overlapping([Vector::X, Vector::ZERO], [1.0; 2]);
    let mut fields = cross_checked(&[&things[0], &things[1]], ELASTIC);
    step(&mut fields, &mut world);
    assert_eq!(report(&fields).touches, TouchCounts::default());
}

const SCHEMES: [Scheme; 5] = [
    Scheme::KickDriftKick,
    Scheme::Forward4,
    Scheme::auto(0.01),
    Scheme::substeps(4),
    Scheme::Substep(Substeps::PerBody { tolerance: 0.01 }),
];

const CONSTANT_ONLY: [Scheme; 3] = [
    Scheme::Kick,
    Scheme::ExternalForce,
    Scheme::LinearlyImplicit,
];

/// The bodies that fly about in a box.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Flier {
    /// Balls on a body, with their places, and its moments of inertia.
    Molecule(&'static [[f64; 3]], [f64; 3]),
    Part(Made),
    /// Balls and cuboids in turn.
    Mixed,
}

const ATOMS: [[f64; 3]; 4] = [
    [0.5, 0.05, 0.0],
    [-0.4, 0.35, 0.05],
    [-0.15, -0.45, 0.2],
    [0.1, 0.05, -0.45],
];
const ENDS: [[f64; 3]; 2] = [[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]];
const TOP: [f64; 3] = [0.7, 1.1, 1.5];
const SYMMETRIC: [f64; 3] = [0.8, 0.8, 1.3];
const SPHERICAL: [f64; 3] = [1.0; 3];

impl Flier {
    fn insert(self, world: &mut PhysicsWorld, number: usize, place: Vector) -> Thing {
        let turn = Vector::new(1.0, -0.7, 0.4) * (number % 5) as Real;
        match self {
            Flier::Part(made) => made.insert(world, place, turn),
            Flier::Mixed if number.is_multiple_of(2) => Made::Ball.insert(world, place, turn),
            Flier::Mixed => Made::Cuboid.insert(world, place, turn),
            Flier::Molecule(atoms, inertia) => {
                let inertia = Vector::from_array(inertia.map(from_f64)) * 0.3;
                let properties = MassProperties::new(Vector::ZERO, 1.0, inertia);
                let body = RigidBodyBuilder::dynamic()
                    .pose(Pose::new(place, turn))
                    .additional_mass_properties(properties)
                    .allow_fast_rotation(true)
                    .can_sleep(false);
                let atoms = atoms.iter().map(|at| {
                    let at = Vector::from_array(at.map(from_f64));
                    let ball = ColliderBuilder::ball(0.3).translation(at);
                    ball.density(0.0).friction(0.0)
                });
                insert(world, body, atoms)
            }
        }
    }
}

/// A crowd of fliers that spin in a box, hit each other and the walls, in a field as well.
fn crowd(flier: Flier, scheme: Scheme, field: Option<Field>, gravity: Real) -> CrossCheckReport {
    let mut world = arena(from_f64(1.0 / 60.0));
    world.gravity = Vector::Y * -gravity;
    let mut touching = Vec::new();
    for number in 0..8 {
        let side = |bit: usize| (number >> bit & 1) as Real * 2.4 - 1.2;
        let place = Vector::new(side(0), side(1), side(2));
        let thing = flier.insert(&mut world, number, place);
        let body = &mut world.bodies[thing.body];
        let number = number as Real;
        body.set_linvel(place * -2.0 + Vector::new(0.3, -0.2, 0.1) * number, true);
        body.set_angvel(Vector::new(3.0 - number, 5.0, 0.5 * number - 2.0), true);
        touching.extend(thing.parts);
    }
    let half = Vector::splat(from_f64(2.4));
    let walls = crate::lab::scenes::insert_box(&mut world.bodies, &mut world.colliders, half);
    let tree = touch(touching.into_iter().chain(walls), ELASTIC);
    let tree = match field {
        Some(field) => tree.sum_union(field),
        None => tree,
    };
    let builder = Fields::builder(tree)
        .scheme(scheme)
        .detection(Detection::Swept);
    let mut fields = builder.cross_check(true).build().expect("a valid tree");
    for _ in 0..90 {
        step(&mut fields, &mut world);
    }
    report(&fields).clone()
}

/// Before, touches were judged by Parry's shape cast, which covers straight motion and steady rotation only: none was
/// judged of spinning molecules of four atoms under any scheme, of balls and boxes under gravity, or of balls in a
/// spring.
#[test]
fn touches_on_any_path_are_judged() {
    let spring = || Some(Field::spring(6.0));
    let gravity = from_f64(9.81);
    let molecule = |inertia| Flier::Molecule(&ATOMS, inertia);
    let dumbbell = Flier::Molecule(&ENDS, [0.2, 1.0, 1.0]);
    let kdk = Scheme::KickDriftKick;
    let mut scenes = vec![
        (Flier::Part(Made::Ball), kdk, None, 0.0),
        (dumbbell, kdk, None, 0.0),
        (Flier::Mixed, kdk, None, gravity),
        (Flier::Part(Made::Hull), kdk, None, gravity),
        (Flier::Part(Made::Ball), kdk, spring(), 0.0),
    ];
    for scheme in SCHEMES {
        scenes.push((molecule(TOP), scheme, spring(), 0.0));
        scenes.push((molecule(SYMMETRIC), scheme, spring(), gravity));
    }
    scenes.push((molecule(SPHERICAL), kdk, spring(), gravity));
    scenes.push((molecule(TOP), kdk, spring(), gravity));
    scenes.push((molecule(TOP), kdk, None, gravity));
    let magnetic = Field::magnetic(Vector::new(0.3, 2.0, 0.1)).coupled_to(Coupling::Each);
    scenes.push((molecule(TOP), Scheme::Forward4, Some(magnetic), 0.0));
    // With answers, these schemes refuse fields that are not constant.
    for scheme in CONSTANT_ONLY {
        let pull = Field::uniform(Vector::Y * -gravity).force_mode(ForceMode::Acceleration);
        scenes.push((molecule(TOP), scheme, Some(pull.clone()), 0.0));
        scenes.push((Flier::Mixed, scheme, Some(pull), 0.0));
    }
    for (flier, scheme, field, gravity) in scenes {
        let found = crowd(flier, scheme, field, gravity);
        println!("{flier:?} {scheme:?} {gravity}\n{found}");
        let touches = found.touches;
        assert_eq!(found.disagreed(), 0, "{flier:?} {scheme:?}\n{found}");
        assert!(touches.total() > 20, "{flier:?} {scheme:?}\n{found}");
        let judged = touches.agreed as f64 / touches.total() as f64;
        assert!(judged >= 0.95, "{flier:?} {scheme:?}\n{found}");
    }
}
