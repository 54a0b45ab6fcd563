//! A replay without fields, in which bodies are given the states that they have with fields. Does Rapier panic, too, or
//! compute velocities that are not finite?
//!
//! The smallest world found in this way, without fields: two bodies, a step of length zero, the first body disabled,
//! and a step of another length, in which Rapier 0.36.1 panics ("index out of bounds" in
//! `island_manager/persistent.rs`). Quarantine disables bodies, too.

use std::panic::{AssertUnwindSafe, catch_unwind};

use rapier3d_fields::WorldMut;
use rapier3d_fields::prelude::*;

use crate::draw::Draw;
use crate::edits::Edits;
use crate::{fields_of, is_finite, worlds};

/// The state of a body between steps.
struct Seen {
    handle: RigidBodyHandle,
    body: RigidBody,
}

fn see(world: &PhysicsWorld) -> Vec<Seen> {
    let seen = |(handle, body): (_, &RigidBody)| Seen {
        handle,
        body: body.clone(),
    };
    world.bodies.iter().map(seen).collect()
}

/// Gives bodies the states that were recorded, by Rapier's public functions.
fn show(world: &mut PhysicsWorld, seen: &[Seen]) {
    for Seen { handle, body: was } in seen {
        let Some(body) = world.bodies.get_mut(*handle) else {
            continue;
        };
        if body.position() != was.position() {
            body.set_position(*was.position(), false);
        }
        if body.is_sleeping() && !was.is_sleeping() {
            body.wake_up(true);
        }
        body.set_linvel(was.linvel(), false);
        body.set_angvel(was.angvel(), false);
        *body.activation_mut() = *was.activation();
        body.enable_gyroscopic_forces(was.gyroscopic_forces_enabled());
        if body.is_enabled() != was.is_enabled() {
            body.set_enabled(was.is_enabled());
        }
    }
}

/// The bodies before and after each of Rapier's steps of a case, up to a panic.
fn record(seed: u64) -> Vec<[Vec<Seen>; 2]> {
    let mut steps = Vec::new();
    let run = || {
        let mut world = worlds::world(&mut Draw::new(seed, 0));
        let mut fields = fields_of(seed, &world);
        let mut edits = Edits::new(seed);
        for step in 0..edits.steps {
            edits.apply(step, &mut world, fields.as_mut());
            let open = fields
                .as_mut()
                .map(|it| it.begin(WorldMut::from(&mut world)));
            steps.push([see(&world), Vec::new()]);
            match (&mut fields, open) {
                (Some(fields), Some(Ok(open))) => {
                    world.step_with_events(&open.hooks(&()), &());
                    // A step that is refused leaves the bodies as they are.
                    let _ = fields.finish(open, WorldMut::from(&mut world));
                }
                _ => world.step(),
            }
            steps[step][1] = see(&world);
        }
    };
    let _ = catch_unwind(AssertUnwindSafe(run));
    steps
}

/// What Rapier alone does in a case in which the bodies are given the states that they have with fields.
#[derive(PartialEq)]
pub enum Alone {
    Panics,
    /// An enabled body is not finite after a step that began with finite ones.
    NotFinite,
    Nothing,
}

pub fn replay(seed: u64) -> Alone {
    let steps = record(seed);
    let run = || {
        let mut world = worlds::world(&mut Draw::new(seed, 0));
        let mut edits = Edits::new(seed);
        let mut outcome = Alone::Nothing;
        for (step, [before, after]) in steps.iter().enumerate() {
            edits.apply(step, &mut world, None);
            show(&mut world, before);
            let was_finite = all_finite(&world);
            world.step();
            if was_finite && !all_finite(&world) {
                outcome = Alone::NotFinite;
            }
            show(&mut world, after);
        }
        outcome
    };
    catch_unwind(AssertUnwindSafe(run)).unwrap_or(Alone::Panics)
}

fn all_finite(world: &PhysicsWorld) -> bool {
    let mut bodies = world.bodies.iter();
    bodies.all(|(_, body)| !body.is_enabled() || is_finite(body))
}
