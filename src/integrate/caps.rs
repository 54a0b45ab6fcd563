//! Velocities that Rapier will reduce without a report of its own, and places too far from the origin.

use super::stiffness::StepWarning;
use crate::math::{Real, RigidBodyHandle, Vector, from_f64};
use crate::rapier::dynamics::{IntegrationParameters, RigidBody, RigidBodyActivation};

/// A way of this many roundings of a position is exact enough.
const FINE: Real = 10.0;

/// The coordinate from which on a body is too far from the origin: the speed below which Rapier lets bodies sleep moves
/// it by less than the distance of neighbouring numbers in a step.
fn farthest(parameters: &IntegrationParameters) -> Real {
    let resting = RigidBodyActivation::default_normalized_linear_threshold();
    let way = resting * parameters.length_unit * parameters.dt;
    if way > 0.0 {
        way / Real::EPSILON
    } else {
        Real::INFINITY
    }
}

/// The limits of velocities and positions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Caps {
    /// The speed to which Rapier reduces velocities.
    pub speed: Real,
    /// See [`farthest`].
    pub farthest: Real,
    pub dt: Real,
}

impl Caps {
    /// No limits.
    pub(crate) const NONE: Caps = Caps {
        speed: Real::MAX,
        farthest: Real::MAX,
        dt: 0.0,
    };

    /// The limits in a step with these parameters.
    pub(crate) fn new(parameters: &IntegrationParameters) -> Self {
        Caps {
            speed: parameters.max_linear_velocity(),
            farthest: farthest(parameters),
            dt: parameters.dt,
        }
    }

    /// The warning for a body that gets this speed, if it is beyond the limit.
    pub(crate) fn of_speed(self, body: RigidBodyHandle, speed: Real) -> Option<StepWarning> {
        let limit = self.speed;
        (speed > limit).then_some(StepWarning::SpeedCapped { body, speed, limit })
    }

    /// The warning for a body that leaves a place at this velocity, if rounding of its position matters.
    pub(crate) fn of_place(
        self,
        body: RigidBodyHandle,
        place: Vector,
        linvel: Vector,
    ) -> Option<StepWarning> {
        let coordinate = place.abs().max_element();
        if coordinate <= self.farthest {
            return None;
        }
        let (spacing, speed) = (coordinate * Real::EPSILON, linvel.length());
        (speed * self.dt < FINE * spacing).then_some(StepWarning::FarFromOrigin {
            body,
            spacing,
            speed,
        })
    }

    /// The warning for a body that gets this angular speed, if it is beyond the limit.
    pub(crate) fn of_turn(
        self,
        handle: RigidBodyHandle,
        speed: Real,
        body: Option<&RigidBody>,
    ) -> Option<StepWarning> {
        // Rapier's `MAX_ROTATION`, an eighth of a turn per step.
        let limit = from_f64(std::f64::consts::FRAC_PI_4) / self.dt;
        let capped = || body.is_some_and(|body| !body.is_fast_rotation_allowed());
        (speed > limit && capped()).then_some(StepWarning::RotationCapped {
            body: handle,
            speed,
            limit,
        })
    }
}
