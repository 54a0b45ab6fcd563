//! The first half of a step as an input of the second, and the bodies that were hit in between.

use super::evaluation::Evaluation;
use super::motion::{Completion, Motions, Resolved, VelocityUpdate, kicked};
use crate::math::{DVec3, Real, RigidBodyHandle, Vector, to_dquat, to_dvec3, to_f64};
use crate::rigid::{Body, MidStepImpact, Wrench, find_by};

/// The results of the half before Rapier's step that the half after it needs.
#[derive(Clone, Copy)]
pub(crate) struct BegunStep<'a> {
    /// The evaluation that it began with, if that was of the same bodies.
    pub last: Option<&'a Evaluation>,
    pub motions: &'a Motions,
    /// The impacts that have changed paths of bodies since, in the order of their handles.
    pub hits: &'a [MidStepImpact],
    /// Free bodies that were awake before Rapier's step but not read in the first half, in the order of their handles.
    pub late: &'a [RigidBodyHandle],
    /// True if there are no detection fields, so that no contact depends on paths and these may still be changed.
    pub may_retry: bool,
}

impl BegunStep<'_> {
    /// The impact that has changed the path of a body, if there was one.
    pub(super) fn hit(&self, body: RigidBodyHandle) -> Option<&MidStepImpact> {
        let place = find_by(self.hits, body, |hit| hit.body)?;
        Some(&self.hits[place])
    }

    /// The result for a body that was moved within the step and that nothing else touched.
    pub(super) fn resolved_alone(&self, body: RigidBodyHandle) -> Option<&Resolved> {
        let (hit, motions) = (self.hit(body), self.motions);
        let alone = hit.is_none() && motions.load(body).is_none() && !motions.has_bounced(body);
        motions.resolved(body).filter(|_| alone)
    }

    /// The correction of the wrench for the second half of a kick: up to a hit the first wrench should act, and the
    /// second from then on. The map of a step is time-reversible, so hits in a field that does not change neither add
    /// nor take energy on average.
    pub(super) fn correction(
        &self,
        place: usize,
        body: RigidBodyHandle,
        wrench: Wrench,
    ) -> Option<Wrench> {
        let (hit, before) = (self.hit(body)?, self.last?.wrenches.get(place)?);
        let later = 1.0 - 2.0 * hit.share;
        Some(wrench.plus(before.times(-1.0)).times(later))
    }

    /// The correction for a body that was moved within the step and hit: after the hit it moved under the presumed
    /// acceleration and torque, and should have moved under the mean of these and of those at its end. The second value
    /// is the relative error of its speed that remains.
    pub(super) fn after_hit(
        &self,
        body: &Body,
        wrench: Wrench,
        dt: Real,
    ) -> Option<(VelocityUpdate, f64)> {
        let hit = self.hit(body.handle)?;
        let [acceleration, torque] = hit.presumed?;
        let duration = 0.5 * (1.0 - hit.share) * dt;
        let change = Wrench {
            force: wrench.force,
            torque: wrench.torque - torque,
        };
        let mut update = kicked(body, change, duration);
        update.linvel -= acceleration * duration;
        Some((update, error_after_hit(body, &update)))
    }
}

/// The relative error of a body's speed after a correction of its velocities for a force that changes along its path.
/// On a spring the trapezoidal rule is off by (ω t)³/12 of the speed over a time t, and the correction itself is (ω
/// t)²/2 of the speed.
fn error_after_hit(body: &Body, update: &VelocityUpdate) -> f64 {
    let inertia = body.inertia();
    let energy = |linvel: Vector, angvel: Vector| {
        let (attitude, angvel) = (to_dquat(body.pose.rotation), to_dvec3(angvel));
        let momentum = inertia.map_or(DVec3::ZERO, |it| it.angular_momentum(attitude, angvel));
        to_f64(body.mass) * to_dvec3(linvel).length_squared() + angvel.dot(momentum)
    };
    let whole = energy(update.linvel, update.angvel);
    let change = energy(update.linvel - body.linvel, update.angvel - body.angvel);
    if change == 0.0 {
        return 0.0;
    }
    (2.0 * (change / whole).sqrt()).powf(1.5) / 12.0
}

/// The first half of a step, for one body in the second.
#[derive(Clone, Copy)]
pub(super) struct BegunBody<'a> {
    pub step: &'a BegunStep<'a>,
    /// The part of its motion that is left for the second half, if it is not a plain one.
    pub completion: Option<Completion>,
}
