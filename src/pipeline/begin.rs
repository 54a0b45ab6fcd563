//! The first half of a step, before Rapier's.

use std::sync::Arc;

use super::due::Due;
use super::faults::answering;
use super::scene::{Now, moment};
use super::state::{OpenRecord, next_number};
use super::timings::span;
use super::{Definition, FieldPipeline, FieldState, OpenStep, StepStage};
use crate::bridge::{
    self, Balance, Constraints, StepError, WakePolicy, WakeRule, Wanted, WorldMut, WorldRef,
};
use crate::contact::{HookLog, Ownership, to_ask};
use crate::diagnose::{AuditReading, SampledFields, blame, without_non_finite};
use crate::field::{Anchor, Frames};
use crate::integrate::{Fault, FaultPolicy, Scheme, StepWarning, warn_of_caps};
use crate::rigid::{Body, Wrench};

impl FieldPipeline {
    /// Makes the first half of a step. `alone` is true if Rapier's step follows at once. After an error nothing has
    /// been written, except that the previous step is taken back if it was not finished.
    pub(crate) fn begin_step(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        mut world: WorldMut<'_>,
        alone: bool,
    ) -> Result<OpenStep, StepError> {
        span!("begin");
        if let Some(open) = state.open.take() {
            take_back(&open, &mut world);
            Arc::make_mut(&mut state.hooked).stay();
            state.evaluation = None;
            state.reactions.clear();
            return Err(StepError::Unfinished);
        }
        if state.last_begun != self.last_begun {
            self.start_over();
        }
        self.stopwatch.start();
        let dt = world.integration_parameters.dt;
        if !(dt >= 0.0 && dt.is_finite()) {
            return Err(StepError::TimeStep { dt });
        }
        fields.settings.validate()?;
        state.check()?;
        self.follow(fields);
        self.check_scheme(fields)?;
        self.warnings.clear();
        self.quarantined.clear();
        self.stepped.clear();
        self.alone = alone;
        self.on_fault = fields.settings.on_fault;
        self.recognise(state, &world.view())?;
        self.check_anchors(fields.set, state, &world.view())?;
        self.find_links(&world);
        if self.zone_events.is_some() {
            self.zone_watch.begin(fields.set, &world.view());
        } else {
            state.zones.clear();
        }
        self.stopwatch.lap(StepStage::Bookkeeping);
        let expected = self.expect(fields, state, &world);
        let checks = expected.is_some();
        self.stopwatch.lap_if(checks, StepStage::CrossCheck);
        let audit_reading = self.begin_audit(fields, state, &world);
        self.stopwatch
            .lap_if(fields.settings.audit, StepStage::Audit);
        let soft = self.begin_soft(fields, state, &world)?;
        self.stopwatch.lap_if(soft, StepStage::SoftBodies);
        let detects = !self.scene.compiled.detectors.is_empty();
        self.note_starts(&world);
        self.stopwatch.lap_if(detects, StepStage::Contacts);
        let mark = state.mark;
        let scheme = fields.settings.scheme;
        state.edges.begin(state.steps + 1, dt, scheme);
        let begun = self.begin_bodies(fields, state, &mut world);
        if begun.is_err() {
            // The evaluation may belong to bodies that the records do not have.
            self.retire(state);
            state.reactions.clear();
            self.rollback.restore(&mut world);
        }
        let (idle, sleepers) = begun?;
        let soft = soft.then(|| {
            let record = state
                .open
                .get_or_insert_with(|| std::mem::take(&mut self.spare_record));
            let policy = fields.settings.wake;
            let refuses = self.on_fault == FaultPolicy::Refuse;
            self.softs
                .take((refuses || !alone).then_some(world.soft_bodies));
            let lent = &mut record.lent;
            self.softs.first_half(policy, world.soft_bodies, lent)
        });
        self.stopwatch.lap_if(soft.is_some(), StepStage::SoftBodies);
        self.look_for_outlived(&mut world);
        if !idle || !self.motions.turns.is_empty() {
            self.note_kicks(fields, state.evaluation.as_ref(), &world);
        }
        if detects {
            let (links, others) = (&self.scene.links, Constraints::new(&world).jointed());
            let rules = Arc::make_mut(&mut self.ownership_rules);
            rules.set_jointed(links.iter().copied(), others, &world.view());
        }
        self.listen(fields, state, &mut world);
        let released = self.release(state, &world);
        let to_ask = to_ask(&self.ownership_rules, world.narrow_phase, &world.view());
        if !alone {
            let anew = self.other_bodies;
            self.stepped.choose(world.bodies, world.islands, dt, anew);
        }
        self.stopwatch.lap_if(detects, StepStage::Contacts);
        let open = state
            .open
            .get_or_insert_with(|| std::mem::take(&mut self.spare_record));
        let number = next_number();
        (open.number, self.last_begun, state.last_begun) = (number, number, number);
        Ok(OpenStep {
            number,
            dt,
            alone,
            idle,
            at_centres: self.at_centres,
            motions: std::mem::take(&mut self.motions),
            bodies: std::mem::replace(
                &mut self.scene.bodies,
                std::mem::take(&mut self.late_bodies),
            ),
            rollback: std::mem::take(&mut self.rollback),
            stepped: std::mem::take(&mut self.stepped),
            mark,
            on_fault: self.on_fault,
            expected,
            audit_reading,
            soft,
            sleepers,
            ownership: Ownership {
                rules: self.ownership_rules.clone(),
                released,
                handed_over: state.hand_over.given(),
            },
            hooked: state.hooked.clone(),
            starts: self.detector.starts.clone(),
            to_ask,
            unasked: self.hook_filter.any(),
            hook_log: HookLog::new(self.cross_checks(fields)),
        })
    }

    /// Warns of contacts that Rapier keeps of a shape which its collider no longer has.
    fn look_for_outlived(&mut self, world: &mut WorldMut<'_>) {
        let anew = self.other_bodies || self.other_colliders;
        let pairs = self.outlived.find(world, anew).into_iter();
        let told = pairs.map(|colliders| StepWarning::ContactsOutliveShape { colliders });
        self.warnings.extend(told);
    }

    fn expect(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &WorldMut<'_>,
    ) -> Option<crate::cross_check::Expected> {
        let settings = &fields.settings.cross_check;
        let checks = self.cross_checks(fields);
        self.detector.log_touches(checks);
        if !checks {
            return None;
        }
        state
            .cross_check
            .note(settings, world.integration_parameters);
        let (view, moment) = (
            world.view(),
            moment(state.time, world.integration_parameters.dt),
        );
        let compiled = &self.scene.compiled;
        let sites = Self::sites(&mut self.gatherer, &self.properties, compiled, &view);
        self.detector.run(compiled, &view, moment, None, sites);
        let contacts = &self.detector.contacts;
        Some(crate::cross_check::expect(settings, contacts, &view))
    }

    fn begin_audit(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &WorldMut<'_>,
    ) -> AuditReading {
        if !fields.settings.audit {
            return AuditReading::default();
        }
        span!("audit");
        let view = world.view();
        let (_, samples) = Self::sample_everyone(
            &mut self.gatherer,
            &self.properties,
            &view,
            self.scene.compiled.requirements,
        );
        let now = Now::first(state.time, world.integration_parameters.dt);
        let fields = SampledFields::new(fields.set, &view, &samples, now.moment());
        state.audit.begin(&fields)
    }

    fn begin_soft(
        &mut self,
        fields: &Definition<'_>,
        state: &FieldState,
        world: &WorldMut<'_>,
    ) -> Result<bool, StepError> {
        if world.soft_bodies.is_empty() {
            return Ok(false);
        }
        let now = Now::first(state.time, world.integration_parameters.dt);
        self.move_soft(fields, now, world, None)?;
        Ok(true)
    }

    /// Evaluates the fields, unless the last step has done so, and computes and writes the first half of the motion of
    /// all bodies. Returns whether no field reaches any body, and whether sleeping bodies are evaluated.
    fn begin_bodies(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &mut WorldMut<'_>,
    ) -> Result<(bool, bool), StepError> {
        span!("bodies");
        let dt = world.integration_parameters.dt;
        let first = fields.are_new(state);
        self.restless.clear();
        (self.at_centres, self.held_is_known) = (false, false);
        let mark = self.pushed_mark.take();
        self.pushed_is_known = mark.is_some_and(|mark| mark.is_untouched(world.bodies, dt));
        let sleepers = self.looks_at_sleepers(fields, state, &world.view());
        let near = if sleepers {
            None
        } else {
            self.near_carriers(fields, world)
        };
        if !sleepers && near.is_none() && !first && self.is_idle(fields, world) {
            self.turn_freely(world.integration_parameters);
            self.write_first(state, world);
            self.rollback.clear();
            self.retire(state);
            state.reactions.clear();
            self.spare.clear();
            self.stopwatch.lap(StepStage::Bookkeeping);
            return Ok((true, false));
        }
        if !sleepers && self.acts_at_centres(fields, world) {
            self.at_centres = self.begin_at_centres(fields, state, world).is_some();
            if self.at_centres {
                self.stopwatch.lap(StepStage::Visits);
                return Ok((false, false));
            }
        }
        self.keep_copies(fields, world);
        let wanted = Wanted {
            sleepers: sleepers || near.is_some(),
            all: first || self.other_bodies,
            besides: &[],
        };
        self.read(world, wanted, near.as_ref());
        self.weigh(state, world);
        let remade = self.gather(&world.view(), false);
        let due = if first {
            Due::All
        } else {
            self.find_due(fields, state, &world.view(), dt, remade)
        };
        let anew = due != Due::None;
        self.find_held(fields, world);
        let scheme = fields.settings.scheme;
        // Under other schemes the last step has not moved the samples to the present poses.
        let there = self.scene.samples.are_placed && scheme == Scheme::KickDriftKick;
        if anew || self.scene.compiled.reads_velocity || !there {
            self.place();
        }
        self.stopwatch.lap(StepStage::Samples);
        if anew {
            self.evaluate_anew(fields, state, world, due)?;
        } else if fields.settings.scheme.chooses() {
            self.look_again(fields, state, world);
        }
        self.stopwatch.lap_if(anew, StepStage::Evaluation);
        state.mark = Some(fields.set.mark());
        self.move_first(fields, state, world)?;
        self.stopwatch.lap(StepStage::Motion);
        Ok((false, sleepers))
    }

    /// Returns true if the wrenches on sleeping bodies may have changed since they fell asleep.
    fn looks_at_sleepers(
        &self,
        fields: &Definition<'_>,
        state: &FieldState,
        view: &WorldRef<'_>,
    ) -> bool {
        if fields.settings.wake == WakePolicy::Never {
            return false;
        }
        if fields.are_new(state) || state.steps == 0 {
            return true;
        }
        let moved = |(anchor, frame): &(Anchor, Option<_>)| view.frame(anchor) != *frame;
        !state.resting.is_empty()
            && (self.scene.compiled.reads_time || state.carriers.iter().any(moved))
    }

    fn move_first(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &mut WorldMut<'_>,
    ) -> Result<(), StepError> {
        span!("motion");
        let dt = world.integration_parameters.dt;
        self.find_restless(state, world);
        let Some(evaluation) = &state.evaluation else {
            return Ok(());
        };
        let policy = fields.settings.wake;
        let rule = WakeRule {
            policy,
            gravity: world.gravity,
        };
        let wrenches = &evaluation.wrenches;
        state
            .resting
            .decide(&self.scene.bodies, wrenches, rule, &mut self.wake_decisions);
        let view = world.view();
        let drop_non_finite = |fault: &Fault| without_non_finite(fields.set, fault);
        let now = Now::first(state.time, dt);
        let mut context = self.scene.context(fields, world, &view, now);
        context.rules = answering(context.rules, self.on_fault, &drop_non_finite);
        context.rules.reactions = Some(&state.reactions);
        let (integrator, motions) = (&mut self.integrator, &mut self.motions);
        let outcome = {
            let decide = super::wake_decision(policy, &self.wake_decisions);
            integrator.first_half(&context, evaluation, &decide, motions)
        };
        if outcome.is_ok() {
            integrator.warn_of_ways(&context, &mut self.warnings);
            integrator.follow_moved(&context, &mut state.edges);
            warn_of_caps(&context, motions, &mut self.warnings);
        }
        outcome.map_err(|fault| blame(fields.set, &fault))?;
        std::mem::swap(&mut state.reactions, &mut self.motions.reactions);
        let mut faults = std::mem::take(&mut self.motions.faults);
        self.answer_all(fields, &mut faults, state.evaluation.as_mut())?;
        self.write_first(state, world);
        Ok(())
    }

    /// Writes the first half of the motion of all bodies.
    fn write_first(&mut self, state: &mut FieldState, world: &mut WorldMut<'_>) {
        let open = state
            .open
            .get_or_insert_with(|| std::mem::take(&mut self.spare_record));
        let motions = &self.motions;
        if !self.alone {
            let written = motions.updates.iter().map(|update| update.body);
            let loaded = motions.loads.iter().map(|load| load.body);
            self.stepped.note(world.bodies, written.chain(loaded));
            self.stepped
                .note_quarantined(world.bodies, &self.quarantined);
        }
        bridge::apply(world.bodies, &motions.loads, &mut open.overrides);
        open.steady
            .extend(motions.turns.iter().map(|turn| turn.body));
        bridge::write(world.bodies, &motions.updates);
        bridge::rouse(world.bodies, &self.restless);
        bridge::quarantine(world.bodies, &self.quarantined);
    }

    /// Collects the bodies that are about to fall asleep under unbalanced forces.
    pub(super) fn find_restless(&mut self, state: &mut FieldState, world: &WorldMut<'_>) {
        let was_drowsing = std::mem::take(&mut state.drowsing);
        let balance = Balance {
            constraints: Constraints::new(world),
            gravity: world.gravity,
            parameters: world.integration_parameters,
            drowsing: &was_drowsing,
            varies: self.scene.compiled.reads_time,
        };
        let evaluation = state.evaluation.as_ref();
        let wrench = |body: &Body| evaluation.and_then(|it| it.wrench(body.handle));
        let drowsy = self.scene.bodies.iter().filter(|body| body.drowsy > 0.0);
        let bodies = drowsy.map(|body| (body, wrench(body).unwrap_or(Wrench::ZERO)));
        balance.find_restless(bodies, &mut state.drowsing, &mut self.restless);
        self.stepped.drowsing = Some(was_drowsing);
    }
}

/// Takes back the writes of a step that was never finished.
pub(super) fn take_back(open: &OpenRecord, world: &mut WorldMut<'_>) {
    bridge::restore(world.bodies, &open.overrides, |_| ());
    bridge::let_precess(world.bodies, &open.steady);
    bridge::give_back(world.soft_bodies, &open.lent);
}
