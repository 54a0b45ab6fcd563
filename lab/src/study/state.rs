//! A rigid body on its way, in 64 bits.

use rapier3d_fields::math::{DQuat, DVec3};

/// Where a body is, how it is turned, how it moves, and its angular momentum along the world's axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Of the centre of mass.
    pub position: DVec3,
    /// Body to world.
    pub rotation: DQuat,
    /// Of the centre of mass.
    pub velocity: DVec3,
    /// Angular momentum about the centre of mass, along the world's axes.
    pub momentum: DVec3,
}

impl State {
    /// Angular velocity along the world's axes, of a body of some moments of inertia about its axes.
    pub fn angvel(&self, moments: DVec3) -> DVec3 {
        self.rotation * ((self.rotation.inverse() * self.momentum) / moments)
    }

    /// The angle between two attitudes, by its sine: by its cosine half of the digits are lost.
    pub fn angle_to(&self, other: &State) -> f64 {
        let between = self.rotation * other.rotation.inverse();
        2.0 * between.xyz().length().min(1.0).asin()
    }

    /// After a time `h` at some rate.
    pub fn moved(&self, rate: &State, h: f64) -> State {
        State {
            position: self.position + rate.position * h,
            rotation: self.rotation + rate.rotation * h,
            velocity: self.velocity + rate.velocity * h,
            momentum: self.momentum + rate.momentum * h,
        }
    }
}
