//! Bodies that fall, bounce and rest under Rapier's gravity.

use super::answer::{answered, follow};
use super::fields;
use super::simulation::{Simulation, weightless};
use super::{About, Case, run};
use crate::study::{Measured, Method, Metric, Run, StudyError};
use fields::ContactLaw;
use fields::math::{RigidBodyHandle, Rotation, SharedShape, Vector, from_f64, to_f64};
use fields::rapier::prelude::{ColliderBuilder, ColliderHandle, PhysicsWorld, RigidBodyBuilder};

/// m/s²
const GRAVITY: f64 = 9.81;

/// A ball that falls onto a floor, and bounces.
#[derive(Clone, Copy, Debug)]
pub struct Bounce {
    restitution: f64,
}

/// Ten boxes on each other.
#[derive(Clone, Copy, Debug)]
pub struct Stack;

/// A box on a slope of 20° that friction holds.
#[derive(Clone, Copy, Debug)]
pub struct Slope;

/// Radius of the ball, m.
const RADIUS: f64 = 0.25;
/// Height of its lowest point above the floor at the start, m.
const DROP: f64 = 2.0;

impl Bounce {
    /// Bounces that keep all energy.
    pub const ELASTIC: Bounce = Bounce { restitution: 1.0 };
    /// Bounces that keep 0.7 of the speed.
    pub const LOSSY: Bounce = Bounce { restitution: 0.7 };

    /// Exact heights of all apexes within `duration`.
    fn apexes(self, duration: f64) -> Vec<f64> {
        let (e, mut height) = (self.restitution, DROP);
        let fall = |height: f64| (2.0 * height / GRAVITY).sqrt();
        let (mut time, mut apexes) = (fall(height), Vec::new());
        loop {
            height *= e * e;
            time += fall(height);
            if time > duration {
                return apexes;
            }
            apexes.push(height);
            time += fall(height);
        }
    }
}

pub(super) fn floor(world: &mut PhysicsWorld, normal: Vector, law: [f64; 2]) -> ColliderHandle {
    let [restitution, friction] = law.map(from_f64);
    let floor = ColliderBuilder::new(SharedShape::halfspace(normal))
        .restitution(restitution)
        .friction(friction);
    world.colliders.insert(floor)
}

pub(super) fn heavy(dt: f64) -> PhysicsWorld {
    let mut world = weightless(from_f64(dt));
    world.gravity = Vector::Y * -from_f64(GRAVITY);
    world
}

fn height(simulation: &Simulation, body: RigidBodyHandle) -> f64 {
    to_f64(simulation.world.bodies[body].translation().y)
}

/// All bodies in the order of insertion. The floor is a collider without a body.
fn movers(simulation: &Simulation) -> Vec<RigidBodyHandle> {
    let bodies = simulation.world.bodies.iter();
    let mut movers: Vec<_> = bodies.map(|(handle, _)| handle).collect();
    movers.sort_unstable_by_key(|handle| handle.into_raw_parts());
    movers
}

impl Case for Bounce {
    fn about(&self) -> About {
        let elastic = self.restitution == 1.0;
        About {
            name: if elastic {
                "elastic bounce"
            } else {
                "bounce of 0.7"
            }
            .to_owned(),
            description: "A ball falls 2 m under Rapier's gravity and bounces; the height of each apex.",
            time_unit: "s",
            duration: if elastic { 10.0 } else { 3.0 },
            longest: 1.0 / 30.0,
            halvings: 6,
            views: vec![(Metric::Apex, 0.05)],
        }
    }

    fn methods(&self) -> &'static [Method] {
        &[
            Method::FieldsDiscrete,
            Method::FieldsSwept,
            Method::Rapier,
            Method::RapierCcd,
            Method::RapierSoftCcd,
        ]
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        self.steps(dt)?;
        let mut world = heavy(dt);
        let floor = floor(&mut world, Vector::Y, [self.restitution, 0.0]);
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::Y * from_f64(RADIUS + DROP))
            .can_sleep(false);
        let ball = ColliderBuilder::ball(from_f64(RADIUS))
            .restitution(from_f64(self.restitution))
            .friction(0.0);
        let ball = world.insert(body, ball).1;
        let law = ContactLaw::restitution(from_f64(self.restitution));
        Ok(vec![answered(
            &self.about().name,
            method,
            world,
            &[floor, ball],
            law,
        )?])
    }

    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError> {
        let (about, steps) = (self.about(), self.steps(dt)?);
        let mut simulation = self.set_up(method, dt)?.swap_remove(0);
        let ball = movers(&simulation)[0];
        let mut heights = vec![height(&simulation, ball) - RADIUS];
        let (made, warned) = follow(&mut simulation, steps, |_, simulation| {
            heights.push(height(simulation, ball) - RADIUS);
        });
        let exact = self.apexes(about.duration);
        let found = tops(&heights);
        let worst = exact.iter().enumerate().map(|(number, exact)| {
            let found = found.get(number).copied().unwrap_or(0.0);
            (found / exact - 1.0).abs()
        });
        let worst = worst.fold(0.0, f64::max);
        let errors = vec![Measured::new(Metric::Apex, worst)];
        Ok(run(&about, (method, dt), (made, warned), 0, errors))
    }
}

/// Heights of the apexes, from parabolas through the three highest points of each.
fn tops(heights: &[f64]) -> Vec<f64> {
    let triples = heights.windows(3);
    let tops = triples.filter_map(|it| {
        let [a, b, c] = it.try_into().ok()?;
        let (up, down): (f64, f64) = (b - a, b - c);
        (up > 0.0 && down >= 0.0).then(|| b + (up - down).powi(2) / (8.0 * (up + down)))
    });
    tops.collect()
}

/// Friction coefficient of the boxes and of the floor.
const FRICTION: f64 = 0.5;
/// Half the edge of a box, m.
const HALF: f64 = 0.25;
const BOXES: usize = 10;

impl Case for Stack {
    fn about(&self) -> About {
        About {
            name: "stack".to_owned(),
            description: "Ten boxes on each other under Rapier's gravity, friction 0.5, restitution 0, 5 s.",
            time_unit: "s",
            duration: 5.0,
            longest: 1.0 / 30.0,
            halvings: 5,
            views: vec![(Metric::Overlap, 1e-2), (Metric::Slip, 1e-2)],
        }
    }

    fn methods(&self) -> &'static [Method] {
        &[
            Method::FieldsDiscrete,
            Method::FieldsSwept,
            Method::Rapier,
            Method::RapierCcd,
        ]
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        self.steps(dt)?;
        let mut world = heavy(dt);
        let mut parts = vec![floor(&mut world, Vector::Y, [0.0, FRICTION])];
        for number in 0..BOXES {
            let up = HALF * (1.0 + 2.0 * number as f64);
            let body = RigidBodyBuilder::dynamic().translation(Vector::Y * from_f64(up));
            let half = from_f64(HALF);
            let cube = ColliderBuilder::cuboid(half, half, half).friction(from_f64(FRICTION));
            parts.push(world.insert(body, cube).1);
        }
        let law = ContactLaw::Impulse {
            restitution: 0.0,
            friction: from_f64(FRICTION),
        };
        let simulation = answered(&self.about().name, method, world, &parts, law)?;
        Ok(vec![simulation])
    }

    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError> {
        let (about, steps) = (self.about(), self.steps(dt)?);
        let mut simulation = self.set_up(method, dt)?.swap_remove(0);
        let boxes = movers(&simulation);
        let (made, warned) = follow(&mut simulation, steps, |_, _| ());
        let heights: Vec<f64> = boxes.iter().map(|it| height(&simulation, *it)).collect();
        let below = std::iter::once(-HALF).chain(heights.iter().copied());
        let overlap = heights
            .iter()
            .zip(below)
            .map(|(it, below)| below + 2.0 * HALF - it);
        let overlap = overlap.fold(0.0, f64::max);
        let aside = boxes.iter().map(|it| {
            let at = simulation.world.bodies[*it].translation();
            to_f64(at.x).hypot(to_f64(at.z))
        });
        let slip = aside.fold(0.0, f64::max);
        let errors = vec![
            Measured::new(Metric::Overlap, overlap / (2.0 * HALF)),
            Measured::new(Metric::Slip, slip / (2.0 * HALF)),
        ];
        Ok(run(&about, (method, dt), (made, warned), 0, errors))
    }
}

impl Case for Slope {
    fn about(&self) -> About {
        About {
            name: "slope".to_owned(),
            description: "A box on a slope of 20° under Rapier's gravity, friction 0.5, 5 s.",
            time_unit: "s",
            duration: 5.0,
            longest: 1.0 / 30.0,
            halvings: 5,
            views: vec![(Metric::Slip, 1e-2)],
        }
    }

    fn methods(&self) -> &'static [Method] {
        Stack.methods()
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        self.steps(dt)?;
        let mut world = heavy(dt);
        let tilt = Rotation::from_rotation_z(from_f64(20_f64.to_radians()));
        let floor = floor(&mut world, tilt * Vector::Y, [0.0, FRICTION]);
        let half = from_f64(HALF);
        let body = RigidBodyBuilder::dynamic()
            .translation(tilt * (Vector::Y * half))
            .rotation(tilt.to_scaled_axis());
        let cube = ColliderBuilder::cuboid(half, half, half).friction(from_f64(FRICTION));
        let cube = world.insert(body, cube).1;
        let law = ContactLaw::Impulse {
            restitution: 0.0,
            friction: from_f64(FRICTION),
        };
        let simulation = answered(&self.about().name, method, world, &[floor, cube], law)?;
        Ok(vec![simulation])
    }

    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError> {
        let (about, steps) = (self.about(), self.steps(dt)?);
        let mut simulation = self.set_up(method, dt)?.swap_remove(0);
        let cube = movers(&simulation)[0];
        let start = simulation.world.bodies[cube].translation();
        let (made, warned) = follow(&mut simulation, steps, |_, _| ());
        let way = simulation.world.bodies[cube].translation() - start;
        let slip = to_f64(way.length()) / (2.0 * HALF);
        let errors = vec![Measured::new(Metric::Slip, slip)];
        Ok(run(&about, (method, dt), (made, warned), 0, errors))
    }
}
