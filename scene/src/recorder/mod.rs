//! Records a run, for a [`Page`](crate::page::Page).

mod arrows;
mod bodies;
mod bounds;
mod contacts;
mod frames;
mod mesh;
mod paths;
mod walls;

use super::fields::Fields;
use super::fields::math::{RigidBodyHandle, to_f64};
use super::fields::rapier::pipeline::PhysicsWorld;
use crate::page::Replay;
use arrows::Snapshot;
use bodies::Body;
use bounds::{Bounds, Parts};
use contacts::{Contacts, Flash};
use frames::{Counts, Frame};
use paths::Paths;

/// The most frames of a replay, unless `Pace::every` is given.
const MOST_FRAMES: usize = 300;

/// The most poses (frames times bodies) and the fewest frames of a replay, unless `Pace::every` is given: a page of
/// many bodies takes a few megabytes.
const MOST_POSES: usize = 150_000;
const LEAST_FRAMES: usize = 60;

/// The most moments at which fields are sampled.
const MOMENTS: usize = 24;

/// The length of a run, and the period of its frames.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Steps of the run.
    pub steps: usize,
    /// The number of steps from one frame to the next. `None` gives at most about 300 frames, and fewer for
    /// many bodies.
    pub every: Option<usize>,
}

impl Pace {
    fn every(self, bodies: usize) -> usize {
        let most = (MOST_POSES / bodies.max(1)).clamp(LEAST_FRAMES, MOST_FRAMES);
        let chosen = self.every.unwrap_or_else(|| self.steps.div_ceil(most));
        chosen.max(1)
    }
}

/// Records a world and its fields, step by step.
///
/// It shows the bodies that are in the world at its beginning, except soft bodies.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// use rapier3d_fields_scene::page::Page;
/// use rapier3d_fields_scene::single::{Pace, Recorder};
/// let mut world = PhysicsWorld::new();
/// world.insert(RigidBodyBuilder::dynamic().translation(Vector::X), ColliderBuilder::ball(0.5));
/// let mut fields = Fields::new(Field::spring(4.0))?;
/// let mut recorder = Recorder::new(&world, &fields, Pace { steps: 120, every: None });
/// for _ in 0..120 {
///     fields.step(&mut world)?;
///     recorder.after_step(&world, &fields);
/// }
/// let mut replay = recorder.finish(&world);
/// replay.name = "a ball on a spring".to_owned();
/// assert_eq!((replay.frames.len(), replay.bodies.len()), (121, 1));
/// let page = Page { title: "spring".to_owned(), facts: String::new(), replay };
/// assert!(page.html()?.starts_with("<!DOCTYPE html>"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Recorder {
    steps: usize,
    every: usize,
    /// Steps so far.
    step: usize,
    bodies: Vec<Body>,
    frames: Vec<Frame>,
    /// By frame, contacts since the frame before.
    flashes: Vec<Vec<Flash>>,
    contacts: Contacts,
    snapshots: Vec<Snapshot>,
}

impl Recorder {
    /// Begins a recording, with the current state of the world as its first frame.
    pub fn new(world: &PhysicsWorld, fields: &Fields, pace: Pace) -> Self {
        let bodies = bodies::all(world);
        let mut recorder = Recorder {
            steps: pace.steps,
            every: pace.every(bodies.len()),
            step: 0,
            bodies,
            frames: Vec::new(),
            flashes: Vec::new(),
            contacts: Contacts::default(),
            snapshots: Vec::new(),
        };
        recorder.frame(world, fields);
        recorder
    }

    /// Names a body, for the labels of the replay.
    pub fn name(&mut self, body: RigidBodyHandle, name: &str) {
        if let Some(body) = self.bodies.iter_mut().find(|it| it.handle == Some(body)) {
            body.name = Some(name.to_owned());
        }
    }

    /// Records the world after a step: contacts always, and a frame if one is due or the step is the last.
    pub fn after_step(&mut self, world: &PhysicsWorld, fields: &Fields) {
        self.step += 1;
        self.contacts.note(world, fields);
        if self.step.is_multiple_of(self.every) || self.step == self.steps {
            self.frame(world, fields);
        }
    }

    fn frame(&mut self, world: &PhysicsWorld, fields: &Fields) {
        let expected = self.steps / self.every + 1;
        if self.frames.len().is_multiple_of(expected.div_ceil(MOMENTS)) {
            let snapshot = Snapshot::new(self.frames.len(), world, fields);
            self.snapshots.extend(snapshot);
        }
        self.frames
            .push(Frame::new(fields.time(), &self.bodies, world));
        self.flashes.push(self.contacts.take());
    }

    /// The replay, without name and description. The world must be as it was after the last recorded step.
    pub fn finish(self, world: &PhysicsWorld) -> Replay {
        let parts = Parts::new(&self.bodies, &self.frames, world);
        let paths = Paths::new(&parts, &self.frames);
        let moving = Bounds::of_movers(&parts, &paths);
        let walls = walls::all(&parts, &paths, &moving);
        let bounds = moving.with_fixed(&parts, &walls);
        let counts = Counts::new(&bounds);
        let drawn = bodies::Drawn::new(&self.bodies, &parts, &walls, &bounds);
        let gravity = world.gravity.to_array().map(|it| to_f64(it).abs());
        Replay {
            unit: counts.unit(),
            up: if gravity[2] > gravity[1] { 2 } else { 1 },
            center: counts.place(bounds.center),
            half: counts.place(bounds.half),
            times: self.frames.iter().map(|frame| frame.time).collect(),
            frames: frames::differences(&self.frames, &drawn.bodies, &counts),
            asleep: frames::sleep(&self.frames),
            contacts: contacts::rows(&self.flashes, &counts),
            walls: walls.iter().map(|wall| wall.corners(&counts)).collect(),
            arrows: arrows::all(&self.snapshots, &bounds, &parts, &paths),
            shapes: drawn.shapes,
            bodies: drawn.bodies,
            ..Replay::default()
        }
    }
}
