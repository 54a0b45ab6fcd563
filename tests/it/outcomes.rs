//! The counts that a step returns.

use rapier3d_fields::pipeline::StepOutcome;
use rapier3d_fields::prelude::*;

use crate::support::{build, weightless};

/// Three balls and a cloth of nine particles in a field, a ball beside it, and a fixed body.
fn world() -> PhysicsWorld {
    let mut world = weightless(1.0 / 60.0);
    for x in [0.0, 2.0, 4.0, 90.0] {
        let body = RigidBodyBuilder::dynamic().translation(Vector::X * x);
        world.insert(body.can_sleep(false), ColliderBuilder::ball(0.5));
    }
    world.insert(
        RigidBodyBuilder::fixed(),
        ColliderBuilder::ball(0.1).sensor(true),
    );
    let cloth = SoftBodyBuilder::cloth(Vector::Y * 5.0, Vector::X, Vector::Z, 3, 3);
    world.insert_soft_body(cloth.mass(2.0).can_sleep(false));
    world
}

fn near() -> Field {
    Field::uniform(Vector::Y).within(Region::ball(20.0))
}

#[test]
fn steps_count_bodies_and_particles() {
    for (scheme, written, particles) in [
        (Scheme::KickDriftKick, 3, 9),
        // One kick, before Rapier's step.
        (Scheme::Kick, 0, 0),
    ] {
        let (mut world, mut fields) = (world(), build(near(), scheme));
        for step in 0..3 {
            let outcome = fields.step(&mut world).expect("a step");
            let place = format!("{scheme:?}, step {step}: {outcome:?}");
            assert_eq!(outcome.sampled, 4, "{place}");
            assert_eq!(outcome.written, written, "{place}");
            assert_eq!(outcome.particles, particles, "{place}");
            assert_eq!([outcome.contacts, outcome.warnings], [0, 0], "{place}");
            assert_eq!(outcome.error, None, "{place}");
            assert!(!outcome.exhausted, "{place}");
        }
    }
}

/// A quarter of the tolerance where no body comes near that.
#[test]
fn schemes_that_choose_give_an_error() {
    let (mut world, mut fields) = (world(), build(near(), Scheme::auto(0.01)));
    let outcome = fields.step(&mut world).expect("a step");
    assert_eq!(outcome.error, Some(0.0025), "a force that hardly varies");
    let everywhere = Field::uniform(Vector::Y);
    let mut fields = build(everywhere, Scheme::auto(0.01));
    let outcome = fields.step(&mut world).expect("a step");
    assert_eq!(outcome.error, Some(0.0), "a force that does not vary");
}

/// A field that reaches no body.
#[test]
fn steps_in_which_no_field_reaches_a_body_count_none() {
    let mut world = weightless(1.0 / 60.0);
    let body = RigidBodyBuilder::fixed();
    world.insert(body, ColliderBuilder::ball(0.5));
    let outcome = build(near(), Scheme::default()).step(&mut world);
    assert_eq!(outcome, Ok(StepOutcome::default()));
}
