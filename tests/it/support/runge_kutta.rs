//! The classical Runge-Kutta scheme for rigid bodies.

use rapier3d_fields::math::{DQuat, DVec3};

/// The place, attitude, velocity and angular momentum of a body; or their time derivatives.
#[derive(Clone, Copy, Debug)]
pub struct State {
    pub place: DVec3,
    pub attitude: DQuat,
    pub velocity: DVec3,
    pub momentum: DVec3,
}

impl State {
    fn moved(&self, rate: &State, h: f64) -> State {
        State {
            place: self.place + rate.place * h,
            attitude: self.attitude + rate.attitude * h,
            velocity: self.velocity + rate.velocity * h,
            momentum: self.momentum + rate.momentum * h,
        }
    }

    /// The derivative of the attitude at an angular velocity.
    pub fn turning(&self, spin: DVec3) -> DQuat {
        DQuat::from_xyzw(spin.x, spin.y, spin.z, 0.0) * self.attitude * 0.5
    }

    /// The sum of the differences of two states. `spins` are their angular velocities.
    pub fn distance(&self, other: &State, spins: [DVec3; 2]) -> f64 {
        // The angle by its sine: by the cosine, half of the digits would be lost.
        let turn = 2.0 * (self.attitude * other.attitude.inverse()).xyz().length();
        let place = self.place.distance(other.place);
        place + self.velocity.distance(other.velocity) + turn + spins[0].distance(spins[1])
    }
}

/// Moves bodies from a time to `h` later; `rates` are the derivatives of their states at a time.
pub fn step(states: &mut [State], time: f64, h: f64, rates: impl Fn(&[State], f64) -> Vec<State>) {
    let at = |states: &[State], rates: &[State], h: f64| -> Vec<State> {
        let all = states.iter().zip(rates);
        all.map(|(state, rate)| state.moved(rate, h)).collect()
    };
    let first = rates(states, time);
    let second = rates(&at(states, &first, 0.5 * h), time + 0.5 * h);
    let third = rates(&at(states, &second, 0.5 * h), time + 0.5 * h);
    let fourth = rates(&at(states, &third, h), time + h);
    for (body, state) in states.iter_mut().enumerate() {
        *state = state.moved(&first[body], h / 6.0);
        *state = state.moved(&second[body], h / 3.0);
        *state = state.moved(&third[body], h / 3.0);
        *state = state.moved(&fourth[body], h / 6.0);
        state.attitude = state.attitude.normalize();
    }
}
