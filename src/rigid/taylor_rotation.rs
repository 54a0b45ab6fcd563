//! Torque-free rotation at any moment of a step, to rounding.
//!
//! The search for the time of an impact needs the attitude within a step, whereas [`super::rotation`] gives Rapier the
//! rotation over a whole step. Euler's equations and that of the attitude are polynomials, so their Taylor series
//! follow from products of series. The motion is pieced together from such series.

use super::principal_inertia::PrincipalInertia;
use crate::math::{DQuat, DVec3, to_dquat, to_dvec3};

/// Order of the Taylor series.
const ORDER: usize = 18;

/// A series holds as far as its last terms stay below this.
const SMALLEST_TERM: f64 = 1e-17;

/// The largest number of pieces of one path. A step in which a body turns some thousand times is not followed.
const MOST_PIECES: usize = 8192;

/// The largest number of pieces where only the end of the path is needed: some ten turns.
const MOST_TO_THE_END: usize = 64;

/// The largest number of guesses at a momentum, and the largest angle (rad) between the attitude that the last guess
/// leads to and the wanted one. Each guess is better than the one before by about the square of the angle of the step.
const MOST_TRIES: usize = 32;
const ARRIVED: f64 = 1e-14;

/// The inertia of a body, in the form that its free rotation needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rotor {
    /// Reciprocal principal moments; zero for an axis about which the body cannot turn.
    pub inverse_moments: DVec3,
    pub principal_to_body: DQuat,
}

/// The free rotation of a body over a span of time.
#[derive(Clone, Debug)]
pub(crate) struct Top {
    rotor: Rotor,
    /// Angular momentum in world axes.
    pub(crate) momentum: DVec3,
    from: f64,
    /// The attitude at `from`.
    attitude: DQuat,
    /// Empty if the angular velocity is constant.
    pieces: Vec<SeriesPiece>,
}

/// The attitude (body to world) as a power series in the time since `from`.
#[derive(Clone, Debug)]
struct SeriesPiece {
    from: f64,
    terms: [DQuat; ORDER + 1],
}

impl Rotor {
    /// In 64-bit precision.
    pub(crate) fn of(principal: PrincipalInertia) -> Self {
        Rotor {
            inverse_moments: to_dvec3(principal.inverse),
            principal_to_body: to_dquat(principal.frame),
        }
    }

    /// Returns true if the body can turn about all axes.
    pub(crate) fn is_free(&self) -> bool {
        let moments = self.inverse_moments.recip();
        self.inverse_moments.min_element() > 0.0 && moments.is_finite()
    }

    /// Returns true if the angular velocity of a free rotation is constant.
    fn is_spherical(&self) -> bool {
        let [x, y, z] = self.inverse_moments.to_array();
        x == y && y == z
    }

    pub(super) fn principal_to_world(&self, attitude: DQuat) -> DQuat {
        attitude * self.principal_to_body
    }

    /// The angular momentum, in world axes, of a body at an attitude.
    pub(crate) fn momentum(&self, attitude: DQuat, angvel: DVec3) -> DVec3 {
        let to_world = self.principal_to_world(attitude);
        to_world * ((to_world.inverse() * angvel) / self.inverse_moments)
    }

    /// The angular velocity of a body at an attitude, from its angular momentum; both in world axes.
    pub(crate) fn angvel(&self, attitude: DQuat, momentum: DVec3) -> DVec3 {
        let to_world = self.principal_to_world(attitude);
        to_world * (self.inverse_moments * (to_world.inverse() * momentum))
    }

    /// Twice the kinetic energy of the rotation about the axes about which the body can turn.
    pub(crate) fn twice_energy(&self, attitude: DQuat, angvel: DVec3) -> f64 {
        let angvel = self.principal_to_world(attitude).inverse() * angvel;
        let axes = angvel
            .to_array()
            .into_iter()
            .zip(self.inverse_moments.to_array());
        let free = axes.filter(|(_, inverse)| *inverse > 0.0);
        free.map(|(angvel, inverse)| angvel * angvel / inverse)
            .sum()
    }

    /// Upper bounds of the angular speed and the angular acceleration of a free rotation.
    fn bounds(&self, attitude: DQuat, momentum: DVec3) -> [f64; 2] {
        let fastest = self.inverse_moments.max_element();
        let twice_energy = momentum.dot(self.angvel(attitude, momentum));
        let speed = (momentum.length() * fastest).min((twice_energy * fastest).max(0.0).sqrt());
        let moments = self.inverse_moments.recip();
        let spread = |i: usize, j: usize, k: usize| {
            (moments[j] - moments[k]).abs() * self.inverse_moments[i]
        };
        let coupling = spread(0, 1, 2).max(spread(1, 2, 0)).max(spread(2, 0, 1));
        // The squares of the products of two different components of a vector add up to at most a third of the fourth
        // power of its length.
        [speed, coupling * speed * speed / 3_f64.sqrt()]
    }

    /// The attitude after a free rotation over `dt`, which may be negative, as a series whose omitted terms are
    /// below `smallest`; `None` if the body turns too often to follow.
    pub(crate) fn attitude_after(
        &self,
        attitude: DQuat,
        momentum: DVec3,
        dt: f64,
        smallest: f64,
    ) -> Option<DQuat> {
        let (mut attitude, mut left) = (attitude, dt);
        for _ in 0..MOST_TO_THE_END {
            let terms = self.series(attitude, momentum, left.abs(), smallest);
            let piece = SeriesPiece { from: 0.0, terms };
            let reach = piece.reach(smallest);
            if reach.is_nan() || reach <= 0.0 {
                return None;
            }
            let step = left.clamp(-reach, reach);
            attitude = piece.attitude(step);
            left -= step;
            if left == 0.0 {
                return Some(attitude);
            }
        }
        None
    }

    /// The angular momentum, near a guess, of the free rotation from one attitude to another over `dt`; `None`
    /// if the iteration does not converge from the guess.
    pub(crate) fn momentum_between(
        &self,
        [from, to]: [DQuat; 2],
        guess: DVec3,
        dt: f64,
    ) -> Option<DVec3> {
        let (mut momentum, midway) = (guess, from.slerp(to, 0.5));
        for _ in 0..MOST_TRIES {
            let reached = self.attitude_after(from, momentum, dt, SMALLEST_TERM)?;
            let missing = to * reached.inverse();
            let missing = if missing.w < 0.0 { -missing } else { missing };
            // The scaled axis of the missing rotation, if that is small.
            let missing = missing.xyz() * 2.0;
            if missing.length() <= ARRIVED {
                return Some(momentum);
            }
            momentum += self.momentum(midway, missing / dt);
        }
        None
    }

    /// The Taylor series of the attitude, up to the last term above `smallest` within `span`.
    fn series(
        &self,
        attitude: DQuat,
        momentum: DVec3,
        span: f64,
        smallest: f64,
    ) -> [DQuat; ORDER + 1] {
        let inverse = self.inverse_moments;
        let moments = inverse.recip();
        let coupling = DVec3::new(
            moments.y - moments.z,
            moments.z - moments.x,
            moments.x - moments.y,
        ) * inverse;
        let start = self.principal_to_world(attitude);
        let mut angvel = [DVec3::ZERO; ORDER + 1];
        let mut to_world = [DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0); ORDER + 1];
        angvel[0] = inverse * (start.inverse() * momentum);
        to_world[0] = start;
        let (mut power, mut last) = (1.0, f64::INFINITY);
        for k in 0..ORDER {
            let (mut swirl, mut turn) = (DVec3::ZERO, DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0));
            for i in 0..=k {
                let (a, b) = (angvel[i], angvel[k - i]);
                swirl += DVec3::new(a.y * b.z, a.z * b.x, a.x * b.y);
                let spin = DQuat::from_xyzw(b.x, b.y, b.z, 0.0);
                turn += product(to_world[i], spin);
            }
            let next = 1.0 / (k as f64 + 1.0);
            angvel[k + 1] = coupling * swirl * next;
            to_world[k + 1] = turn * (0.5 * next);
            power *= span;
            let size = to_world[k + 1].length() * power;
            // Two terms, since every other term of a series may be zero.
            if size.max(last) < smallest {
                break;
            }
            last = size;
        }
        let back = self.principal_to_body.inverse();
        to_world.map(|term| product(term, back))
    }
}

/// Hamilton's product of quaternions that need not be rotations.
fn product(a: DQuat, b: DQuat) -> DQuat {
    let (u, v) = (a.xyz(), b.xyz());
    let vector = v * a.w + u * b.w + u.cross(v);
    DQuat::from_xyzw(vector.x, vector.y, vector.z, a.w * b.w - u.dot(v))
}

impl Top {
    /// The free rotation of a body over `[from, to]`, from its attitude at `from` on. `None` if it turns too
    /// often to follow.
    pub(crate) fn new(
        rotor: Rotor,
        attitude: DQuat,
        momentum: DVec3,
        [from, to]: [f64; 2],
    ) -> Option<Self> {
        let mut top = Top {
            rotor,
            momentum,
            from,
            attitude,
            pieces: Vec::new(),
        };
        if rotor.is_spherical() {
            return momentum.is_finite().then_some(top);
        }
        let (mut from, mut attitude) = (from, attitude);
        loop {
            let terms = rotor.series(attitude, momentum, to - from, SMALLEST_TERM);
            let piece = SeriesPiece { from, terms };
            let reach = piece.reach(SMALLEST_TERM);
            top.pieces.push(piece);
            // False for NaN, too.
            let finished = from + reach >= to;
            if finished {
                return Some(top);
            }
            if top.pieces.len() >= MOST_PIECES || reach.is_nan() || from + reach <= from {
                return None;
            }
            from += reach;
            attitude = top.attitude(from);
        }
    }

    /// The number of series of which it consists.
    pub(crate) fn pieces(&self) -> usize {
        self.pieces.len()
    }

    /// The rotation from body to world at a time.
    pub(crate) fn attitude(&self, time: f64) -> DQuat {
        if self.pieces.is_empty() {
            let angvel = self.rotor.angvel(self.attitude, self.momentum);
            return DQuat::from_scaled_axis(angvel * (time - self.from)) * self.attitude;
        }
        let after = self.pieces.partition_point(|piece| piece.from <= time);
        let piece = &self.pieces[after.saturating_sub(1)];
        piece.attitude(time - piece.from)
    }

    /// The angular velocity, in world axes, given the attitude.
    pub(crate) fn angvel(&self, attitude: DQuat) -> DVec3 {
        self.rotor.angvel(attitude, self.momentum)
    }

    /// Upper bounds of the angular speed and the angular acceleration.
    pub(crate) fn bounds(&self) -> [f64; 2] {
        self.rotor.bounds(self.attitude, self.momentum)
    }
}

impl SeriesPiece {
    fn attitude(&self, since: f64) -> DQuat {
        let mut sum = self.terms[ORDER];
        for term in self.terms[..ORDER].iter().rev() {
            sum = sum * since + *term;
        }
        sum.normalize()
    }

    /// The time since `from` up to which the series holds: until one of its last two terms reaches `smallest`.
    /// Two, since every other term of a series may be zero.
    fn reach(&self, smallest: f64) -> f64 {
        let until = |order: usize| {
            let size = self.terms[order].length();
            (smallest / size).powf(1.0 / order as f64)
        };
        until(ORDER).min(until(ORDER - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rotor(moments: [f64; 3]) -> Rotor {
        Rotor {
            inverse_moments: DVec3::from_array(moments).recip(),
            principal_to_body: DQuat::from_xyzw(0.1, -0.4, 0.2, 0.7).normalize(),
        }
    }

    const START: DQuat = DQuat::from_xyzw(0.5, -0.5, 0.5, 0.5);

    #[test]
    fn a_ball_turns_at_a_constant_angular_velocity() {
        let (rotor, angvel) = (rotor([2.0; 3]), DVec3::new(3.0, -40.0, 12.0));
        let top = Top::new(rotor, START, angvel * 2.0, [0.5, 1.5]).expect("a path");
        for time in [0.5, 0.51, 0.9, 1.5] {
            let expected = DQuat::from_scaled_axis(angvel * (time - 0.5)) * START;
            let error = expected.angle_between(top.attitude(time)).min(1.0);
            assert!(error < 1e-7, "angle_between rounds to 1e-8: {error}");
            let error = (expected * DVec3::X - top.attitude(time) * DVec3::X).length();
            assert!(error < 2e-13, "{error:e} at {time}");
            assert!((top.angvel(expected) - angvel).length() < 1e-13 * angvel.length());
        }
    }

    /// The derivative of the attitude along the path agrees with the angular velocity, and the energy is conserved.
    #[test]
    fn an_asymmetric_top_obeys_eulers_equations() {
        let rotor = rotor([0.7, 1.1, 1.5]);
        let momentum = DVec3::new(30.0, 5.0, -20.0);
        let top = Top::new(rotor, START, momentum, [0.0, 1.0]).expect("a path");
        assert!(top.pieces.len() > 50, "{}", top.pieces.len());
        let energy = |time: f64| momentum.dot(top.angvel(top.attitude(time)));
        let [fastest, hardest] = top.bounds();
        for k in 0..=100 {
            let time = 0.005 + k as f64 * 0.0099;
            assert!((energy(time) / energy(0.0) - 1.0).abs() < 1e-13);
            let spin = top.angvel(top.attitude(time));
            let h = 1e-5;
            let [before, after] = [-h, h].map(|d| top.attitude(time + d));
            for axis in DVec3::AXES {
                let rate = (after * axis - before * axis) / (2.0 * h);
                let expected = spin.cross(top.attitude(time) * axis);
                // Central differences: w³ h² / 6.
                assert!((rate - expected).length() < 1e-5, "{rate} {expected}");
            }
            let change = top.angvel(after) - top.angvel(before);
            assert!(spin.length() <= fastest * (1.0 + 1e-12));
            assert!(change.length() / (2.0 * h) <= hardest);
        }
    }

    #[test]
    fn the_momentum_between_two_attitudes_is_found() {
        let rotor = rotor([0.7, 1.1, 1.5]);
        let momentum = DVec3::new(3.0, 0.5, -2.0);
        for dt in [1e-3, 0.05, 0.2] {
            let to = rotor.attitude_after(START, momentum, dt, SMALLEST_TERM);
            let guess = momentum + DVec3::new(0.1, -0.2, 0.15);
            let found = rotor.momentum_between([START, to.expect("an attitude")], guess, dt);
            let error = (found.expect("a momentum") - momentum).length();
            assert!(error < 1e-12 / dt, "{error:e} over {dt}");
        }
    }

    #[test]
    fn a_top_that_turns_too_often_or_is_not_finite_has_no_path() {
        assert!(Top::new(rotor([1.0, 2.0, 3.0]), START, DVec3::X * 1e9, [0.0, 1.0]).is_none());
        assert!(Top::new(rotor([1.0; 3]), START, DVec3::X * f64::NAN, [0.0, 1.0]).is_none());
    }
}
