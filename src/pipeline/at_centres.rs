//! Steps in which fields act on bodies at their centres of mass only: each body is visited once before Rapier's step
//! and once after it, without a list of bodies or of samples.

mod block;
mod follow;
mod kicks;
mod pass;

use super::scene::Now;
use super::timings::span;
use super::{Definition, FieldPipeline, FieldState, OpenStep};
use crate::bridge::{self, Visit, WakePolicy, Wanted, WorldMut};
use crate::integrate::{Edges, FASTEST, Scheme};
pub(super) use block::BodyBlock;
use pass::{FirstHalf, HalfStep, Pass};

impl FieldPipeline {
    /// Returns true if fields, settings and world allow a step at centres of mass.
    pub(super) fn acts_at_centres(&self, fields: &Definition<'_>, world: &WorldMut<'_>) -> bool {
        let settings = fields.settings;
        let parameters = world.integration_parameters;
        let kicks = matches!(settings.scheme, Scheme::KickDriftKick | Scheme::Kick);
        self.scene.compiled.at_centres.is_some()
            && kicks
            && !settings.audit
            && settings.wake != WakePolicy::Always
            && self.scene.links.is_empty()
            && world.soft_bodies.is_empty()
            && parameters.dt > 0.0
            && parameters.max_linear_velocity() < FASTEST * 1e-3
    }

    /// Kicks all awake bodies, or loads those that are held. `None`, with the world unchanged, if one of them needs
    /// more than a visit.
    pub(super) fn begin_at_centres(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &mut WorldMut<'_>,
    ) -> Option<()> {
        let now = Now::first(state.time, world.integration_parameters.dt);
        let half = HalfStep {
            moment: now.moment(),
            dt: now.dt,
            last: state.evaluation.as_ref(),
            reactions: &state.reactions,
            all: self.other_bodies,
            first: None,
        };
        let edges = &mut state.edges;
        // Before the search for contacts, with the held bodies of the last step, most of which are still held.
        if self.pass(fields, &half, edges, world).is_blocked() {
            return None;
        }
        self.find_held(fields, world);
        self.keep_copies(fields, world);
        if !self.visit_centres(fields, &half, edges, world) {
            return None;
        }
        self.retire(state);
        std::mem::swap(&mut state.reactions, &mut self.motions.reactions);
        state.carriers.clear();
        state.resting.forget(self.shown.bodies.iter().copied());
        state.evaluation = Some(std::mem::take(&mut self.shown));
        self.find_restless(state, world);
        let loads = &self.motions.loads;
        if !self.alone {
            std::mem::swap(&mut self.stepped.before, &mut self.undo);
            let loaded = loads.iter().map(|load| load.body);
            self.stepped.note(world.bodies, loaded);
        }
        bridge::rouse(world.bodies, &self.restless);
        let turns = &self.motions.turns;
        if !loads.is_empty() || !turns.is_empty() {
            let record = &mut self.spare_record;
            let open = state.open.get_or_insert_with(|| std::mem::take(record));
            bridge::apply(world.bodies, loads, &mut open.overrides);
            open.steady.extend(turns.iter().map(|turn| turn.body));
        }
        Some(())
    }

    /// Completes the kicks; returns the number of bodies written to. `None`, with the world as Rapier left it, if one
    /// of them needs more than a visit.
    pub(super) fn finish_at_centres(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        open: &OpenStep,
        world: &mut WorldMut<'_>,
    ) -> Option<usize> {
        let now = Now::last(state.time, open.dt);
        let half = HalfStep {
            moment: now.moment(),
            dt: now.dt,
            last: state.evaluation.as_ref(),
            reactions: &state.reactions,
            all: false,
            first: Some(FirstHalf {
                motions: &open.motions,
                alone: open.alone,
            }),
        };
        let twice = fields.settings.scheme.kicks_twice();
        if twice {
            self.find_held(fields, world);
        }
        if twice && !self.visit_centres(fields, &half, &mut state.edges, world) {
            return None;
        }
        self.note_sleepers(fields, state, &open.bodies, world);
        self.sampled = state.evaluation.as_ref().map_or(0, |it| it.bodies.len());
        if !twice {
            return Some(0);
        }
        self.spare = state.evaluation.take().unwrap_or_default();
        state.evaluation = Some(std::mem::take(&mut self.shown));
        Some(self.undo.len())
    }

    /// Makes one half of a step. Returns false, with everything written taken back, if a body needs more than a visit.
    fn visit_centres(
        &mut self,
        fields: &Definition<'_>,
        half: &HalfStep<'_>,
        edges: &mut Edges,
        world: &mut WorldMut<'_>,
    ) -> bool {
        span!("visits");
        let told = self.warnings.len();
        self.motions.clear();
        std::mem::swap(&mut self.shown, &mut self.spare);
        self.shown.clear();
        (self.shown.dt, self.shown.outdated) = (half.dt, true);
        self.centres
            .begin(&self.scene.compiled, &world.view(), half.moment);
        let mut block = std::mem::take(&mut self.block);
        block.drowsy.clear();
        let done = self.pass(fields, half, edges, world).run(&mut block);
        std::mem::swap(&mut self.scene.bodies, &mut block.drowsy);
        self.block = block;
        self.blocker = done.err();
        if self.blocker.is_some() {
            self.warnings.truncate(told);
            std::mem::swap(&mut self.shown, &mut self.spare);
        }
        self.blocker.is_none()
    }

    fn pass<'a>(
        &'a mut self,
        fields: &Definition<'_>,
        half: &'a HalfStep<'a>,
        edges: &'a mut Edges,
        world: &'a mut WorldMut<'_>,
    ) -> Pass<'a> {
        let motion = self.scene.rules(fields, world);
        let wanted = Wanted {
            sleepers: false,
            all: half.all,
            besides: &[],
        };
        Pass {
            walk: self.reader.walk(world.bodies, world.islands, wanted),
            visit: Visit::new(world, &mut self.undo),
            blocker: self.blocker,
            compiled: &self.scene.compiled,
            half,
            motion,
            spins: &mut self.integrator.spins,
            evaluator: &mut self.centres,
            shown: &mut self.shown,
            motions: &mut self.motions,
            edges,
            warnings: &mut self.warnings,
        }
    }
}

#[cfg(test)]
mod tests;
