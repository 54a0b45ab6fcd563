//! Checks of fields, state and world before a step writes anything.

use super::state::BodyRecord;
use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{StepError, WorldRef};
use crate::diagnose::missing_anchor;
use crate::field::{ContactLaw, FieldSet, Frames};
use crate::integrate::StepWarning;
use crate::math::RigidBodyHandle;
use crate::rigid::Lookup;

impl FieldPipeline {
    /// Returns an error if fields answer contacts under a scheme that does not keep the energy of bodies that are hit.
    pub(super) fn check_scheme(&self, fields: &Definition<'_>) -> Result<(), StepError> {
        let (scheme, answer) = (fields.settings.scheme, fields.settings.rules.answer_any());
        if !answer || !scheme.kicks_once() || !self.scene.compiled.varies() {
            return Ok(());
        }
        let mut detectors = self.scene.compiled.detectors.iter();
        let pushes = |law| matches!(law, ContactLaw::Observe | ContactLaw::Penalty { .. });
        let answering = detectors.find(|it| !pushes(it.law));
        answering.map_or(Ok(()), |detector| {
            let field = fields.set.field_ref(detector.leaf);
            Err(StepError::SchemeAtHits { field, scheme })
        })
    }

    /// Returns an error unless a state that was read from elsewhere has a body at its present pose in this world.
    pub(super) fn recognise(
        &mut self,
        state: &FieldState,
        view: &WorldRef<'_>,
    ) -> Result<(), StepError> {
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
    pub(super) fn check_anchors(
        &mut self,
        set: &FieldSet,
        state: &mut FieldState,
        view: &WorldRef<'_>,
    ) -> Result<(), StepError> {
        let counts = [view.bodies.len(), view.colliders.len()];
        let edited = state.mark != Some(set.mark());
        let changed = |of: usize| state.anchored.is_none_or(|known| known[of] != counts[of]);
        (self.other_bodies, self.other_colliders) = (changed(0), changed(1));
        if !edited && state.anchored == Some(counts) {
            return Ok(());
        }
        let first = state.anchored.is_none() || edited;
        let anchors = self.scene.compiled.anchors.moving();
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
}
