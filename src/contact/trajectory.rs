//! The motion of a body within a step, in 64 bits and world axes.

use crate::math::{DPose3, DQuat, DVec3};
use crate::rigid::{Rotor, Top};

/// The motion of a body from some moment of a step to its end: its centre of mass on a parabola, or on a cubic where
/// the change of its acceleration is known; its rotation free or steady, with a correction for torque. Times are since
/// the step began.
#[derive(Clone, Debug)]
pub(super) struct BodyPath {
    pub from: f64,
    /// The centre of mass at the time `from`.
    pub com: DVec3,
    /// At the time `from`.
    pub linvel: DVec3,
    /// At the time `from`.
    pub acceleration: DVec3,
    pub jerk: DVec3,
    pub turn: Turn,
    /// The correction of the rotation by a torque.
    pub bend: Option<Bend>,
}

/// The rotation by an angular acceleration, on top of a rotation that has the same ends without it: as a parabola, or a
/// cubic, stands above its chord.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bend {
    /// In the middle of the span.
    pub acceleration: DVec3,
    pub jerk: DVec3,
    pub span: [f64; 2],
}

/// The rotation of a body without the correction by a torque.
#[derive(Clone, Debug)]
pub(super) enum Turn {
    /// With a constant angular velocity.
    Steady {
        attitude: DQuat,
        angvel: DVec3,
    },
    Free(Top),
}

/// Upper bounds for a path's rotation.
#[derive(Clone, Copy, Debug)]
pub(super) struct RotationBounds {
    pub angvel: f64,
    /// Of the acceleration of a point at distance one from the centre of mass.
    pub acceleration: f64,
}

impl Bend {
    /// The time since the middle of the span, and half the span's length.
    fn since_middle(&self, time: f64) -> [f64; 2] {
        let [from, to] = self.span;
        [time - 0.5 * (from + to), 0.5 * (to - from)]
    }

    fn rotation(&self, time: f64) -> DQuat {
        let [from, to] = self.span;
        let [since, _] = self.since_middle(time);
        let bent = self.acceleration * 0.5 + self.jerk * (since / 6.0);
        DQuat::from_scaled_axis(bent * ((time - from) * (time - to)))
    }

    pub(super) fn angvel(&self, time: f64) -> DVec3 {
        let [since, half] = self.since_middle(time);
        self.acceleration * since + self.jerk * (0.5 * since * since - half * half / 6.0)
    }

    pub(super) fn acceleration(&self, time: f64) -> DVec3 {
        self.acceleration + self.jerk * self.since_middle(time)[0]
    }
}

impl Turn {
    /// The rotation that begins with an angular velocity. If `free`, the body follows the torque-free motion of its
    /// inertia, else it keeps its angular velocity.
    pub(super) fn new(
        rotor: &Rotor,
        attitude: DQuat,
        angvel: DVec3,
        span: [f64; 2],
        free: bool,
    ) -> Turn {
        let steady = Turn::Steady { attitude, angvel };
        if !free || angvel == DVec3::ZERO || !rotor.is_free() {
            return steady;
        }
        let momentum = rotor.momentum(attitude, angvel);
        Turn::freely(rotor, attitude, momentum, span).unwrap_or(steady)
    }

    /// The rotation from body to world axes at a time, for a rotation that begins at `from`.
    pub(super) fn attitude(&self, time: f64, from: f64) -> DQuat {
        match self {
            Turn::Steady { attitude, angvel } if *angvel == DVec3::ZERO => *attitude,
            Turn::Steady { attitude, angvel } => {
                DQuat::from_scaled_axis(*angvel * (time - from)) * *attitude
            }
            Turn::Free(top) => top.attitude(time),
        }
    }

    /// The number of series of which it consists; each takes about as long as a look at the gap between two parts.
    pub(super) fn pieces(&self) -> usize {
        match self {
            Turn::Steady { .. } => 0,
            Turn::Free(top) => top.pieces(),
        }
    }

    /// The torque-free rotation with a given angular momentum.
    pub(super) fn freely(
        rotor: &Rotor,
        attitude: DQuat,
        momentum: DVec3,
        span: [f64; 2],
    ) -> Option<Turn> {
        Top::new(*rotor, attitude, momentum, span).map(Turn::Free)
    }
}

impl BodyPath {
    /// The path of a body that stands still from a moment on.
    pub(super) fn still(from: f64, com: DVec3, attitude: DQuat) -> Self {
        BodyPath {
            from,
            com,
            linvel: DVec3::ZERO,
            acceleration: DVec3::ZERO,
            jerk: DVec3::ZERO,
            turn: Turn::Steady {
                attitude,
                angvel: DVec3::ZERO,
            },
            bend: None,
        }
    }

    /// The pose of a frame on the body; `arm` is the vector from the centre of mass to it, and `own` its rotation, in
    /// the body's axes.
    pub(super) fn frame(&self, time: f64, arm: DVec3, own: DQuat) -> DPose3 {
        let attitude = self.attitude(time);
        DPose3::from_parts(self.com(time) + attitude * arm, attitude * own)
    }

    pub(super) fn com(&self, time: f64) -> DVec3 {
        let since = time - self.from;
        let bent = self.acceleration * 0.5 + self.jerk * (since / 6.0);
        self.com + (self.linvel + bent * since) * since
    }

    /// The velocity of the centre of mass.
    pub(super) fn velocity(&self, time: f64) -> DVec3 {
        let since = time - self.from;
        self.linvel + (self.acceleration + self.jerk * (0.5 * since)) * since
    }

    /// The acceleration of the centre of mass.
    pub(super) fn acceleration(&self, time: f64) -> DVec3 {
        self.acceleration + self.jerk * (time - self.from)
    }

    /// The rotation from body to world axes.
    pub(super) fn attitude(&self, time: f64) -> DQuat {
        let unbent = self.turn.attitude(time, self.from);
        self.bend
            .map_or(unbent, |bend| bend.rotation(time) * unbent)
    }

    /// The angular velocity in world axes, given the attitude at the same time.
    pub(super) fn angvel(&self, time: f64, attitude: DQuat) -> DVec3 {
        let unbent = |attitude| match &self.turn {
            Turn::Steady { angvel, .. } => *angvel,
            Turn::Free(top) => top.angvel(attitude),
        };
        self.bend.map_or_else(
            || unbent(attitude),
            |bend| {
                let turned = bend.rotation(time);
                turned * unbent(turned.inverse() * attitude) + bend.angvel(time)
            },
        )
    }

    pub(super) fn bounds(&self) -> RotationBounds {
        let [angvel, spin_up] = match &self.turn {
            Turn::Steady { angvel, .. } => [angvel.length(), 0.0],
            Turn::Free(top) => top.bounds(),
        };
        let Some(Bend {
            acceleration,
            jerk,
            span,
        }) = self.bend
        else {
            return RotationBounds {
                angvel,
                acceleration: angvel * angvel + spin_up,
            };
        };
        let half = 0.5 * (span[1] - span[0]);
        let torque = acceleration.length() + jerk.length() * half;
        let added = torque * half;
        let whole = angvel + added;
        // The bend rotates the unbent angular velocity, which adds `added * angvel`.
        RotationBounds {
            angvel: whole,
            acceleration: whole * whole + spin_up + torque + added * angvel,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_and_accelerations_are_derivatives_of_the_path() {
        let path = BodyPath {
            from: 0.25,
            com: DVec3::new(1.0, -2.0, 0.5),
            linvel: DVec3::new(0.3, 0.7, -1.1),
            acceleration: DVec3::new(-2.0, 0.4, 3.0),
            jerk: DVec3::new(5.0, -7.0, 2.0),
            turn: Turn::Steady {
                attitude: DQuat::from_rotation_x(0.4),
                angvel: DVec3::ZERO,
            },
            bend: Some(Bend {
                acceleration: DVec3::new(0.0, 0.6, 0.0),
                jerk: DVec3::new(0.0, -0.9, 0.0),
                span: [0.25, 1.25],
            }),
        };
        let h = 1e-4;
        for time in [0.25 + h, 0.5, 0.9, 1.25 - h] {
            let rate = |of: &dyn Fn(f64) -> DVec3| (of(time + h) - of(time - h)) / (2.0 * h);
            let close = |a: DVec3, b: DVec3| (a - b).length() < 1e-6;
            assert!(close(rate(&|t| path.com(t)), path.velocity(time)));
            assert!(close(rate(&|t| path.velocity(t)), path.acceleration(time)));
            let attitude = path.attitude(time);
            let turned = rate(&|t| (path.attitude(t) * attitude.inverse()).to_scaled_axis());
            assert!(close(turned, path.angvel(time, attitude)));
            let bend = path.bend.expect("a bend");
            let spun = rate(&|t| path.angvel(t, path.attitude(t)));
            assert!(close(spun, bend.acceleration(time)));
        }
        // A bend changes nothing at the ends.
        for end in [0.25, 1.25] {
            let unbent = DQuat::from_rotation_x(0.4);
            assert!(path.attitude(end).angle_between(unbent) < 1e-12);
        }
    }

    #[test]
    fn rotations_begin_with_their_path() {
        let rotor = Rotor {
            inverse_moments: DVec3::new(1.0, 0.5, 0.4),
            principal_to_body: DQuat::IDENTITY,
        };
        let (attitude, angvel) = (DQuat::from_rotation_x(0.4), DVec3::new(0.4, 3.0, -1.0));
        for free in [false, true] {
            let turn = Turn::new(&rotor, attitude, angvel, [0.25, 1.25], free);
            let at = |time| turn.attitude(time, 0.25) * attitude.inverse();
            let begun = at(0.25).to_scaled_axis();
            assert!(begun.length() < 1e-12, "{free}: {begun}");
            let turned = at(0.25 + 1e-6).to_scaled_axis() / 1e-6;
            assert!((turned - angvel).length() < 1e-4, "{free}: {turned}");
        }
    }

    /// The speed and the acceleration of points on a unit sphere about the centre of mass, by differences.
    #[test]
    fn points_are_no_faster_than_the_bounds() {
        let inertia = Rotor {
            inverse_moments: DVec3::new(1.0, 0.5, 0.4),
            principal_to_body: DQuat::from_rotation_z(0.3),
        };
        let bend = Bend {
            acceleration: DVec3::new(0.3, 0.6, 0.0),
            jerk: DVec3::new(0.0, -0.9, 0.4),
            span: [0.25, 1.25],
        };
        let attitude = DQuat::from_rotation_x(0.4);
        for (free, bend) in [
            (false, None),
            (false, Some(bend)),
            (true, None),
            (true, Some(bend)),
        ] {
            for angvel in [DVec3::ZERO, DVec3::X * 0.1, DVec3::new(0.4, 3.0, -1.0)] {
                let path = BodyPath {
                    turn: Turn::new(&inertia, attitude, angvel, [0.25, 1.25], free),
                    bend,
                    ..BodyPath::still(0.25, DVec3::ZERO, attitude)
                };
                let bounds = path.bounds();
                let h = 1e-4;
                let (mut fastest, mut strongest) = (0.0_f64, 0.0_f64);
                for (time, axis) in (1..40).flat_map(|i| DVec3::AXES.map(|axis| (i, axis))) {
                    let time = 0.25 + f64::from(time) / 40.0;
                    let at = |time: f64| path.attitude(time) * axis;
                    let [before, here, after] = [time - h, time, time + h].map(at);
                    fastest = fastest.max((after - before).length() / (2.0 * h));
                    strongest = strongest.max((after + before - 2.0 * here).length() / (h * h));
                }
                assert!(
                    fastest <= bounds.angvel + 1e-7,
                    "{fastest} {}",
                    bounds.angvel
                );
                let most = bounds.acceleration;
                assert!(
                    strongest <= most + 1e-5,
                    "{free} {bend:?} {angvel}: {strongest} {most}"
                );
                // The bounds are of use.
                assert!(
                    most <= 8.0 * strongest + 1e-5,
                    "{free} {bend:?} {angvel}: {strongest} {most}"
                );
            }
        }
    }
}
