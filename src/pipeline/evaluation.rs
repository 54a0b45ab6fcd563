//! The evaluation with which a step begins: that of the step before, or a new one.

use super::scene::Now;
use super::state::BodyRecord;
use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{self, StepError, WorldMut, WorldRef};
use crate::field::{Anchor, FieldSet, Frames, Span};
use crate::integrate::Evaluation;
use crate::math::{Real, RigidBodyHandle, to_f64};
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

    /// Returns true if the evaluation that the last step left is not valid for this one.
    pub(super) fn is_stale(
        &self,
        set: &FieldSet,
        state: &FieldState,
        view: &WorldRef<'_>,
        dt: Real,
    ) -> bool {
        let Some(evaluation) = &state.evaluation else {
            return true;
        };
        // Its lifetimes were evaluated for the last step.
        let both = Span {
            start: state.time - to_f64(evaluation.dt),
            end: state.time + to_f64(dt),
        };
        let reads_velocity = self.scene.compiled.reads_velocity;
        let same = |(body, was): (&crate::rigid::Body, &BodyRecord)| {
            was.pose == body.pose
                && was.sleeping == body.sleeping
                && (!reads_velocity || (was.linvel == body.linvel && was.angvel == body.angvel))
        };
        evaluation.outdated
            || evaluation.dt != dt
            || set.changes_in(both)
            || evaluation.bodies != self.scene.samples.bodies
            || !self.scene.bodies.iter().zip(&state.records).all(same)
            || state
                .carriers
                .iter()
                .any(|(anchor, was)| view.frame(anchor) != *was)
    }

    pub(super) fn evaluate_anew(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &WorldMut<'_>,
        first: bool,
    ) -> Result<(), StepError> {
        let dt = world.integration_parameters.dt;
        let mut last = state.evaluation.take().unwrap_or_default();
        let all = first || last.bodies != self.scene.samples.bodies;
        let mut evaluation = std::mem::take(&mut self.spare);
        let now = Now::first(state.time, dt);
        let outcome = self.evaluate(fields, world, now, &mut evaluation);
        if !self.condemned.is_empty() {
            last.remove(&self.condemned);
        }
        let view = world.view();
        let context = self.scene.context(fields, world, &view, now);
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

    /// Records the frames of all anchors that are not on sampled bodies.
    pub(super) fn note_carriers(&self, state: &mut FieldState, view: &WorldRef<'_>) {
        state.carriers.clear();
        for (_, anchor) in self.scene.compiled.anchors.moving() {
            let carrier = anchor.carrier(|handle| view.collider(handle));
            // Colliders of sampled bodies are covered by the samples.
            let sampled = |body: RigidBodyHandle| {
                let parts = self.scene.compiled.requirements.parts;
                let whole = parts || matches!(anchor, Anchor::Body { .. });
                whole && self.scene.samples.of_body(body).is_some()
            };
            if !carrier.is_some_and(sampled) {
                state.carriers.push((*anchor, view.frame(anchor)));
            }
        }
    }
}
