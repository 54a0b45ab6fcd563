//! Twenty hard spheres in a cube: the first 60 collisions, by several methods.

use super::fields;
use fields::math::{from_f64, to_f64};
use fields::prelude::*;

/// Radius of the spheres.
pub const RADIUS: f64 = 0.5;

/// Spheres in a cube from 0 to `side`, and their exact collisions.
pub struct Gas {
    pub name: &'static str,
    pub side: f64,
    /// Position and velocity of each.
    pub start: Vec<[f64; 6]>,
    pub events: Vec<Event>,
}

/// A collision: of spheres i < j, or of a sphere with a wall, 0:-x 1:+x 2:-y 3:+y 4:-z 5:+z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    pub time: f64,
    pub pair: Pair,
}

/// The two parts of a collision.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pair {
    Spheres(usize, usize),
    Wall(usize, usize),
}

/// How collisions are found and answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    Swept,
    Discrete,
    Rapier,
}

fn rows(text: &str) -> impl Iterator<Item = Vec<f64>> {
    let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines.map(|line| {
        line.split(',')
            .filter_map(|cell| cell.parse().ok())
            .collect()
    })
}

impl Gas {
    /// The dense gas of the reference, in a cube of side 4, and the dilute one, of side 10.
    pub fn references() -> [Gas; 2] {
        let dense = include_str!("../../../tests/data/g_hard_spheres20/dense_events.csv");
        let dense_states = include_str!("../../../tests/data/g_hard_spheres20/dense_states.csv");
        let dilute = include_str!("../../../tests/data/g_hard_spheres20/dilute_events.csv");
        let dilute_states = include_str!("../../../tests/data/g_hard_spheres20/dilute_states.csv");
        [
            Gas::read("dense", 4.0, dense, dense_states),
            Gas::read("dilute", 10.0, dilute, dilute_states),
        ]
    }

    fn read(name: &'static str, side: f64, events: &str, states: &str) -> Gas {
        let event = |row: Vec<f64>| {
            let (i, j) = (row[3] as usize, row[4] as usize);
            let pair = match row[2] as u8 {
                0 => Pair::Spheres(i.min(j), i.max(j)),
                _ => Pair::Wall(i, j),
            };
            Event { time: row[1], pair }
        };
        let state = |row: Vec<f64>| [row[3], row[4], row[5], row[6], row[7], row[8]];
        let of = |which: f64| rows(states).filter(move |row| row[0] == which).map(state);
        Gas {
            name,
            side,
            start: of(0.0).collect(),
            events: rows(events).map(event).collect(),
        }
    }

    /// A world of the spheres and six walls, with contact fields unless `method` is [`Method::Rapier`].
    pub fn build(&self, method: Method, dt: f64) -> Result<Run, BuildError> {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        world.integration_parameters.dt = from_f64(dt);
        world.integration_parameters.contact_recycling = false;
        let mut spheres = Vec::new();
        for [x, y, z, vx, vy, vz] in self.start.iter().map(|state| state.map(from_f64)) {
            let body = RigidBodyBuilder::dynamic()
                .translation(Vector::new(x, y, z))
                .linvel(Vector::new(vx, vy, vz))
                .can_sleep(false);
            let ball = ColliderBuilder::ball(from_f64(RADIUS)).mass(1.0);
            spheres.push(world.insert(body, elastic(ball)).1);
            let body = world.colliders[spheres[spheres.len() - 1]].parent();
            if let Some(body) = body.and_then(|body| world.bodies.get_mut(body)) {
                body.recompute_mass_properties_from_colliders(&world.colliders);
            }
        }
        let side = from_f64(self.side);
        let walls = [Vector::X, Vector::Y, Vector::Z]
            .into_iter()
            .flat_map(|axis| [(axis, Vector::ZERO), (-axis, axis * side)])
            .map(|(normal, place)| {
                let wall = ColliderBuilder::new(SharedShape::halfspace(normal)).translation(place);
                world.colliders.insert(elastic(wall))
            })
            .collect::<Vec<_>>();
        let detection = match method {
            Method::Swept => Detection::Swept,
            _ => Detection::Discrete,
        };
        let touch = |part: &ColliderHandle| Field::contact(ContactLaw::elastic()).at(*part).into();
        let fields = spheres.iter().chain(&walls).map(touch);
        let tree = Tree::fold::<Tree>(Operator::SumUnion, fields);
        let fields = match method {
            Method::Rapier => None,
            _ => Some(Fields::builder(tree).detection(detection).build()?),
        };
        Ok(Run {
            world,
            fields,
            spheres,
            walls,
            time: 0.0,
            touching: Vec::new(),
        })
    }
}

fn elastic(collider: ColliderBuilder) -> ColliderBuilder {
    collider.restitution(1.0).friction(0.0)
}

/// A running simulation of a gas.
pub struct Run {
    pub world: PhysicsWorld,
    pub fields: Option<Fields>,
    pub spheres: Vec<ColliderHandle>,
    pub walls: Vec<ColliderHandle>,
    time: f64,
    touching: Vec<Pair>,
}

impl Run {
    /// Makes a step, and returns its collisions: in order of time if the method reports times, else by number.
    pub fn step(&mut self) -> Result<Vec<Event>, StepError> {
        let dt = to_f64(self.world.integration_parameters.dt);
        self.time += dt;
        let Some(fields) = &mut self.fields else {
            self.world.step();
            return Ok(self.solved());
        };
        fields.step(&mut self.world)?;
        let Some(fields) = &self.fields else {
            return Ok(Vec::new());
        };
        let answered = fields.contacts().iter();
        let answered = answered.filter(|c| c.impulses.iter().any(|i| *i != Vector::ZERO));
        let event = |contact: &fields::contact::FieldContact| {
            let time = contact.time_of_impact.unwrap_or(self.time);
            Some(Event {
                time,
                pair: self.pair(contact.colliders)?,
            })
        };
        Ok(answered.filter_map(event).collect())
    }

    /// Contacts to which Rapier's solver gave an impulse in this step, but not in the one before.
    fn solved(&mut self) -> Vec<Event> {
        let pairs = self.world.narrow_phase.contact_pairs();
        let pushed = pairs.filter(|pair| pair.total_impulse_magnitude() > 0.0);
        let mut touching: Vec<Pair> = pushed
            .filter_map(|pair| self.pair([pair.collider1, pair.collider2]))
            .collect();
        touching.sort_unstable();
        let new = touching.iter().filter(|pair| !self.touching.contains(pair));
        let time = self.time;
        let events = new.map(|pair| Event { time, pair: *pair }).collect();
        self.touching = touching;
        events
    }

    fn pair(&self, colliders: [ColliderHandle; 2]) -> Option<Pair> {
        let sphere = |c: ColliderHandle| self.spheres.iter().position(|s| *s == c);
        let wall = |c: ColliderHandle| self.walls.iter().position(|w| *w == c);
        let [a, b] = colliders;
        match (sphere(a), sphere(b)) {
            (Some(i), Some(j)) => Some(Pair::Spheres(i.min(j), i.max(j))),
            (Some(i), None) => Some(Pair::Wall(i, wall(b)?)),
            (None, Some(i)) => Some(Pair::Wall(i, wall(a)?)),
            (None, None) => None,
        }
    }

    /// Runs past the last collision of the reference; returns all collisions.
    pub fn finish(&mut self, gas: &Gas) -> Result<Vec<Event>, StepError> {
        let last = gas.events.last().map_or(0.0, |event| event.time);
        let mut events = Vec::new();
        while self.time < last {
            events.extend(self.step()?);
        }
        Ok(events)
    }
}

/// Number of collisions from the first on that equal those of the reference, in order.
pub fn in_order(events: &[Event], gas: &Gas) -> usize {
    let pairs = events.iter().zip(&gas.events);
    pairs
        .take_while(|(found, exact)| found.pair == exact.pair)
        .count()
}
