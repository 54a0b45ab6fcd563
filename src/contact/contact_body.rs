//! A body for the contact laws: its velocities at the moment of an answer, and its response to impulses.

use super::starts::{BodyStart, pivot};
use crate::math::{DQuat, DVec3, Vector, to_dpose3, to_dvec3};
use crate::rapier::dynamics::{LockedAxes, RigidBody};
use crate::rigid::{PrincipalInertia, Rotor};

/// The response of a body to impulses, without its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resistance {
    /// Per world axis; zero along locked axes, and for bodies that no impulse moves.
    pub inverse_mass: DVec3,
    pub rotor: Rotor,
    /// Per world axis: one if the body may rotate about it, else zero.
    pub may_turn: DVec3,
}

/// A body in a response, in world axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactBody {
    pub resistance: Resistance,
    /// Its centre of mass; for a body that is not dynamic, its [pivot].
    pub com: DVec3,
    pub attitude: DQuat,
    pub linvel: DVec3,
    pub angvel: DVec3,
    /// Its acceleration within the step, by which a resting contact is loaded.
    pub acceleration: DVec3,
    pub pushed: bool,
}

impl Resistance {
    pub(super) fn of(body: &RigidBody) -> Self {
        let properties = body.mass_properties();
        let locked = body.locked_axes();
        let free = |axis: LockedAxes| f64::from(u8::from(!locked.contains(axis)));
        let may_turn = DVec3::new(
            free(LockedAxes::ROTATION_LOCKED_X),
            free(LockedAxes::ROTATION_LOCKED_Y),
            free(LockedAxes::ROTATION_LOCKED_Z),
        );
        let rotor = if body.is_dynamic() {
            Rotor::of(PrincipalInertia::of(&properties.local_mprops))
        } else {
            // For an open mesh both may be NaN.
            Rotor {
                inverse_moments: DVec3::ZERO,
                principal_to_body: DQuat::IDENTITY,
            }
        };
        Resistance {
            inverse_mass: to_dvec3(properties.effective_inv_mass),
            rotor,
            may_turn,
        }
    }
}

impl ContactBody {
    /// A body on the parabola along which Rapier moves it; `linvel` is the velocity of its pivot.
    pub(super) fn pressed(body: &RigidBody, start: &BodyStart, linvel: Vector) -> Self {
        let pose = to_dpose3(body.position());
        let resistance = Resistance::of(body);
        let behind = start.turn.map_or(DVec3::ZERO, |turn| turn.behind);
        ContactBody {
            com: pose.transform_point(to_dvec3(pivot(body))),
            attitude: pose.rotation,
            linvel: to_dvec3(linvel) + to_dvec3(start.behind),
            angvel: to_dvec3(body.angvel()) + resistance.rotor.angvel(pose.rotation, behind),
            acceleration: to_dvec3(start.acceleration()),
            pushed: false,
            resistance,
        }
    }

    pub(super) fn velocity_at(&self, point: DVec3) -> DVec3 {
        self.linvel + self.angvel.cross(point - self.com)
    }

    /// The change of angular velocity by an angular impulse, in world axes.
    fn twist(&self, angular_impulse: DVec3) -> DVec3 {
        let Resistance {
            rotor, may_turn, ..
        } = &self.resistance;
        rotor.angvel(self.attitude, angular_impulse * *may_turn) * *may_turn
    }

    /// The angular impulse of an impulse at `point`; zero if it is within the rounding of the places, so that a ball
    /// that is swept into another without friction does not begin to spin. Points that Parry finds are rounded to
    /// [`Real`](crate::math::Real), and may still make it spin.
    fn angular_impulse(&self, point: DVec3, impulse: DVec3) -> DVec3 {
        let turning = (point - self.com).cross(impulse);
        let places = point.length_squared() + self.com.length_squared();
        let rounding = 8.0 * f64::EPSILON;
        let small = rounding * rounding * places * impulse.length_squared();
        if turning.length_squared() <= small {
            DVec3::ZERO
        } else {
            turning
        }
    }

    /// The velocity change that an impulse at `point` gives the body at `there`.
    pub(super) fn answer(&self, there: DVec3, point: DVec3, impulse: DVec3) -> DVec3 {
        let twist = self.twist(self.angular_impulse(point, impulse));
        impulse * self.resistance.inverse_mass + twist.cross(there - self.com)
    }

    /// Mass along the free axes; zero for a fixed body.
    pub(super) fn mass(&self) -> f64 {
        let inverse = self.resistance.inverse_mass.max_element();
        if inverse > 0.0 { inverse.recip() } else { 0.0 }
    }

    pub(super) fn push(&mut self, point: DVec3, impulse: DVec3) {
        let kick = impulse * self.resistance.inverse_mass;
        let twist = self.twist(self.angular_impulse(point, impulse));
        self.linvel = added(self.linvel, kick);
        self.angvel = added(self.angvel, twist);
        // A body whose centre cannot move may still rotate.
        self.pushed |= kick != DVec3::ZERO || twist != DVec3::ZERO;
    }
}

/// The sum of two vectors. Axes that cancel to rounding are set to zero, so that a stopped ball stands still.
fn added(a: DVec3, b: DVec3) -> DVec3 {
    let axis = |a: f64, b: f64| {
        let sum = a + b;
        if sum.abs() <= 2.0 * f64::EPSILON * a.abs() {
            0.0
        } else {
            sum
        }
    };
    DVec3::new(axis(a.x, b.x), axis(a.y, b.y), axis(a.z, b.z))
}
