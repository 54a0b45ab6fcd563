//! The touches of a step with the paths that led to them, for the cross-check.

use super::field_contact::FieldContact;
use super::moving_shape::MovingShape;
use super::trajectory::BodyPath;
use crate::math::{ColliderHandle, DPose3, DQuat, DVec3, RigidBodyHandle, Vector};

/// A touch, and the paths that led to it. All of it is in world space.
#[derive(Clone, Debug)]
pub(crate) struct TouchRecord {
    /// In the order of their handles, like `ways`.
    pub colliders: [ColliderHandle; 2],
    pub world_point: Vector,
    /// Unit vector from the first collider to the second.
    pub world_normal: Vector,
    /// Time since the step began.
    pub time: f64,
    pub ways: [TouchWay; 2],
}

/// The path of a part to a touch, and beyond it as if the touch were not answered. Times are since the step began.
#[derive(Clone, Debug)]
pub(crate) struct TouchWay {
    pub body: Option<RigidBodyHandle>,
    /// True if it is the path of Rapier's step, which no impact has changed yet.
    pub whole: bool,
    path: BodyPath,
    /// The vector from the centre of mass to the collider's frame, and the rotation of that frame, in the body's axes.
    arm: DVec3,
    own: DQuat,
}

impl TouchRecord {
    /// The record that two parts touch at a moment.
    pub(super) fn of(parts: [MovingShape<'_>; 2], contact: &FieldContact, time: f64) -> Self {
        let mut ways = parts.map(TouchWay::of);
        if contact.colliders[0] != parts[0].member.part.collider {
            ways.swap(0, 1);
        }
        TouchRecord {
            colliders: contact.colliders,
            world_point: contact.world_point,
            world_normal: contact.world_normal,
            time,
            ways,
        }
    }

    /// The time since which both paths hold.
    pub(crate) fn from(&self) -> f64 {
        let [one, two] = &self.ways;
        one.from().max(two.from())
    }
}

impl TouchWay {
    fn of(part: MovingShape<'_>) -> Self {
        TouchWay {
            body: part.track.body,
            whole: part.track.generation == 0,
            path: part.track.path.clone(),
            arm: part.member.arm,
            own: part.member.rotation,
        }
    }

    /// The time at which it begins.
    pub(crate) fn from(&self) -> f64 {
        self.path.from
    }

    /// The pose of the collider's frame at a moment.
    pub(crate) fn frame(&self, time: f64) -> DPose3 {
        self.path.frame(time, self.arm, self.own)
    }

    /// The centre of mass and the attitude of the body at a moment.
    pub(crate) fn body_frame(&self, time: f64) -> DPose3 {
        DPose3::from_parts(self.path.com(time), self.path.attitude(time))
    }
}

#[cfg(test)]
mod altered {
    use super::*;
    use crate::contact::trajectory::Turn;
    use crate::rigid::Rotor;

    impl TouchWay {
        /// The path of a part at an arm on a body that tumbles freely and is pulled, over a whole step.
        pub(crate) fn tumbling(
            body: Option<RigidBodyHandle>,
            [com, linvel, acceleration]: [DVec3; 3],
            (rotor, attitude, angvel): (Rotor, DQuat, DVec3),
            arm: DVec3,
            dt: f64,
        ) -> Self {
            TouchWay {
                body,
                whole: true,
                path: BodyPath {
                    from: 0.0,
                    com,
                    linvel,
                    acceleration,
                    jerk: DVec3::ZERO,
                    turn: Turn::new(&rotor, attitude, angvel, [0.0, dt], true),
                    bend: None,
                },
                arm,
                own: DQuat::IDENTITY,
            }
        }

        /// Moves the centre, and adds to its velocity and acceleration.
        pub(crate) fn shift(&mut self, place: DVec3, linvel: DVec3, acceleration: DVec3) {
            self.path.com += place;
            self.path.linvel += linvel;
            self.path.acceleration += acceleration;
        }

        /// Replaces the rotation by a steady one with the initial angular velocity.
        pub(crate) fn straighten(&mut self) {
            let attitude = self.path.attitude(0.0);
            let angvel = self.path.angvel(0.0, attitude);
            self.path.turn = Turn::Steady { attitude, angvel };
        }

        /// The path from a moment on, displaced by `leap`.
        pub(crate) fn anew(self, from: f64, leap: DVec3) -> Self {
            let path = BodyPath {
                from,
                com: self.path.com(from) + leap,
                linvel: self.path.velocity(from),
                ..self.path
            };
            TouchWay {
                whole: false,
                path,
                ..self
            }
        }
    }
}
