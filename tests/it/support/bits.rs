//! The state of a world, bit for bit.

use rapier3d_fields::math::to_f64;
use rapier3d_fields::prelude::*;

/// Poses, velocities, forces, sleep and switches of all bodies: NaN equals NaN, −0 is not 0.
pub fn bits(world: &PhysicsWorld) -> Vec<Vec<u64>> {
    let body = |(_, body): (RigidBodyHandle, &RigidBody)| {
        let rotation = body.rotation();
        let mut numbers = vec![rotation.x, rotation.y, rotation.z, rotation.w];
        for vector in [
            body.translation(),
            body.linvel(),
            body.angvel(),
            body.user_force(),
            body.user_torque(),
        ] {
            numbers.extend(vector.to_array());
        }
        let switches = [
            body.is_sleeping(),
            body.is_enabled(),
            body.gyroscopic_forces_enabled(),
        ];
        let numbers = numbers.into_iter().map(|x| to_f64(x).to_bits());
        numbers.chain(switches.map(u64::from)).collect()
    };
    world.bodies.iter().map(body).collect()
}
