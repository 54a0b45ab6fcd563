//! The second half of a step, after Rapier's.

use std::collections::HashSet;
use std::sync::Arc;

use super::begin::take_back;
use super::contacts::joints;
use super::faults::answering;
use super::scene::{Now, iterations};
use super::state::OpenRecord;
use super::timings::span;
use super::{
    Definition, FieldPipeline, FieldState, OpenStep, StepOutcome, StepStage, wake_decision,
};
use crate::bridge::{self, Constraints, Made, Push, StepError, WakeRule, Wanted, WorldMut};
use crate::contact::was_to_ask;
use crate::cross_check::Judging;
use crate::diagnose::{SampledFields, blame, without_non_finite};
use crate::integrate::{BegunStep, Completion, Fault, FreeMotion, Motions, Scheme, StepWarning};
use crate::math::{Real, RigidBodyHandle, from_f64, to_f64};
use crate::rigid::{MidStepImpact, Wrench, sort_by_body};

impl FieldPipeline {
    /// Makes the second half of a step. After an error the world is as it was before the step began, except with
    /// [`StepError::NotTheirs`], which changes nothing.
    pub(crate) fn finish_step(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        mut open: OpenStep,
        mut world: WorldMut<'_>,
    ) -> Result<StepOutcome, StepError> {
        span!("finish");
        let mut record = match state.open.take() {
            Some(record) if [record.number, self.last_begun] == [open.number; 2] => record,
            other => {
                state.open = other;
                return Err(StepError::NotTheirs);
            }
        };
        self.stopwatch.go_on();
        self.quarantined.clear();
        (self.held_is_known, self.pushed_is_known) = (false, false);
        self.on_fault = open.on_fault;
        let outcome = self.finish_all(fields, state, &mut open, &record, &mut world);
        if outcome.is_err() {
            open.rollback.restore(&mut world);
            if open.soft.is_some() {
                self.softs.restore(world.soft_bodies);
            }
            // No time has passed, so the next step begins with the same evaluation.
            let not_stepped = outcome == Err(StepError::NotStepped);
            if not_stepped {
                state.mark = open.mark;
                std::mem::swap(&mut state.reactions, &mut open.motions.reactions);
            } else {
                state.reactions.clear();
            }
            if !not_stepped || !state.knows_all() {
                state.forget();
            }
            if let Some(drowsing) = open.stepped.drowsing.take() {
                state.drowsing = drowsing;
            }
        }
        // The buffers are used again.
        record.clear();
        self.spare_record = record;
        self.motions = open.motions;
        self.rollback = open.rollback;
        self.softs.spare = open.soft.unwrap_or_default();
        self.stepped = open.stepped;
        self.late_bodies = std::mem::replace(&mut self.scene.bodies, open.bodies);
        outcome
    }

    fn finish_all(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        open: &mut OpenStep,
        record: &OpenRecord,
        world: &mut WorldMut<'_>,
    ) -> Result<StepOutcome, StepError> {
        let dt = open.dt;
        match open.stepped.made(world, dt) {
            Made::One => {}
            Made::None => {
                take_back(record, world);
                open.stepped.take_back(world.bodies);
                return Err(StepError::NotStepped);
            }
            Made::More(advanced) => {
                self.warnings.push(StepWarning::OtherSteps { advanced, dt });
            }
        }
        if !self.scene.compiled.detectors.is_empty() {
            // No hook is called any more. Dropping this reference lets the detector change its own without a copy.
            open.starts = Arc::default();
        }
        self.stopwatch.lap(StepStage::Bookkeeping);
        let mut outcomes = open.hook_log.take();
        if let Some(expected) = &open.expected {
            let (view, rollback) = (world.view(), &open.rollback);
            let judging = Judging {
                settings: &fields.settings.cross_check,
                watched: &self.watched,
                expected,
                world: &view,
                narrow_phase: world.narrow_phase,
                joints: joints(world),
                parameters: world.integration_parameters,
                hidden: &outcomes.hidden,
            };
            let pose_before = |handle| rollback.pose_before(handle, &view);
            state.cross_check.compare(&judging, pose_before);
            self.stopwatch.lap(StepStage::CrossCheck);
        }
        if let Some(pair) = open.to_ask.filter(|_| !*open.hook_log.asked.get_mut())
            && was_to_ask(
                &open.ownership.rules,
                pair,
                world.narrow_phase,
                &world.view(),
            )
        {
            self.warnings.push(StepWarning::HooksNotGiven);
        }
        let began = state.time;
        let overrides = &record.overrides;
        let mut written = bridge::restore(world.bodies, overrides, |it| self.warnings.push(it));
        bridge::finish(world, &mut open.motions);
        bridge::give_back(world.soft_bodies, &record.lent);
        if let Some(flight) = &open.soft {
            self.move_soft(fields, Now::last(began, dt), world, Some(flight))?;
            self.stopwatch.lap(StepStage::SoftBodies);
        }
        if open.unasked {
            outcomes.add_unasked(&open.ownership, world.narrow_phase, &world.view());
        }
        self.sweep(fields, open, &outcomes, began, world);
        let detects = !self.scene.compiled.detectors.is_empty();
        self.stopwatch.lap_if(detects, StepStage::Contacts);
        let check = &fields.settings.cross_check;
        let checks = self.cross_checks(fields);
        if checks {
            let (records, view) = (self.detector.touch_log(), world.view());
            let pose_before = |handle| open.rollback.pose_before(handle, &view);
            let report = &mut state.cross_check;
            report.compare_touches(check, records, &view, dt, pose_before);
        }
        written += self.push(world);
        let now = began + to_f64(dt);
        written += self.finish_bodies(fields, state, open, world)?;
        state.time = now;
        state.steps += 1;
        self.stopwatch.lap_if(checks, StepStage::CrossCheck);
        written += self.touch(fields, state, open, &outcomes, world);
        self.stopwatch.lap_if(detects, StepStage::Contacts);
        if checks {
            let (contacts, pairs) = (&self.detector.contacts, world.narrow_phase);
            let report = &mut state.cross_check;
            report.add_answers(check, &self.watched, contacts, pairs, &world.view());
            self.stopwatch.lap(StepStage::CrossCheck);
        }
        if fields.settings.audit && fields.set.is_checked() {
            let view = world.view();
            let (_, samples) = Self::sample_everyone(
                &mut self.gatherer,
                &self.properties,
                &view,
                self.scene.compiled.requirements,
            );
            let moment = Now::last(began, dt).moment();
            let sampled = SampledFields::new(fields.set, &view, &samples, moment);
            state.audit.end(&open.audit_reading, &sampled, dt);
            self.stopwatch.lap(StepStage::Audit);
        }
        let mut particles = 0;
        if open.soft.is_some() {
            let policy = fields.settings.wake;
            particles = self.softs.second_half(policy, world.soft_bodies);
            self.stopwatch.lap(StepStage::SoftBodies);
        }
        bridge::quarantine(world.bodies, &self.quarantined);
        self.keep_pushed(state, world);
        if let Some(channel) = &self.zone_events {
            let (times, inside) = ([began, to_f64(dt)], &mut state.zones);
            let view = world.view();
            self.zone_watch
                .end(fields.set, &view, times, inside, channel);
        }
        let kicks = fields.settings.scheme == Scheme::KickDriftKick;
        let (last, held) = (state.evaluation.as_ref(), &self.scene.held);
        let felt = |body| last.filter(|_| kicks && !held.contains(body))?.wrench(body);
        state.edges.see(&world.view(), felt);
        let error = state
            .edges
            .report(fields.settings.scheme, &mut self.warnings);
        self.integrator.reached = self.integrator.reached.max(error);
        self.stopwatch.lap(StepStage::Bookkeeping);
        Ok(StepOutcome {
            sampled: self.samples_used(open),
            contacts: self.detector.contacts.len(),
            written,
            particles,
            warnings: self.warnings.len(),
            error: self.error(fields, open),
            exhausted: self.detector.stopped > 0,
        })
    }

    /// The largest error of bodies under `Auto` and `PerBody`.
    fn error(&self, fields: &Definition<'_>, open: &OpenStep) -> Option<Real> {
        let varies = !open.idle && self.scene.compiled.varies();
        let reached = if varies { self.integrator.reached } else { 0.0 };
        let chooses = fields.settings.scheme.chooses();
        chooses.then(|| from_f64(reached))
    }

    fn samples_used(&self, open: &OpenStep) -> usize {
        if open.idle { 0 } else { self.sampled }
    }

    /// The second half of a kick, with the wrenches after Rapier's step.
    fn finish_bodies(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        open: &mut OpenStep,
        world: &mut WorldMut<'_>,
    ) -> Result<usize, StepError> {
        span!("bodies");
        self.sampled = open.bodies.len();
        let late = self.missed_bodies(world);
        if open.idle && late.is_empty() {
            return Ok(0);
        }
        if open.at_centres && late.is_empty() && self.acts_at_centres(fields, world) {
            let written = self.finish_at_centres(fields, state, open, world);
            if let Some(written) = written {
                self.stopwatch.lap(StepStage::Visits);
                return Ok(written);
            }
        }
        let deflected = |push: &Push| push.hit.is_some_and(|hit| hit.presumed.is_some());
        let kicks = fields.settings.scheme.kicks_twice() || open.motions.bounced;
        if !kicks && late.is_empty() && !self.pushes.iter().any(deflected) {
            self.note_sleepers(fields, state, &open.bodies, world);
            // Kept, because the next step monitors the change of the wrenches.
            if let Some(evaluation) = &mut state.evaluation {
                evaluation.outdated = true;
            }
            self.record_moved(state, &world.view());
            return Ok(0);
        }
        let now = Now::last(state.time, open.dt);
        if let Some(last) = &mut state.evaluation {
            // Completed bodies get no second half kick: their velocities are those of the end of the step already.
            let mut at = 0;
            for (body, wrench) in last.bodies.iter().zip(&mut last.wrenches) {
                let rest = open.motions.next_completion(&mut at, *body);
                if rest.is_some_and(Completion::is_completed) {
                    *wrench = Wrench::ZERO;
                }
            }
        }
        let wanted = Wanted {
            sleepers: open.sleepers,
            all: false,
            besides: &open.bodies,
        };
        self.read(world, wanted, None);
        self.complete(&open.motions, world);
        self.gather(&world.view(), open.alone);
        self.place();
        self.stopwatch.lap(StepStage::Samples);
        self.note_overtaken(fields, state, &open.bodies, world);
        let mut evaluation = std::mem::take(&mut self.spare);
        let mut last = state.evaluation.take();
        self.find_held(fields, world);
        self.evaluate(fields, world, now, &mut evaluation)?;
        self.stopwatch.lap(StepStage::Evaluation);
        if !self.quarantined.is_empty() {
            let gone: HashSet<_> = self.quarantined.iter().collect();
            open.bodies.retain(|it| !gone.contains(&it.handle));
            last.iter_mut().for_each(|it| it.remove(&self.quarantined));
        }
        let view = world.view();
        let hits = &self.mid_step_impacts();
        let drop_non_finite = |fault: &Fault| without_non_finite(fields.set, fault);
        let mut context = self.scene.context(fields, world, &view, now);
        context.rules = answering(context.rules, self.on_fault, &drop_non_finite);
        let integrator = &mut self.integrator;
        let known = last
            .as_ref()
            .filter(|last| last.bodies == evaluation.bodies);
        let begun = &BegunStep {
            last: known,
            motions: &open.motions,
            hits,
            late: &late,
            may_retry: self.scene.compiled.detectors.is_empty(),
        };
        let (stiff, warnings) = (&mut state.stiff, &mut self.warnings);
        integrator.update(&context, &mut evaluation, begun, stiff, warnings);
        self.retried.clear();
        if let Some(last) = known {
            let (bodies, retried) = (&open.bodies, &mut self.retried);
            integrator.retry(&context, &mut evaluation, bodies, last, retried, warnings);
        }
        if fields.settings.scheme.kicks_twice() {
            integrator.follow(&context, &evaluation, begun, &mut state.edges);
        }
        let policy = fields.settings.wake;
        let rule = WakeRule {
            policy,
            gravity: world.gravity,
        };
        let (bodies, wrenches) = (&self.scene.bodies, &evaluation.wrenches);
        state
            .resting
            .decide(bodies, wrenches, rule, &mut self.wake_decisions);
        let outcome = {
            let decide = wake_decision(policy, &self.wake_decisions);
            integrator.second_half(&context, &evaluation, begun, &decide, &mut self.late)
        };
        self.spare = last.unwrap_or_default();
        outcome.map_err(|fault| blame(fields.set, &fault))?;
        let hit = self
            .late
            .worst_hit
            .map(|(body, error)| StepWarning::HitInStiffField {
                body,
                error: from_f64(error),
            });
        self.warnings.extend(hit);
        // Before the next call removes bodies, which changes their places in the list.
        for now in &self.retried {
            let body = &mut self.scene.bodies[now.place];
            (body.pose, body.linvel, body.angvel) = (now.pose, now.linvel, now.angvel);
        }
        let mut faults = std::mem::take(&mut self.late.faults);
        self.answer_all(fields, &mut faults, Some(&mut evaluation))?;
        let quarantined = &self.quarantined;
        self.retried.retain(|now| !quarantined.contains(&now.body));
        self.sampled = self.scene.bodies.len();
        // Fields have no reaction to bodies that are disabled.
        let gone = !quarantined.is_empty();
        evaluation.outdated = self.late.outdated || !self.retried.is_empty() || gone;
        state.evaluation = Some(evaluation);
        self.note_carriers(state, &view);
        let mut written = bridge::write(world.bodies, &self.late.updates);
        written += bridge::place(world.bodies, world.colliders, &self.retried);
        let time_centred = &self.late.completions;
        if !time_centred.is_empty() && !self.scene.compiled.detectors.is_empty() {
            let starts = Arc::make_mut(&mut self.detector.starts);
            starts.catch_up(time_centred.iter().map(|it| it.body));
        }
        self.record(state);
        self.stopwatch.lap(StepStage::Motion);
        Ok(written)
    }

    /// The free bodies that were awake before Rapier's step, but not read. Other bodies that are awake now are held:
    /// contacts or joints woke them within the step.
    fn missed_bodies(&self, world: &WorldMut<'_>) -> Vec<RigidBodyHandle> {
        let mut late = self.reader.late(world.islands);
        let constraints = Constraints::new(world);
        late.retain(|handle| {
            let body = world.bodies.get(*handle);
            body.is_some_and(|body| !constraints.hold(*handle, body))
        });
        late
    }

    /// Replaces the velocities of free bodies by those at which they have moved.
    fn complete(&mut self, first: &Motions, world: &WorldMut<'_>) {
        if first.completions.is_empty() {
            return;
        }
        let (gravity, parameters) = (world.gravity, world.integration_parameters);
        let (iterations, dt) = (iterations(parameters), parameters.dt);
        let mut at = 0;
        for body in &mut self.scene.bodies {
            let rest = first.next_completion(&mut at, body.handle);
            if !body.sleeping && rest.is_some_and(Completion::is_free) {
                let free = FreeMotion::new(body, gravity, iterations, dt);
                [body.linvel, body.angvel] = free.moved(body.linvel, body.angvel);
            }
        }
    }

    /// The bodies that were put on another path within the step, in the order of their handles.
    fn mid_step_impacts(&self) -> Vec<MidStepImpact> {
        let mut hits: Vec<_> = self.pushes.iter().filter_map(|push| push.hit).collect();
        sort_by_body(&mut hits, |hit| hit.body);
        hits
    }
}
