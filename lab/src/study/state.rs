//! The state of a rigid body, in 64 bits.

use rapier3d_fields::math::{DQuat, DVec3};

/// Position, rotation, velocity and angular momentum of a rigid body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// That of the centre of mass.
    pub position: DVec3,
    /// Body to world.
    pub rotation: DQuat,
    /// That of the centre of mass.
    pub velocity: DVec3,
    /// Angular momentum about the centre of mass, along the world's axes.
    pub momentum: DVec3,
}

impl State {
    /// Angular velocity along the world's axes, given the principal moments of inertia about the body's axes.
    pub fn angvel(&self, moments: DVec3) -> DVec3 {
        self.rotation * ((self.rotation.inverse() * self.momentum) / moments)
    }

    /// The angle between two attitudes, computed from its sine: the cosine loses half of the digits of small angles.
    pub fn angle_to(&self, other: &State) -> f64 {
        let between = self.rotation * other.rotation.inverse();
        2.0 * between.xyz().length().min(1.0).asin()
    }

    /// The state after a time `h` at a constant rate.
    pub fn moved(&self, rate: &State, h: f64) -> State {
        State {
            position: self.position + rate.position * h,
            rotation: self.rotation + rate.rotation * h,
            velocity: self.velocity + rate.velocity * h,
            momentum: self.momentum + rate.momentum * h,
        }
    }
}
