//! The first half of a step, before Rapier's.

use std::sync::Arc;

use super::faults::answering;
use super::stages::{NONE, Now, moment};
use super::state::{BodyRecord, OpenRecord, next_number};
use super::{Definition, FieldPipeline, FieldState, OpenStep, StepStage};
use crate::bridge::{
    self, Balance, Constraints, StepError, WakePolicy, Wanted, WorldMut, WorldRef,
};
use crate::contact::{Arrival, Heard, KickShare, Pairs, to_ask};
use crate::diagnose::{SampledFields, Tally, blame, missing_anchor, sifted};
use crate::field::{Anchor, ContactLaw, FieldSet, Frames, Span};
use crate::integrate::{
    Evaluation, Fault, FaultPolicy, MotionRules, Completion, Scheme, StepWarning, TurnAfter, warn_of_caps,
};
use crate::math::{Real, RigidBodyHandle, to_f64};
use crate::rapier::pipeline::ActiveHooks;
use crate::rigid::{Body, Lookup, Wrench, find_near};

impl FieldPipeline {
    /// Makes the first half of a step. `alone` if Rapier's step follows at once. After an error nothing has been
    /// written.
    pub(crate) fn begin_step(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        mut world: WorldMut<'_>,
        alone: bool,
    ) -> Result<OpenStep, StepError> {
        if let Some(open) = state.open.take() {
            take_back(&open, &mut world);
            Arc::make_mut(&mut state.listening).stay();
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
        fields.settings.scheme.validate()?;
        state.check()?;
        self.follow(fields);
        self.check_scheme(fields)?;
        self.warnings.clear();
        self.condemned.clear();
        self.stepped.clear();
        self.alone = alone;
        self.on_fault = fields.settings.on_fault;
        self.recognise(state, &world.view())?;
        self.check_anchors(fields.set, state, &world.view())?;
        self.find_links(&world);
        self.stopwatch.lap(StepStage::Bookkeeping);
        let expected = self.expect(fields, state, &world);
        let checks = expected.is_some();
        self.stopwatch.lap_if(checks, StepStage::CrossCheck);
        let tally = self.begin_audit(fields, state, &world);
        self.stopwatch
            .lap_if(fields.settings.audit, StepStage::Audit);
        let soft = self.begin_soft(fields, state, &world)?;
        self.stopwatch.lap_if(soft, StepStage::SoftBodies);
        let detects = !self.compiled.detectors.is_empty();
        self.note_starts(&world);
        self.stopwatch.lap_if(detects, StepStage::Contacts);
        let mark = state.mark;
        let begun = self.begin_bodies(fields, state, &mut world);
        if begun.is_err() {
            // The evaluation may belong to bodies that the records do not have.
            self.retire(state);
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
        if !idle || !self.motions.turns.is_empty() {
            self.note_kicks(fields, state.evaluation.as_ref(), &world);
        }
        self.listen(fields, state, &mut world);
        let released = self.release(state, &world);
        let to_ask = to_ask(&self.claims, world.narrow_phase, &world.view());
        self.stepped.choose(world.bodies, dt);
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
            bodies: std::mem::replace(&mut self.bodies, std::mem::take(&mut self.late_bodies)),
            rollback: std::mem::take(&mut self.rollback),
            stepped: std::mem::take(&mut self.stepped),
            mark,
            on_fault: self.on_fault,
            expected,
            tally,
            soft,
            sleepers,
            claims: self.claims.clone(),
            listening: state.listening.clone(),
            starts: self.detector.starts.clone(),
            released,
            given: state.hand_over.given(),
            to_ask,
            unasked: self.calm.any(),
            heard: Heard::new(self.cross_checks(fields)),
        })
    }

    /// Returns an error if fields answer contacts under a scheme that does not keep the energy of bodies that are hit.
    fn check_scheme(&self, fields: &Definition<'_>) -> Result<(), StepError> {
        let (scheme, answer) = (fields.settings.scheme, fields.settings.rules.answer_any());
        if !answer || !scheme.kicks_once() || !self.compiled.varies() {
            return Ok(());
        }
        let mut detectors = self.compiled.detectors.iter();
        let pushes = |law| matches!(law, ContactLaw::Observe | ContactLaw::Penalty { .. });
        let answering = detectors.find(|it| !pushes(it.law));
        answering.map_or(Ok(()), |detector| {
            let field = fields.set.label(detector.leaf);
            Err(StepError::SchemeAtHits { field, scheme })
        })
    }

    /// Returns an error unless a state that was read from elsewhere has a body at its present pose in this world.
    fn recognise(&mut self, state: &FieldState, view: &WorldRef<'_>) -> Result<(), StepError> {
        let known = state
            .evaluation
            .as_ref()
            .filter(|_| !state.records.is_empty());
        let Some(evaluation) = known.filter(|_| !self.met) else {
            self.met = true;
            return Ok(());
        };
        let known = evaluation.bodies.iter().zip(&state.records);
        let stands = |(handle, was): (&RigidBodyHandle, &BodyRecord)| {
            let body = view.body(*handle);
            body.is_some_and(|body| *body.position() == was.pose)
        };
        let any = known.clone().any(stands);
        self.met |= any || evaluation.bodies.is_empty();
        match evaluation.bodies.first() {
            Some(body) if !any => Err(StepError::OtherWorld { body: *body }),
            _ => Ok(()),
        }
    }

    /// When fields meet a world for the first time, all anchors must be in it. An anchor that is missing later was
    /// removed, and its fields are defined nowhere from then on.
    fn check_anchors(
        &mut self,
        set: &FieldSet,
        state: &mut FieldState,
        view: &WorldRef<'_>,
    ) -> Result<(), StepError> {
        let counts = [view.body_count(), view.collider_count()];
        let edited = state.mark != Some(set.mark());
        let known = state.anchored.map_or([None; 2], |known| known.map(Some));
        self.other_bodies = known[0] != Some(counts[0]);
        self.other_colliders = known[1] != Some(counts[1]);
        if !edited && state.anchored == Some(counts) {
            return Ok(());
        }
        let first = state.anchored.is_none() || edited;
        let anchors = self.compiled.anchors.moving();
        let missing = anchors.filter(|(_, anchor)| view.frame(anchor).is_none());
        let missing: Vec<_> = missing.map(|(id, a)| (id as usize, *a)).collect();
        for (number, anchor) in missing {
            if state.removed.contains(&anchor) {
                continue;
            }
            let error = missing_anchor(self.prepared(set), number);
            let StepError::MissingAnchor { field, .. } = &error else {
                continue;
            };
            if first {
                return Err(error);
            }
            let field = field.clone();
            self.warnings.push(StepWarning::AnchorRemoved { field });
            state.removed.push(anchor);
        }
        state.anchored = Some(counts);
        Ok(())
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
        let properties = &self.properties;
        let displaced = self.compiled.requirements.displaced;
        self.detector
            .run(&self.compiled, &view, moment, None, |samples| {
                Self::sites(properties, &view, displaced, samples);
            });
        let contacts = &self.detector.contacts;
        Some(crate::cross_check::expect(settings, contacts, &view))
    }

    fn begin_audit(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &WorldMut<'_>,
    ) -> Tally {
        if !fields.settings.audit {
            return Tally::default();
        }
        let view = world.view();
        let (_, samples) =
            Self::sample_everyone(&self.properties, &view, self.compiled.requirements);
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
    /// all bodies. Returns true if no field reaches any body, and whether sleepers are evaluated.
    fn begin_bodies(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &mut WorldMut<'_>,
    ) -> Result<(bool, bool), StepError> {
        let dt = world.integration_parameters.dt;
        let first = is_new(fields, state);
        self.restless.clear();
        (self.at_centres, self.held_is_known, self.pushed_is_known) = (false, false, false);
        let sleepers = self.looks_at_sleepers(fields, state, &world.view());
        if !sleepers && !first && self.is_idle(fields, world) {
            self.turn_freely(world.integration_parameters);
            self.write_first(state, world);
            self.rollback.clear();
            self.retire(state);
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
            sleepers,
            all: first || self.other_bodies,
            besides: &[],
        };
        self.read(world, wanted);
        self.weigh(state, world);
        self.see();
        let remade = self.gather(&world.view(), false);
        let anew = remade || first || self.is_stale(fields.set, state, &world.view(), dt);
        // If nothing has moved since, no contact has changed.
        self.pushed_is_known = !anew && self.pushed_after == Some(state.steps);
        self.find_held(fields, world, None);
        let scheme = fields.settings.scheme;
        // Under other schemes the last step has not placed the samples.
        let there = self.samples.are_placed && scheme == Scheme::KickDriftKick;
        if anew || self.compiled.reads_velocity || !there {
            self.place();
        }
        self.stopwatch.lap(StepStage::Samples);
        if anew {
            self.evaluate_anew(fields, state, world, first)?;
        } else if fields.settings.scheme.chooses() {
            self.look_again(fields, state, world);
        }
        self.stopwatch.lap_if(anew, StepStage::Evaluation);
        state.mark = Some(fields.set.mark());
        self.move_first(fields, state, world)?;
        self.stopwatch.lap(StepStage::Motion);
        Ok((false, sleepers))
    }

    /// Returns true if the wrenches on sleepers may have changed since they fell asleep.
    fn looks_at_sleepers(
        &self,
        fields: &Definition<'_>,
        state: &FieldState,
        view: &WorldRef<'_>,
    ) -> bool {
        if fields.settings.wake == WakePolicy::Never {
            return false;
        }
        if is_new(fields, state) || state.steps == 0 {
            return true;
        }
        let moved = |(anchor, frame): &(Anchor, Option<_>)| view.frame(anchor) != *frame;
        !state.resting.is_empty() && (self.compiled.reads_time || state.carriers.iter().any(moved))
    }

    /// Recomputes the masses of bodies that are new or were moved: Rapier does so only in its next step, and an impulse
    /// before it would be lost.
    fn weigh(&mut self, state: &FieldState, world: &mut WorldMut<'_>) {
        for place in 0..self.bodies.len() {
            let body = &self.bodies[place];
            let known = state.evaluation.as_ref().and_then(|last| {
                let place = find_near(&last.bodies, place, body.handle)?;
                state.records.get(place)
            });
            let stands = known.is_some_and(|was| {
                was.pose == body.pose
                    && was.sleeping == body.sleeping
                    && was.colliders == body.colliders
            });
            if stands {
                continue;
            }
            if let Some(weighed) = bridge::weigh(world, body.handle) {
                self.bodies[place] = weighed;
            }
        }
    }

    /// Returns true if the evaluation that the last step left is not valid for this one.
    fn is_stale(&self, set: &FieldSet, state: &FieldState, view: &WorldRef<'_>, dt: Real) -> bool {
        let Some(evaluation) = &state.evaluation else {
            return true;
        };
        // Its lifetimes were evaluated for the last step.
        let both = Span {
            start: state.time - to_f64(evaluation.dt),
            end: state.time + to_f64(dt),
        };
        let reads_velocity = self.compiled.reads_velocity;
        let same = |(body, was): (&crate::rigid::Body, &BodyRecord)| {
            was.pose == body.pose
                && was.sleeping == body.sleeping
                && (!reads_velocity || (was.linvel == body.linvel && was.angvel == body.angvel))
        };
        evaluation.outdated
            || evaluation.dt != dt
            || set.changes_in(both)
            || evaluation.bodies != self.samples.bodies
            || !self.bodies.iter().zip(&state.records).all(same)
            || state
                .carriers
                .iter()
                .any(|(anchor, was)| view.frame(anchor) != *was)
    }

    fn evaluate_anew(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &WorldMut<'_>,
        first: bool,
    ) -> Result<(), StepError> {
        let dt = world.integration_parameters.dt;
        let mut last = state.evaluation.take().unwrap_or_default();
        let all = first || last.bodies != self.samples.bodies;
        let mut evaluation = std::mem::take(&mut self.spare);
        let now = Now::first(state.time, dt);
        let outcome = self.evaluate(fields, world, now, &mut evaluation);
        if !self.condemned.is_empty() {
            last.remove(&self.condemned);
        }
        let (view, exact) = (world.view(), self.exact_turns(fields));
        let rules = Self::rules(&self.links, &self.held, exact, fields, world);
        let context = Self::context(
            &view,
            &self.compiled,
            &self.samples,
            &self.bodies,
            now,
            rules,
        );
        let (integrator, warnings) = (&mut self.integrator, &mut self.warnings);
        if outcome.is_ok() {
            let stiff = &mut state.stiff;
            integrator.predict(&context, &mut evaluation, &last, all, stiff, warnings);
            if !fields.settings.scheme.kicks_twice() {
                integrator.watch(&context, &evaluation, &last, warnings);
            }
        }
        self.spare = last;
        outcome?;
        state.evaluation = Some(evaluation);
        self.note_carriers(state, &view);
        Ok(())
    }

    /// Under a scheme that chooses, linearises bodies again whose velocities were changed by hand.
    fn look_again(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &WorldMut<'_>,
    ) {
        let changed = |(body, was): (&Body, &BodyRecord)| {
            was.linvel != body.linvel || was.angvel != body.angvel
        };
        let places = self.bodies.iter().zip(&state.records).enumerate();
        let places = places.filter(|(_, pair)| changed(*pair)).map(|it| it.0);
        let places: Vec<usize> = places.collect();
        if places.is_empty() {
            return;
        }
        let Some(mut evaluation) = state.evaluation.take() else {
            return;
        };
        let (view, dt) = (world.view(), world.integration_parameters.dt);
        let rules = Self::rules(&[], &NONE, false, fields, world);
        let context = Self::context(
            &view,
            &self.compiled,
            &self.samples,
            &self.bodies,
            Now::first(state.time, dt),
            rules,
        );
        self.integrator.look_again(
            &context,
            &mut evaluation,
            places.into_iter(),
            &mut state.stiff,
        );
        state.evaluation = Some(evaluation);
    }

    /// Records the frames of all anchors that are not on sampled bodies.
    pub(super) fn note_carriers(&self, state: &mut FieldState, view: &WorldRef<'_>) {
        state.carriers.clear();
        for (_, anchor) in self.compiled.anchors.moving() {
            let carrier = match anchor {
                Anchor::World { .. } => continue,
                Anchor::Body { handle, .. } => Some(*handle),
                Anchor::Collider { handle, .. } => view
                    .collider(*handle)
                    .and_then(|collider| collider.parent()),
            };
            // Colliders of sampled bodies are covered by the samples.
            let sampled = |body: RigidBodyHandle| {
                let parts = self.compiled.requirements.parts;
                let whole = parts || matches!(anchor, Anchor::Body { .. });
                whole && self.samples.of_body(body).is_some()
            };
            if !carrier.is_some_and(sampled) {
                state.carriers.push((*anchor, view.frame(anchor)));
            }
        }
    }

    fn move_first(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &mut WorldMut<'_>,
    ) -> Result<(), StepError> {
        let dt = world.integration_parameters.dt;
        self.find_restless(state, world);
        let Some(evaluation) = &state.evaluation else {
            return Ok(());
        };
        let policy = fields.settings.wake;
        let wrenches = &evaluation.wrenches;
        state
            .resting
            .decide(&self.bodies, wrenches, policy, &mut self.acting);
        let (view, exact) = (world.view(), self.exact_turns(fields));
        let sift = |fault: &Fault| sifted(fields.set, fault);
        let rules = Self::rules(&self.links, &self.held, exact, fields, world);
        let rules = MotionRules {
            reactions: Some(&state.reactions),
            ..answering(rules, self.on_fault, &sift)
        };
        let context = Self::context(
            &view,
            &self.compiled,
            &self.samples,
            &self.bodies,
            Now::first(state.time, dt),
            rules,
        );
        let (integrator, motions) = (&mut self.integrator, &mut self.motions);
        let outcome = {
            let acts = super::acts(policy, &self.acting);
            integrator.first_half(&context, evaluation, &acts, motions)
        };
        if outcome.is_ok() {
            integrator.warn_of_ways(&context, &mut self.warnings);
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
            self.stepped.note_condemned(world.bodies, &self.condemned);
        }
        bridge::apply(world.bodies, &motions.loads, &mut open.overrides);
        open.steady
            .extend(motions.turns.iter().map(|turn| turn.body));
        bridge::write(world.bodies, &motions.updates);
        bridge::rouse(world.bodies, &self.restless);
        bridge::quarantine(world.bodies, &self.condemned);
    }

    /// Collects the bodies that are about to fall asleep under unbalanced forces.
    pub(super) fn find_restless(&mut self, state: &mut FieldState, world: &WorldMut<'_>) {
        let was_drowsing = std::mem::take(&mut state.drowsing);
        let balance = Balance {
            constraints: Constraints::new(world),
            gravity: world.gravity,
            parameters: world.integration_parameters,
            drowsing: &was_drowsing,
            varies: self.compiled.reads_time,
        };
        let evaluation = state.evaluation.as_ref();
        let wrench = |body: &Body| evaluation.and_then(|it| it.wrench(body.handle));
        let drowsy = self.bodies.iter().filter(|body| body.drowsy > 0.0);
        let bodies = drowsy.map(|body| (body, wrench(body).unwrap_or(Wrench::ZERO)));
        balance.find_restless(bodies, &mut state.drowsing, &mut self.restless);
        self.stepped.drowsing = Some(was_drowsing);
    }

    /// Records the bodies at the start of the step, before fields act on them, for contacts.
    fn note_starts(&mut self, world: &WorldMut<'_>) {
        if !self.compiled.detectors.is_empty() {
            let starts = Arc::make_mut(&mut self.detector.starts);
            starts.before(&world.view(), world.gravity, world.integration_parameters);
        }
    }

    /// Records them after the first kicks.
    fn note_kicks(
        &mut self,
        fields: &Definition<'_>,
        evaluation: Option<&Evaluation>,
        world: &WorldMut<'_>,
    ) {
        if self.compiled.detectors.is_empty() {
            return;
        }
        let motions = &self.motions;
        let turns = motions.turns.iter();
        let momenta = turns.filter_map(|turn| match turn.after {
            TurnAfter::Momentum(momentum) => Some((turn.body, [momentum, turn.twist])),
            TurnAfter::Velocity(_) => None,
        });
        let whole = fields.settings.scheme.kicks_once();
        let arrival = |body| {
            Some(Arrival {
                linvel: motions.arrival(body)?,
                first: evaluation?.wrench(body)?,
            })
        };
        let share = |body| match motions.completion(body) {
            Some(rest) if rest.is_settled() => KickShare::Within(arrival(body)),
            _ if whole => KickShare::Whole,
            rest => KickShare::Half {
                free: rest.is_some_and(Completion::is_free),
            },
        };
        Arc::make_mut(&mut self.detector.starts).after(&world.view(), share, momenta);
    }

    /// The pairs that are Rapier's, because no detection field acts at their present poses.
    fn release(&mut self, state: &FieldState, world: &WorldMut<'_>) -> Pairs {
        let (view, claims, properties) = (world.view(), &self.claims, &self.properties);
        let pairs = world.narrow_phase.contact_pairs();
        let pairs = pairs.map(|pair| [pair.collider1, pair.collider2]);
        let claimed = pairs.filter(|pair| claims.law(*pair).is_some());
        let moment = moment(state.time, world.integration_parameters.dt);
        let displaced = self.compiled.requirements.displaced;
        let sites = |samples: &mut _| Self::sites(properties, &view, displaced, samples);
        self.detector
            .released(&self.compiled, &view, claimed, moment, sites)
    }

    /// Gives the colliders whose contacts are claimed or checked the hook bits that they need, and restores the bits of
    /// those that no longer need them.
    fn listen(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &mut WorldMut<'_>,
    ) {
        let check = &fields.settings.cross_check;
        let fresh = check.on && !check.lets_recycle();
        let (view, starts) = (world.view(), &self.detector.starts);
        self.calm
            .find(&self.claims, starts, &view, world.integration_parameters);
        let wanted = |collider| {
            let mut bits = ActiveHooks::empty();
            if !self.calm.is_quiet(collider) {
                bits |= self.claims.bits(collider);
            }
            if fresh && self.watched.contains_key(&collider) {
                bits |= ActiveHooks::FILTER_CONTACT_PAIRS;
            }
            bits
        };
        let listening = &mut state.listening;
        if listening.any_free(wanted) {
            for (collider, own) in Arc::make_mut(listening).release(wanted) {
                bridge::set_hooks(world, collider, own);
            }
        }
        let view = world.view();
        let silent = self.watched.keys().filter_map(|collider| {
            let own = view.collider(*collider)?.active_hooks();
            let bits = wanted(*collider);
            (!own.contains(bits)).then_some((*collider, own, bits))
        });
        let silent: Vec<_> = silent.collect();
        for (collider, own, bits) in silent {
            bridge::set_hooks(world, collider, own | bits);
            Arc::make_mut(listening).add(collider, own);
        }
    }
}

/// Returns true if fields or properties were edited since the last step.
fn is_new(fields: &Definition<'_>, state: &FieldState) -> bool {
    state.mark != Some(fields.set.mark())
}

/// Takes back the writes of a step that was never finished.
pub(super) fn take_back(open: &OpenRecord, world: &mut WorldMut<'_>) {
    bridge::restore(world.bodies, &open.overrides);
    bridge::let_precess(world.bodies, &open.steady);
    bridge::give_back(world.soft_bodies, &open.lent);
}
