//! The predicted frames of bodies within a step that Rapier has not made yet.

use super::context::StepContext;
use crate::field::{Anchor, Frame, Frames};
use crate::math::{DQuat, DVec3, Pose, RigidBodyHandle, Rotation, to_dquat};
use crate::math::{Vector, from_dvec3, from_f64, to_dvec3, to_f64};
use crate::rapier::dynamics::{RigidBody, RigidBodyType};
use crate::rigid::{Lookup, RigidState, is_sound, world_com};

/// The predicted motion of a body within a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum PredictedMotion {
    /// It moves on with its velocity.
    #[default]
    Coasts,
    /// It moves on with this velocity.
    CoastsAt { linvel: Vector, angvel: Vector },
    /// Its state is the one of this number.
    Moves(u32),
}

/// The predicted motions by the index of a body; bodies beyond the end coast.
#[derive(Debug, Default)]
pub(super) struct PredictedMotions(Vec<PredictedMotion>);

impl PredictedMotions {
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Sets the motion of a body.
    pub(super) fn assign(&mut self, body: RigidBodyHandle, motion: PredictedMotion) {
        let index = body.into_raw_parts().0 as usize;
        if self.0.len() <= index {
            self.0.resize(index + 1, PredictedMotion::default());
        }
        self.0[index] = motion;
    }

    /// The frames of all anchors, some time into the step.
    pub(super) fn frames<'a, W: Lookup>(
        &'a self,
        context: &StepContext<'a, W>,
        states: &'a [RigidState],
        elapsed: f64,
    ) -> PredictedFrames<'a, W> {
        PredictedFrames {
            world: context.world,
            motions: &self.0,
            states,
            elapsed,
            dt: to_f64(context.dt),
        }
    }
}

/// The world some time into its step.
pub(super) struct PredictedFrames<'a, W> {
    world: &'a W,
    motions: &'a [PredictedMotion],
    states: &'a [RigidState],
    elapsed: f64,
    /// The length of the whole step.
    dt: f64,
}

impl<W: Lookup> PredictedFrames<'_, W> {
    fn of_body(&self, handle: RigidBodyHandle) -> Option<Frame> {
        let body = self.world.body(handle).filter(|body| is_sound(body))?;
        let motion = self.motions.get(handle.into_raw_parts().0 as usize);
        let state = match motion {
            Some(PredictedMotion::Moves(state)) => self.states.get(*state as usize),
            _ => None,
        };
        let frame = match (motion, state) {
            (_, Some(it)) => frame(it.position, it.attitude, it.local_com, it.linvel, it.angvel),
            // If the time is before the present, the body has been moved to its next position already.
            _ if body.body_type() == RigidBodyType::KinematicPositionBased
                && self.elapsed >= 0.0 =>
            {
                self.led(body)
            }
            (Some(PredictedMotion::CoastsAt { linvel, angvel }), _) => {
                self.coasting(body, *linvel, *angvel)
            }
            _ => self.coasting(body, body.linvel(), body.angvel()),
        };
        Some(Frame {
            body: Some(handle),
            ..frame
        })
    }

    fn coasting(&self, body: &RigidBody, linvel: Vector, angvel: Vector) -> Frame {
        if self.elapsed == 0.0 {
            // The exact pose, because boundaries are compared exactly.
            let velocity = if angvel == Vector::ZERO {
                linvel
            } else {
                linvel + angvel.cross(body.translation() - world_com(body))
            };
            return Frame {
                velocity,
                angvel,
                ..Frame::at_rest(*body.position())
            };
        }
        let attitude = to_dquat(*body.rotation());
        let local_com = if angvel == Vector::ZERO {
            DVec3::ZERO
        } else {
            to_dvec3(body.local_center_of_mass())
        };
        let (linvel, angvel) = (to_dvec3(linvel), to_dvec3(angvel));
        let com = to_dvec3(body.translation()) + attitude * local_com;
        let turn = DQuat::from_scaled_axis(angvel * self.elapsed);
        let com = com + linvel * self.elapsed;
        frame(com, turn * attitude, local_com, linvel, angvel)
    }

    /// The frame of a position-based kinematic body on its way to its next position.
    fn led(&self, body: &RigidBody) -> Frame {
        let (here, there) = (body.position(), body.next_position());
        if self.dt == 0.0 || here == there {
            return Frame::at_rest(*here);
        }
        let part = from_f64(self.elapsed / self.dt);
        let way = there.translation - here.translation;
        let turn = to_dquat(there.rotation) * to_dquat(here.rotation).inverse();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let angvel = turn.to_scaled_axis() / self.dt;
        Frame {
            pose: Pose::from_parts(
                here.translation + way * part,
                from_dquat(
                    DQuat::from_scaled_axis(angvel * self.elapsed) * to_dquat(here.rotation),
                ),
            ),
            velocity: way / from_f64(self.dt),
            angvel: from_dvec3(angvel),
            body: None,
            collider: None,
        }
    }
}

/// The frame of a body from the motion of its centre of mass.
fn frame(com: DVec3, attitude: DQuat, local_com: DVec3, linvel: DVec3, angvel: DVec3) -> Frame {
    let arm = attitude * -local_com;
    Frame {
        pose: Pose::from_parts(from_dvec3(com + arm), from_dquat(attitude)),
        velocity: from_dvec3(linvel + angvel.cross(arm)),
        angvel: from_dvec3(angvel),
        body: None,
        collider: None,
    }
}

pub(super) fn from_dquat(q: DQuat) -> Rotation {
    let [x, y, z, w] = q.to_array().map(from_f64);
    Rotation::from_xyzw(x, y, z, w)
}

impl<W: Lookup> Frames for PredictedFrames<'_, W> {
    fn frame(&self, anchor: &Anchor) -> Option<Frame> {
        anchor.frame(|body| self.of_body(body), |it| self.world.collider(it))
    }
}
