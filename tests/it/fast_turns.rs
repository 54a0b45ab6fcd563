//! Impacts that turn bodies faster than Rapier allows.

use rapier3d_fields::prelude::*;
use rapier3d_fields::{Detection, StepWarning};

/// A rod that hits a ball with its end at 30 m/s rotates at 90 rad/s then, which Rapier reduces to 47.
#[test]
fn an_impact_that_turns_a_body_faster_than_rapier_allows_is_warned_of() {
    for (allowed, detection) in [
        (false, Detection::Discrete),
        (false, Detection::Swept),
        (true, Detection::Swept),
    ] {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        let at = Vector::new(0.5, -1.0, 0.0);
        let ball = RigidBodyBuilder::fixed().translation(at);
        let (_, ball) = world.insert(ball, ColliderBuilder::ball(0.3));
        let rod = RigidBodyBuilder::dynamic().linvel(Vector::Y * -30.0);
        let (rod, _) = world.insert(rod, ColliderBuilder::cuboid(0.5, 0.05, 0.05));
        world.bodies[rod].set_allow_fast_rotation(allowed);
        let law = ContactLaw::restitution(1.0).with_friction(0.0);
        let contact = Field::contact(law).at(ball);
        let fields = Fields::builder(contact).detection(detection);
        let mut fields = fields.build().expect("a tree");
        let mut warned = Vec::new();
        for _ in 0..5 {
            fields.step(&mut world).expect("a step");
            warned.extend_from_slice(fields.warnings());
        }
        let is_it = |it: &StepWarning| matches!(it, StepWarning::RotationCapped { body, speed, .. } if *body == rod && *speed > 60.0);
        assert_eq!(
            warned.iter().any(is_it),
            !allowed,
            "{detection:?}: {warned:?}"
        );
    }
}
