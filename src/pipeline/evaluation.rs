//! The evaluation with which a step begins: that of the step before, or a new one.

use super::due::Due;
use super::scene::{Now, StepScene};
use super::state::BodyRecord;
use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{self, StepError, WorldMut, WorldRef};
use crate::field::{Anchor, FieldSet, Frames, Span};
use crate::integrate::{Evaluation, Scheme};
use crate::math::{Real, to_f64};
use crate::rigid::{Body, Lookup, find_next_place};

impl FieldPipeline {
    /// Recomputes the masses of bodies that are new or were moved: Rapier does so only in its next step, and an impulse
    /// before it would be lost.
    pub(super) fn weigh(&mut self, state: &FieldState, world: &mut WorldMut<'_>) {
        let Evaluation { bodies, parts, .. } = match &state.evaluation {
            Some(last) => last,
            None => &Evaluation::default(),
        };
        let mut at = 0;
        for place in 0..self.scene.bodies.len() {
            let body = &self.scene.bodies[place];
            let known = find_next_place(bodies, &mut at, body.handle);
            let known = known.and_then(|place| parts.get(place).zip(state.records.get(place)));
            let stands = known.is_some_and(|(parts, was)| {
                was.pose == body.pose && was.sleeping == body.sleeping && *parts == body.parts
            });
            if stands {
                continue;
            }
            if let Some(weighed) = bridge::weigh(world, body.handle) {
                self.scene.bodies[place] = weighed;
            }
        }
    }

    /// Finds the bodies for which the evaluation of the last step is not valid. `remade` is true if bodies have other
    /// parts than then.
    pub(super) fn find_due(
        &mut self,
        fields: &Definition<'_>,
        state: &FieldState,
        view: &WorldRef<'_>,
        dt: Real,
        remade: bool,
    ) -> Due {
        let Some(last) = &state.evaluation else {
            return Due::All;
        };
        if self.is_stale(fields.set, state, last, view, dt) {
            return Due::All;
        }
        let reads_velocity = self.scene.compiled.reads_velocity;
        let same = |body: &Body, was: &BodyRecord| {
            was.pose == body.pose
                && was.sleeping == body.sleeping
                && (!reads_velocity || (was.linvel == body.linvel && was.angvel == body.angvel))
        };
        let (bodies, records) = (&self.scene.bodies, &state.records);
        let all_same = || {
            bodies
                .iter()
                .zip(records)
                .all(|(body, was)| same(body, was))
        };
        if !remade && last.bodies == self.scene.samples.bodies && all_same() {
            return Due::None;
        }
        let divisible = self.scene.compiled.each_by_itself
            && fields.settings.scheme == Scheme::KickDriftKick
            && last.left_out.is_empty()
            && last.bodies.len() == records.len();
        if !divisible {
            return Due::All;
        }
        self.due.places.clear();
        let mut changed = self.gatherer.changed.iter().peekable();
        let mut at = 0;
        for (place, body) in bodies.iter().enumerate() {
            let is_changed = changed.next_if_eq(&&place).is_some();
            let known = find_next_place(&last.bodies, &mut at, body.handle);
            if is_changed || !known.is_some_and(|at| same(body, &records[at])) {
                self.due.places.push(place);
            }
        }
        // For more bodies, a second list of samples costs more than it saves.
        let few = self.due.places.len() * 2 <= bodies.len();
        if few { Due::Some } else { Due::All }
    }

    /// Returns true if an evaluation is not valid for this step, even for bodies that have not changed since.
    fn is_stale(
        &self,
        set: &FieldSet,
        state: &FieldState,
        evaluation: &Evaluation,
        view: &WorldRef<'_>,
        dt: Real,
    ) -> bool {
        // The evaluation weights lifetimes by their overlap with the last step.
        let both = Span {
            start: state.time - to_f64(evaluation.dt),
            end: state.time + to_f64(dt),
        };
        let mut carriers = state.carriers.iter();
        evaluation.outdated
            || evaluation.dt != dt
            || set.changes_in(both)
            || carriers.any(|(anchor, was)| view.frame(anchor) != *was)
    }

    /// Evaluates the fields on the bodies that are due; `due` is not `None`.
    pub(super) fn evaluate_anew(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &WorldMut<'_>,
        due: Due,
    ) -> Result<(), StepError> {
        let dt = world.integration_parameters.dt;
        let first = fields.are_new(state);
        let mut last = state.evaluation.take().unwrap_or_default();
        let all = first || last.bodies != self.scene.samples.bodies;
        let mut evaluation = std::mem::take(&mut self.spare);
        let now = Now::first(state.time, dt);
        let joined = due == Due::Some && self.evaluate_due(fields, world, now);
        let outcome = if joined {
            let (places, found) = (&self.due.places, &self.due.evaluation);
            evaluation.join(&self.scene.bodies, &last, places, found);
            Ok(())
        } else {
            self.evaluate(fields, world, now, &mut evaluation)
        };
        if !self.quarantined.is_empty() {
            last.remove(&self.quarantined);
        }
        let view = world.view();
        let context = self.scene.context(fields, world, &view, now);
        let (integrator, warnings) = (&mut self.integrator, &mut self.warnings);
        if outcome.is_ok() {
            let stiff = &mut state.stiff;
            integrator.predict(&context, &mut evaluation, &last, all, stiff, warnings);
            if !fields.settings.scheme.kicks_twice() {
                integrator.watch(&context, &evaluation, &last, warnings);
                integrator.follow_once(&context, &evaluation, &last, &mut state.edges);
            }
        }
        self.spare = last;
        outcome?;
        state.evaluation = Some(evaluation);
        self.note_carriers(state, &view);
        Ok(())
    }

    /// Evaluates the fields on the bodies listed in `due`. Returns false if a force cannot be given to Rapier.
    fn evaluate_due(&mut self, fields: &Definition<'_>, world: &WorldMut<'_>, now: Now) -> bool {
        let mut due = std::mem::take(&mut self.due);
        due.bodies.clear();
        let bodies = due.places.iter().map(|place| self.scene.bodies[*place]);
        due.bodies.extend(bodies);
        due.swap(&mut self.scene);
        let view = world.view();
        self.gatherer.make_besides(
            &mut self.scene.samples,
            &self.properties,
            self.scene.compiled.requirements,
            &self.scene.bodies,
            &view,
        );
        self.place();
        let context = self.scene.context(fields, world, &view, now);
        let outcome = self.integrator.evaluate(&context, &mut due.evaluation);
        due.swap(&mut self.scene);
        self.due = due;
        outcome.is_ok()
    }

    /// Under `Auto` and `PerBody`, linearises bodies again whose velocities the user has changed.
    pub(super) fn look_again(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &WorldMut<'_>,
    ) {
        let changed = |(body, was): (&Body, &BodyRecord)| {
            was.linvel != body.linvel || was.angvel != body.angvel
        };
        let places = self.scene.bodies.iter().zip(&state.records).enumerate();
        let places = places.filter(|(_, pair)| changed(*pair)).map(|it| it.0);
        let places: Vec<usize> = places.collect();
        if places.is_empty() {
            return;
        }
        let Some(mut evaluation) = state.evaluation.take() else {
            return;
        };
        let (view, dt) = (world.view(), world.integration_parameters.dt);
        let context = self
            .scene
            .context(fields, world, &view, Now::first(state.time, dt));
        self.integrator.look_again(
            &context,
            &mut evaluation,
            places.into_iter(),
            &mut state.stiff,
        );
        state.evaluation = Some(evaluation);
    }

    /// Records the frames of all anchors of forces that are not on sampled bodies.
    pub(super) fn note_carriers(&mut self, state: &mut FieldState, view: &WorldRef<'_>) {
        let StepScene {
            compiled, samples, ..
        } = &self.scene;
        let made_for = Some([compiled.revision, samples.stamp]);
        if std::mem::replace(&mut self.apart.made_for, made_for) != made_for {
            let parts = compiled.requirements.parts;
            // Colliders of sampled bodies are covered by the samples.
            let is_apart = |anchor: &&Anchor| {
                let carrier = anchor.carrier(|handle| view.collider(handle));
                let whole = parts || matches!(anchor, Anchor::Body { .. });
                !(whole && carrier.is_some_and(|body| samples.of_body(body).is_some()))
            };
            let anchors = compiled.moving_anchors_of_forces();
            self.apart.anchors.clear();
            self.apart.anchors.extend(anchors.filter(is_apart));
        }
        let anchors = self.apart.anchors.iter();
        let frames = anchors.map(|anchor| (*anchor, view.frame(anchor)));
        state.carriers.clear();
        state.carriers.extend(frames);
    }
}
