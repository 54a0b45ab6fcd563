//! Rapier's vehicle and character controllers move under gravity by a field as under Rapier's own.

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::control::{
    CharacterAutostep, CharacterLength, DynamicRayCastVehicleController,
    KinematicCharacterController, WheelTuning,
};

use crate::loads::{OURS, Pull, Scene};

const SECONDS: usize = 10;

/// Ground that is level, a low step across the way, a slope, and a plateau to come down from.
fn course(world: &mut PhysicsWorld) {
    let mut slab = |half: Vector, place: Vector, degrees: f64| {
        let turn = Vector::Z * from_f64(degrees.to_radians());
        let slab = ColliderBuilder::cuboid(half.x, half.y, half.z).friction(0.7);
        world
            .colliders
            .insert(slab.translation(place).rotation(turn));
    };
    slab(Vector::new(100.0, 0.5, 20.0), Vector::Y * -0.5, 0.0);
    slab(Vector::new(0.5, 0.05, 20.0), Vector::X * 4.0, 0.0);
    slab(
        Vector::new(3.0, 0.25, 20.0),
        Vector::new(9.0, 0.27, 0.0),
        10.0,
    );
    slab(
        Vector::new(2.0, 0.5, 20.0),
        Vector::new(13.8, 0.54, 0.0),
        0.0,
    );
}

/// The places of some bodies after each step.
type Path = Vec<Vec<Vector>>;

fn places(scene: &Scene, bodies: &[RigidBodyHandle]) -> Vec<Vector> {
    let place = |body: &RigidBodyHandle| scene.world.bodies[*body].translation();
    bodies.iter().map(place).collect()
}

/// The largest distance between two paths of a body, divided by the length of the second.
fn off(ours: &Path, theirs: &Path, body: usize) -> f64 {
    let steps = theirs.windows(2);
    let length: Real = steps
        .map(|pair| (pair[1][body] - pair[0][body]).length())
        .sum();
    let apart = ours.iter().zip(theirs);
    let apart = apart.map(|(a, b)| (a[body] - b[body]).length());
    to_f64(apart.fold(0.0, Real::max) / length)
}

/// Fails unless the paths under fields are within 1 % of those under Rapier's gravity.
fn compare(what: &str, pulls: &[Pull], path: impl Fn(Pull) -> Path) {
    let theirs = path(Pull::Rapier);
    let mut wrong = Vec::new();
    for &pull in pulls {
        let ours = path(pull);
        for body in 0..theirs[0].len() {
            let off = off(&ours, &theirs, body);
            let end = theirs.last().expect("a way")[body];
            println!("{what} {body}, {pull:?}: off by {off:.2e} of its way to {end:.2}");
            if off.is_nan() || off > 0.01 {
                wrong.push(format!("{what} {body}, {pull:?}: {off:.2e}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A car on four wheels, whose springs carry it.
fn car(world: &mut PhysicsWorld) -> DynamicRayCastVehicleController {
    let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.6);
    let chassis = ColliderBuilder::cuboid(0.6, 0.15, 0.3).density(100.0);
    let (chassis, _) = world.insert(body, chassis);
    let mut car = DynamicRayCastVehicleController::new(chassis);
    (car.index_forward_axis, car.index_up_axis) = (0, 1);
    let tuning = WheelTuning {
        suspension_stiffness: 100.0,
        suspension_damping: 10.0,
        ..WheelTuning::default()
    };
    for (x, z) in [(0.45, 0.3), (0.45, -0.3), (-0.45, 0.3), (-0.45, -0.3)] {
        let place = Vector::new(x, -0.15, z);
        car.add_wheel(place, -Vector::Y, Vector::Z, 0.25, 0.15, &tuning);
    }
    car
}

/// Drives at up to 3 m/s, first straight, then in bends, and brakes at the end.
fn steer(car: &mut DynamicRayCastVehicleController, seconds: f64) {
    let slow = to_f64(car.current_vehicle_speed).abs() < 3.0;
    let power = if slow && seconds < 8.5 { 40.0 } else { 0.0 };
    let bend = if seconds < 6.0 {
        0.0
    } else {
        0.2 * (2.0 * seconds).sin()
    };
    let brake = if seconds < 8.5 { 0.0 } else { 2.0 };
    for (number, wheel) in car.wheels_mut().iter_mut().enumerate() {
        wheel.brake = brake;
        match number {
            0 | 1 => wheel.steering = from_f64(bend),
            _ => wheel.engine_force = power,
        }
    }
}

fn drive(pull: Pull) -> Path {
    let mut scene = Scene::new(pull);
    course(&mut scene.world);
    let mut car = car(&mut scene.world);
    let mut path = Vec::new();
    for step in 0..60 * SECONDS {
        steer(&mut car, step as f64 / 60.0);
        let world = &mut scene.world;
        let dispatcher = world.narrow_phase.query_dispatcher();
        let others = QueryFilter::exclude_dynamic().exclude_rigid_body(car.chassis);
        let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
        let phase = &world.broad_phase;
        let queries = phase.as_query_pipeline_mut(dispatcher, bodies, colliders, others);
        car.update_vehicle(world.integration_parameters.dt, queries);
        scene.step();
        path.push(places(&scene, &[car.chassis]));
    }
    path
}

#[test]
fn a_vehicle_drives_as_under_gravity() {
    compare("vehicle", &OURS, drive);
}

/// The acceleration of gravity at a place, by the fields or by Rapier.
fn down(scene: &Scene, place: Vector) -> Vector {
    let world = &scene.world;
    let Some(fields) = &scene.fields else {
        return world.gravity;
    };
    fields.values_at(&[place], world)[0].force
}

/// A character that walks, falls where it has no ground, and pushes obstacles.
struct Walker {
    body: RigidBodyHandle,
    collider: ColliderHandle,
    controller: KinematicCharacterController,
    falling: Vector,
}

impl Walker {
    fn new(world: &mut PhysicsWorld) -> Self {
        let body = RigidBodyBuilder::kinematic_position_based().translation(Vector::Y * 0.82);
        let (body, collider) = world.insert(body, ColliderBuilder::capsule_y(0.5, 0.3));
        let autostep = CharacterAutostep {
            max_height: CharacterLength::Absolute(0.3),
            min_width: CharacterLength::Absolute(0.2),
            include_dynamic_bodies: false,
        };
        let controller = KinematicCharacterController {
            autostep: Some(autostep),
            ..KinematicCharacterController::default()
        };
        Walker {
            body,
            collider,
            controller,
            falling: Vector::ZERO,
        }
    }

    fn walk(&mut self, scene: &mut Scene) {
        let dt = scene.world.integration_parameters.dt;
        let place = *scene.world.bodies[self.body].position();
        self.falling += down(scene, place.translation) * dt;
        let wanted = (Vector::X * 2.0 + self.falling) * dt;
        let world = &mut scene.world;
        let shape = world.colliders[self.collider].shared_shape().clone();
        let others = QueryFilter::default().exclude_rigid_body(self.body);
        let mut met = Vec::new();
        let queries = world.query_pipeline_with_filter(others);
        let moved = self
            .controller
            .move_shape(dt, &queries, &*shape, &place, wanted, |it| met.push(it));
        let dispatcher = world.narrow_phase.query_dispatcher();
        let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
        let phase = &world.broad_phase;
        let mut queries = phase.as_query_pipeline_mut(dispatcher, bodies, colliders, others);
        let mass = 80.0;
        self.controller
            .solve_character_collision_impulses(dt, &mut queries, &*shape, mass, &met);
        if moved.grounded {
            self.falling = Vector::ZERO;
        }
        let there = place.translation + moved.translation;
        world.bodies[self.body].set_next_kinematic_translation(there);
    }
}

/// The path of the walker, and of the obstacle if there is one.
fn walked(mut scene: Scene, obstacle: Option<RigidBodyHandle>) -> Path {
    let mut walker = Walker::new(&mut scene.world);
    let seen: Vec<RigidBodyHandle> = [walker.body].into_iter().chain(obstacle).collect();
    let mut path = Vec::new();
    for _ in 0..60 * SECONDS {
        walker.walk(&mut scene);
        scene.step();
        path.push(places(&scene, &seen));
    }
    path
}

#[test]
fn a_character_walks_as_under_gravity() {
    compare("character", &OURS, |pull| {
        let mut scene = Scene::new(pull);
        course(&mut scene.world);
        walked(scene, None)
    });
}

/// The path with a crate at `distance` on level ground. It cannot turn, since a push may turn it to either side.
fn pushes(pull: Pull, distance: Real) -> Path {
    let mut scene = Scene::new(pull);
    scene.floor();
    let place = Vector::new(distance, 0.3, 0.0);
    let body = RigidBodyBuilder::dynamic().translation(place);
    let cube = ColliderBuilder::cuboid(0.3, 0.3, 0.3).density(50.0);
    let cube = cube.friction(0.5);
    let (pushed, _) = scene.world.insert(body.lock_rotations(), cube);
    walked(scene, Some(pushed))
}

/// Number of starting places of the crate.
const CRATES: usize = 64;

/// Rounding decides whether the controller slides along the crate in a step or stops at it: under Rapier's gravity,
/// too, the paths for two places of the crate differ by some hundredths. So means are compared.
#[test]
fn a_character_pushes_crates_as_under_gravity() {
    compare("character and crate", &[OURS[0], OURS[2]], |pull| {
        let starts = (0..CRATES).map(|number| pushes(pull, 1.0 + 0.001 * number as Real));
        let sum = starts.reduce(|mut sum, path| {
            for (all, places) in sum.iter_mut().zip(path) {
                all.iter_mut()
                    .zip(places)
                    .for_each(|(all, place)| *all += place);
            }
            sum
        });
        let mean = |places: Vec<Vector>| places.iter().map(|sum| *sum / CRATES as Real).collect();
        sum.into_iter().flatten().map(mean).collect()
    });
}
