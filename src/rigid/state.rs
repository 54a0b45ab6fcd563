//! The state of a body in substeps of Rapier's step.

use super::body::Body;
use super::mobility::{self, Mobility, TurnedInertia, pair, six};
use super::rotation::Inertia;
use super::slowing::{phi1, stopped};
use super::wrench::Wrench;
use crate::math::{DQuat, DVec3, RigidBodyHandle, to_dquat, to_dvec3, to_f64};
use crate::number::{constant, real};
use crate::rapier::na::Vector6;

/// A body during substeps, in 64-bit precision and world axes.
#[derive(Clone, Debug)]
pub(crate) struct RigidState {
    pub body: RigidBodyHandle,
    /// Position of the centre of mass.
    pub position: DVec3,
    pub attitude: DQuat,
    pub linvel: DVec3,
    pub angvel: DVec3,
    pub local_com: DVec3,
    pub turning: Turning,
    /// The position of the centre of mass, and the attitude, at the start.
    pub start: (DVec3, DQuat),
    /// The velocities at the start, linear and angular.
    pub began: (DVec3, DVec3),
    /// Acceleration apart from fields: by gravity and the user's force, of held bodies also by contacts and joints.
    pub acceleration: DVec3,
    /// Rates of Rapier's damping, linear and angular (1/s).
    pub damping: [f64; 2],
    pub mass: f64,
    /// True if a field has pushed it since the start.
    pub pushed: bool,
    /// The wrench of the latest push: force and torque.
    pub wrench: (DVec3, DVec3),
    inv_mass: DVec3,
    inertia: TurnedInertia,
}

/// The rule by which a body turns between kicks.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Turning {
    /// As a free top with this inertia and angular momentum.
    Free(Inertia, DVec3),
    /// At constant angular velocity.
    Steady,
    /// At Rapier's angular velocity, which kicks do not change: no field can turn bodies, and damping slows nothing.
    LeftAlone,
}

impl RigidState {
    pub(crate) fn new(body: &Body, turns: bool) -> Self {
        let attitude = to_dquat(body.pose.rotation);
        let angvel = to_dvec3(body.angvel);
        let local_com = to_dvec3(body.local_com);
        let position = to_dvec3(body.pose.translation) + attitude * local_com;
        let free = body.gyroscopic.then(|| body.inertia());
        let free = free.flatten().filter(|inertia| !inertia.is_spherical());
        let is_slowed = body.damping[1] != 0.0 && angvel != DVec3::ZERO;
        let turning = match free {
            _ if !turns && !is_slowed => Turning::LeftAlone,
            Some(inertia) => Turning::Free(inertia, inertia.angular_momentum(attitude, angvel)),
            None => Turning::Steady,
        };
        RigidState {
            body: body.handle,
            position,
            attitude,
            linvel: to_dvec3(body.linvel),
            angvel,
            local_com,
            turning,
            start: (position, attitude),
            began: (to_dvec3(body.linvel), angvel),
            acceleration: DVec3::ZERO,
            damping: body.damping.map(to_f64),
            mass: to_f64(body.mass),
            pushed: false,
            wrench: (DVec3::ZERO, DVec3::ZERO),
            inv_mass: to_dvec3(body.inv_mass),
            inertia: mobility::turned_inertia(body),
        }
    }

    /// The response of the body to a wrench at its present attitude.
    pub(crate) fn mobility(&self) -> Mobility {
        Mobility {
            inv_mass: self.inv_mass,
            inv_inertia: self.inertia.at(self.attitude),
        }
    }

    /// Moves the body for the time `h` without forces. A free rotation keeps its energy within `energy_error`.
    pub(crate) fn drift(&mut self, h: f64, energy_error: f64) {
        self.position += self.linvel * h;
        self.rotate(h, energy_error);
    }

    fn rotate(&mut self, h: f64, energy_error: f64) {
        match self.turning {
            Turning::Free(inertia, momentum) => {
                let turn = inertia.free_rotation_within(self.attitude, momentum, h, energy_error);
                self.attitude = (turn * self.attitude).normalize();
                self.angvel = inertia.angvel_after(self.attitude, momentum);
            }
            Turning::Steady | Turning::LeftAlone => {
                let turn = DQuat::from_scaled_axis(self.angvel * h);
                self.attitude = (turn * self.attitude).normalize();
            }
        }
    }

    /// Moves the body for the time `h` under its damping alone. A free rotation under damping takes the path of the
    /// undamped one, more and more slowly.
    pub(crate) fn coast(&mut self, h: f64, energy_error: f64) {
        if self.damping == [0.0; 2] {
            return self.drift(h, energy_error);
        }
        let [linear, angular] = self.damping;
        self.position += self.linvel * (h * phi1(-linear * h));
        let way = match self.turning {
            Turning::LeftAlone => h,
            _ => h * phi1(-angular * h),
        };
        self.rotate(way, energy_error);
        self.damp(h);
    }

    /// Displaces the body by `square`, the square of a time, times its accelerations by a wrench and apart from fields.
    pub(crate) fn shift(&mut self, wrench: Vector6<f64>, square: f64) {
        let (linear, angular) = pair(&self.mobility().apply(&wrench));
        self.position += (linear + self.acceleration) * square;
        if !matches!(self.turning, Turning::LeftAlone) {
            let turn = DQuat::from_scaled_axis(angular * square);
            self.attitude = (turn * self.attitude).normalize();
        }
    }

    /// Advances the velocities by the time `lag`, by which Rapier's are behind, under a wrench and the acceleration
    /// apart from fields. The result counts as the velocities at the start.
    pub(crate) fn catch_up(&mut self, wrench: Wrench, lag: f64) {
        let (force, torque) = (to_dvec3(wrench.force), to_dvec3(wrench.torque));
        self.kick(force * lag, torque * lag);
        self.linvel += self.acceleration * lag;
        self.began = (self.linvel, self.angvel);
    }

    /// The state with velocities, linear and angular, that are behind by the time `lag` under the last wrench.
    pub(crate) fn behind(&self, lag: f64) -> Self {
        let mut shown = self.clone();
        let (force, torque) = self.wrench;
        shown.kick(force * -lag, torque * -lag);
        shown.linvel -= self.acceleration * lag;
        shown
    }

    /// Returns true if wrenches do not change its rotation.
    pub(crate) fn is_left_alone(&self) -> bool {
        matches!(self.turning, Turning::LeftAlone)
    }

    /// The kinetic energies at the start and now, in a frame of the velocity `drift`.
    pub(crate) fn kinetic_energies(&self, drift: DVec3) -> [f64; 2] {
        let first = match &self.turning {
            Turning::Free(inertia, _) => inertia.angular_momentum(self.start.1, self.began.1),
            _ => self.inertia.momentum(self.start.1, self.began.1),
        };
        let energy = |(linvel, angvel): (DVec3, DVec3), twist: DVec3| {
            0.5 * (self.mass * (linvel - drift).length_squared() + angvel.dot(twist))
        };
        let now = energy((self.linvel, self.angvel), self.momentum().1);
        [energy(self.began, first), now]
    }

    /// Linear and angular momentum, in world axes.
    pub(crate) fn momentum(&self) -> (DVec3, DVec3) {
        let twist = match &self.turning {
            Turning::Free(_, momentum) => *momentum,
            _ => self.inertia.momentum(self.attitude, self.angvel),
        };
        (self.linvel * self.mass, twist)
    }

    /// The mean wrench of the fields since the start, a time `dt` ago: force and torque.
    pub(crate) fn mean_wrench(&self, dt: f64) -> (DVec3, DVec3) {
        let force = ((self.linvel - self.began.0) / dt - self.acceleration) * self.mass;
        let twist = match &self.turning {
            Turning::Free(inertia, momentum) => {
                *momentum - inertia.angular_momentum(self.start.1, self.began.1)
            }
            Turning::Steady => self
                .inertia
                .momentum(self.start.1, self.angvel - self.began.1),
            Turning::LeftAlone => DVec3::ZERO,
        };
        (force, twist / dt)
    }

    /// Applies Rapier's damping for `duration`.
    pub(crate) fn damp(&mut self, duration: f64) {
        let [linear, angular] = self.damping.map(|rate| (-rate * duration).exp());
        self.linvel *= linear;
        match &mut self.turning {
            Turning::Free(inertia, momentum) => {
                *momentum *= angular;
                self.angvel = inertia.angvel_after(self.attitude, *momentum);
            }
            Turning::Steady => self.angvel *= angular,
            Turning::LeftAlone => {}
        }
    }

    /// Adds an impulse and an angular impulse to the velocities.
    pub(crate) fn kick(&mut self, impulse: DVec3, twist: DVec3) {
        let change = self.inv_mass * impulse;
        self.linvel = real(stopped::<f64>(constant(self.linvel), constant(change)));
        match &mut self.turning {
            Turning::Free(inertia, momentum) => {
                *momentum += twist;
                self.angvel = inertia.angvel_after(self.attitude, *momentum);
            }
            Turning::Steady => {
                let turn = self.inertia.at(self.attitude) * six(twist, twist).fixed_rows::<3>(0);
                self.angvel += DVec3::new(turn[0], turn[1], turn[2]);
            }
            Turning::LeftAlone => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{ColliderSet, Vector};
    use crate::rapier::dynamics::{MassProperties, RigidBodyBuilder};

    fn damped_top() -> RigidState {
        let moments = Vector::new(1.0, 2.0, 2.5);
        let builder = RigidBodyBuilder::dynamic()
            .linvel(Vector::new(1.0, -2.0, 0.5))
            .angvel(Vector::new(0.5, 3.0, 1.0))
            .linear_damping(0.7)
            .angular_damping(0.9)
            .additional_mass_properties(MassProperties::new(Vector::ZERO, 2.0, moments));
        let mut body = builder.build();
        body.recompute_mass_properties_from_colliders(&ColliderSet::new());
        let handle = RigidBodyHandle::from_raw_parts(0, 0);
        RigidState::new(&Body::of(handle, &body), true)
    }

    /// Compares with many small drifts with damping in their middle, whose error falls with the square of their length.
    #[test]
    fn a_damped_body_coasts_in_closed_form() {
        let mut at_once = damped_top();
        assert!(matches!(at_once.turning, Turning::Free(..)));
        at_once.coast(1.0, 1e-12);
        let mut piecewise = damped_top();
        let pieces = 4000;
        let h = f64::from(pieces).recip();
        for _ in 0..pieces {
            piecewise.drift(0.5 * h, 1e-12);
            piecewise.damp(h);
            piecewise.drift(0.5 * h, 1e-12);
        }
        let off = [
            (at_once.position - piecewise.position).length(),
            (at_once.attitude * piecewise.attitude.inverse())
                .xyz()
                .length(),
            (at_once.linvel - piecewise.linvel).length(),
            (at_once.angvel - piecewise.angvel).length(),
        ];
        assert!(off.iter().all(|off| *off < 1e-6), "{off:?}");
    }
}
