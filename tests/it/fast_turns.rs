//! Impacts that turn bodies faster than Rapier allows.

use rapier3d_fields::math::Real;
use rapier3d_fields::prelude::*;
use rapier3d_fields::{Detection, StepWarning};

/// A rod that hits a ball with its end at 30 m/s rotates at 2 · 30 m/s · r / (k² + r²) = 89.8 rad/s then, with
/// r = 0.5 m and k² = (1² + 0.1²) / 12 m²; Rapier reduces that to 47.
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
        let speeds = warned.iter().filter_map(|it| match it {
            StepWarning::RotationCapped { body, speed, .. } if *body == rod => Some(*speed),
            _ => None,
        });
        let fastest = speeds.fold(0.0, Real::max);
        let due = if allowed { 0.0 } else { 89.8 };
        // Discrete detection answers an overlap, which is not at the very end of the rod.
        let error = (fastest - due).abs();
        assert!(error < 2.0, "{detection:?}: {fastest}, {warned:?}");
    }
}
