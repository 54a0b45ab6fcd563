//! Records of the bodies at the end of a step, by which the next step detects bodies that were changed in between.

use super::state::BodyRecord;
use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{WakePolicy, WorldMut, WorldRef};
use crate::math::RigidBodyHandle;
use crate::rigid::{Body, Lookup, Wrench, find_next_place};

impl FieldPipeline {
    /// Records the state in which the step leaves the bodies.
    pub(super) fn record(&mut self, state: &mut FieldState) {
        let mut updates = self.late.updates.iter().peekable();
        state.records.clear();
        for body in &self.scene.bodies {
            let mut record = BodyRecord::of(body);
            if let Some(update) = updates.next_if(|update| update.body == body.handle) {
                (record.linvel, record.angvel) = (update.linvel, update.angvel);
                record.sleeping &= !update.wake;
            }
            state.records.push(record);
        }
    }

    /// Records the state in which Rapier's step leaves bodies that get no second half.
    pub(super) fn record_moved(&mut self, state: &mut FieldState, view: &WorldRef<'_>) {
        state.records.clear();
        let Some(evaluation) = &state.evaluation else {
            return;
        };
        let stands = |handle: &RigidBodyHandle| {
            let body = Body::of(*handle, view.body(*handle)?);
            Some(BodyRecord::of(&body))
        };
        let records = evaluation.bodies.iter().map_while(stands);
        state.records.extend(records);
        // A body was removed.
        if state.records.len() != evaluation.bodies.len() {
            state.records.clear();
        }
    }

    /// Records the wrenches under which bodies fell asleep in this step, because fields may be edited before the next
    /// evaluation.
    pub(super) fn note_sleepers(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        bodies: &[Body],
        world: &WorldMut<'_>,
    ) {
        self.note_sleepers_under(fields, state, bodies, world, |_| true);
    }

    /// Records the wrenches from before the step of bodies that fell asleep in it, if a field may have come to them
    /// since: they were at rest without it.
    pub(super) fn note_overtaken(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        bodies: &[Body],
        world: &WorldMut<'_>,
    ) {
        if self.is_carried(world) {
            // A force that reads velocities may have changed because the body stopped.
            let slows = self.scene.compiled.reads_velocity;
            let known = |wrench: Wrench| !slows || wrench == Wrench::ZERO;
            self.note_sleepers_under(fields, state, bodies, world, known);
        }
    }

    fn note_sleepers_under(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        bodies: &[Body],
        world: &WorldMut<'_>,
        is_wanted: impl Fn(Wrench) -> bool,
    ) {
        let Some(evaluation) = &state.evaluation else {
            return;
        };
        if !matches!(fields.settings.wake, WakePolicy::OnChange { .. }) {
            return;
        }
        let view = world.view();
        let asleep =
            |handle: RigidBodyHandle| view.body(handle).is_some_and(|body| body.is_sleeping());
        let (mut at, mut resting_at) = (0, 0);
        for body in bodies.iter().filter(|body| asleep(body.handle)) {
            let place = find_next_place(&evaluation.bodies, &mut at, body.handle);
            let wrench = place.and_then(|place| evaluation.wrenches.get(place).copied());
            if let Some(wrench) = wrench.filter(|it| is_wanted(*it)) {
                let resting = &mut state.resting;
                resting.resting_under(&mut resting_at, body.handle, wrench);
            }
        }
    }
}
