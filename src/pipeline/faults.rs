//! The treatment of forces that cannot be given to Rapier.

use super::scene::Now;
use super::timings::span;
use super::{Definition, FieldPipeline};
use crate::bridge::{SoftFlight, StepError, WorldMut};
use crate::diagnose::{blame, warn_of, without_non_finite};
use crate::integrate::{
    DropNonFinite, Durations, Evaluation, Fault, FaultKind, FaultPolicy, MotionRules, StepWarning,
};
use crate::math::from_f64;
use crate::rigid::Wrench;

impl FieldPipeline {
    /// Evaluates the fields on the sampled bodies, and drops the bodies that are to be disabled.
    pub(super) fn evaluate(
        &mut self,
        fields: &Definition<'_>,
        world: &WorldMut<'_>,
        now: Now,
        evaluation: &mut Evaluation,
    ) -> Result<(), StepError> {
        span!("evaluation");
        let view = world.view();
        loop {
            let context = self.scene.context(fields, world, &view, now);
            let outcome = self.integrator.evaluate(&context, evaluation);
            let Err(fault) = outcome else {
                return Ok(());
            };
            self.answer(fields, &fault)?;
            if self.on_fault == FaultPolicy::LeaveOut {
                evaluation.leave_out(&fault, &without_non_finite(fields.set, &fault));
                return Ok(());
            }
            // Evaluated again without the bodies that are to be disabled.
            self.gather(&view, false);
            self.place();
        }
    }

    /// Refuses the step, or warns that a body's force is left out or the body disabled.
    fn answer(&mut self, fields: &Definition<'_>, fault: &Fault) -> Result<(), StepError> {
        match self.on_fault {
            FaultPolicy::Refuse => return Err(blame(fields.set, fault)),
            FaultPolicy::LeaveOut => {}
            FaultPolicy::Quarantine => {
                self.quarantined.extend(fault.bodies());
                self.scene.bodies.retain(|body| !fault.is_of(body.handle));
            }
        }
        warn_of(fields.set, fault, self.on_fault, &mut self.warnings);
        Ok(())
    }

    /// Does the same for the faults of motions, and removes the bodies that are to be disabled from `evaluation`.
    pub(super) fn answer_all(
        &mut self,
        fields: &Definition<'_>,
        faults: &mut Vec<Fault>,
        evaluation: Option<&mut Evaluation>,
    ) -> Result<(), StepError> {
        if faults.is_empty() {
            return Ok(());
        }
        for fault in faults.drain(..) {
            self.answer(fields, &fault)?;
        }
        if let Some(evaluation) = evaluation {
            evaluation.remove(&self.quarantined);
        }
        Ok(())
    }

    /// Computes the motion of the particles of soft bodies: before Rapier's step, or after it for a `flight`.
    pub(super) fn move_soft(
        &mut self,
        fields: &Definition<'_>,
        now: Now,
        world: &WorldMut<'_>,
        flight: Option<&SoftFlight>,
    ) -> Result<(), StepError> {
        span!("soft bodies");
        let (view, settings) = (world.view(), fields.settings);
        let moment = now.moment();
        let (compiled, wake) = (&self.scene.compiled, settings.wake);
        let fault = self
            .softs
            .evaluate(compiled, &self.properties, world, moment, wake);
        let unsound = self.softs.unsound.iter();
        self.warnings
            .extend(unsound.map(|body| StepWarning::NotFinite { body: *body }));
        if flight.is_none() {
            let flat = self.softs.without_volume.iter();
            self.warnings
                .extend(flat.map(|body| StepWarning::NoVolume { body: *body }));
        }
        if let Some(fault) = fault {
            self.answer_soft(fields, &fault)?;
        }
        let durations = Durations::new(settings.scheme, now.dt);
        self.softs
            .move_all(&self.scene.compiled, &view, moment, durations, flight);
        if flight.is_none() {
            let lacking = self.softs.lacking.iter();
            self.warnings
                .extend(lacking.map(|(body, share)| StepWarning::PinnedParticles {
                    body: *body,
                    share: from_f64(*share),
                }));
        }
        if let Some(fault) = self.softs.too_fast(&self.scene.compiled, &view, moment) {
            self.answer_soft(fields, &fault)?;
            self.softs
                .move_all(&self.scene.compiled, &view, moment, durations, flight);
        }
        Ok(())
    }

    fn answer_soft(&mut self, fields: &Definition<'_>, fault: &Fault) -> Result<(), StepError> {
        match (self.on_fault, fault.kind) {
            (FaultPolicy::Refuse, _) => return Err(blame(fields.set, fault)),
            (FaultPolicy::LeaveOut, FaultKind::NonFinite) => {
                self.softs
                    .leave_out(fault, &without_non_finite(fields.set, fault));
            }
            (FaultPolicy::LeaveOut, FaultKind::TooFast { .. }) => {
                let none = vec![Wrench::ZERO; fault.places.len()];
                self.softs.leave_out(fault, &none);
            }
            (FaultPolicy::Quarantine, _) => self.softs.quarantine(fault),
        }
        warn_of(fields.set, fault, self.on_fault, &mut self.warnings);
        Ok(())
    }

    /// Copies the bodies and joints, for a step that may be refused, and for the cross-check, which needs previous
    /// poses.
    pub(super) fn keep_copies(&mut self, fields: &Definition<'_>, world: &WorldMut<'_>) {
        let refuses = self.on_fault == FaultPolicy::Refuse;
        if refuses || self.cross_checks(fields) {
            self.rollback.take(world);
        } else {
            self.rollback.clear();
        }
    }
}

/// The rules of motion, with the treatment of faults.
pub(super) fn answering<'a>(
    rules: MotionRules<'a>,
    on_fault: FaultPolicy,
    drop_non_finite: DropNonFinite<'a>,
) -> MotionRules<'a> {
    MotionRules {
        on_fault,
        drop_non_finite: (on_fault == FaultPolicy::LeaveOut).then_some(drop_non_finite),
        ..rules
    }
}
