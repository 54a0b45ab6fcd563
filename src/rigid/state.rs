//! The state of a body in steps smaller than Rapier's.

use super::body::Body;
use super::mobility::{self, Mobility, TurnedInertia, six};
use super::rotation::{Inertia, to_dquat};
use super::wrench::Wrench;
use crate::math::{DQuat, DVec3, RigidBodyHandle, to_dvec3, to_f64};

/// Speeds up to this count as zero; the squares of much smaller ones would underflow.
const SLOWEST: f64 = 1e-150;

/// A body on its way through the inner steps, in 64-bit precision and world axes.
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
    pub start: (DVec3, DQuat),
    /// The velocities at the start, linear and angular.
    pub began: (DVec3, DVec3),
    /// Acceleration by gravity and the user's force, which Rapier adds.
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
    /// At the angular velocity that Rapier gave it, whatever the kicks: no field can turn bodies.
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
        let turning = match free {
            _ if !turns => Turning::LeftAlone,
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

    /// Moves on for the time `h` without forces. A free rotation keeps its energy within `energy_error`.
    pub(crate) fn drift(&mut self, h: f64, energy_error: f64) {
        self.position += self.linvel * h;
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

    /// Advances the velocities by the time `lag` under a wrench and its own acceleration, and starts anew from
    /// there: those of Rapier were behind by it.
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

    /// Linear and angular momentum, in world axes.
    pub(crate) fn momentum(&self) -> (DVec3, DVec3) {
        let twist = match &self.turning {
            Turning::Free(_, momentum) => *momentum,
            _ => self.inertia.momentum(self.attitude, self.angvel),
        };
        (self.linvel * self.mass, twist)
    }

    /// The mean wrench of the fields since the start, over `dt`: force and torque.
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
        self.linvel = stopped(self.linvel, self.inv_mass * impulse);
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

/// The velocity `was + more`, with zero for each component that is nothing but rounding, or whose square would
/// be: a body that drag stops does not turn back.
pub(crate) fn stopped(was: DVec3, more: DVec3) -> DVec3 {
    let sum = was + more;
    let rounding = was.abs() * (16.0 * f64::EPSILON) + DVec3::splat(SLOWEST);
    DVec3::select(sum.abs().cmple(rounding), DVec3::ZERO, sum)
}
