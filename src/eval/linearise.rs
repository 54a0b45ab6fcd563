//! The forces on bodies with their derivatives by position and velocity.

use std::cell::LazyCell;
use std::ops::Deref;

use super::far::{FarRadials, is_far};
use super::frames::FrameCache;
use super::index::ProgramIndex;
use super::interpreter::Interpreter;
use super::quantity::{Quantity, Terms};
use super::sampled_world::SampledWorld;
use super::sources::Sources;
use crate::compile::{Key, Program, RadialBatch};
use crate::field::{Frame, Frames, Linearised, Motion, Query, SamplingRule};
use crate::math::{to_dvec3, to_f64};
use crate::number::Dual;
use crate::sample::{Kind, SamplePoint};

/// Evaluates forces with their derivatives; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(crate) struct Lineariser {
    frames: FrameCache,
    index: ProgramIndex,
    interpreter: Interpreter,
    found: Vec<(Key, u32)>,
    /// For each batch, its sources; true if they are those of the prepared world.
    sources: Vec<(Sources, bool)>,
    far: FarRadials,
}

impl Lineariser {
    /// Updates the index to the present anchors, and forgets frames and sources of earlier worlds.
    pub(crate) fn prepare(&mut self, scene: &SampledWorld<'_, impl Frames>) {
        self.frames.clear(scene.compiled);
        self.index.refresh(scene, &mut self.frames);
        self.sources
            .iter_mut()
            .for_each(|(_, known)| *known = false);
    }

    /// Visits the samples of one body with the force there and its derivatives by the position and velocity of the
    /// sample, in the world as it was [prepared](Self::prepare). Constant fields, which have no derivatives, and
    /// terms that are not selected are left out, also from the force.
    pub(crate) fn of_body(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        terms: Terms,
        body: usize,
        mut visit: impl FnMut(&SamplePoint, &Linearised),
    ) {
        let (all, samples, moment) = (terms == Terms::All, scene.samples, scene.moment);
        let list = samples.each_of(body).map(|sample| (sample, false));
        for (sample, whole) in [(samples.centres[body], true)].into_iter().chain(list) {
            let sample = &sample;
            let wanted = |rule: SamplingRule| {
                let at_centre = samples.asks_whole(rule) && sample.kind == Kind::Centre;
                at_centre == whole && samples.takes(rule, sample)
            };
            // Lazy: most bodies are sampled in one way, and have no force at their other samples.
            let query = LazyCell::new(|| samples.query(sample, moment));
            let mut force: Option<Linearised> = None;
            let radials = scene.compiled.radials.iter();
            for (number, batch) in radials.filter(|it| all && wanted(it.1.sampling_rule)) {
                let weight = to_f64(samples.weight(sample, &batch.weighting, moment));
                if weight != 0.0 && batch.prototype.is_on(moment.span) {
                    self.take_up(scene, number, batch);
                    let sum = force.get_or_insert_default();
                    if !is_far(batch) || !self.far.linearise(number, batch, sample, weight, sum) {
                        let (sources, _) = &self.sources[number as usize];
                        sources.linearise(batch, sample, weight, sum);
                    }
                }
            }
            let wanted = |program: &Program| wanted(program.sampling_rule);
            self.programs_on(scene, sample, &query, terms, wanted, &mut force);
            if let Some(force) = force {
                visit(sample, &force);
            }
        }
    }

    /// Gathers the sources of a batch, once for a prepared world.
    fn take_up(&mut self, scene: &SampledWorld<'_, impl Frames>, number: u32, batch: &RadialBatch) {
        let place = number as usize;
        if self.sources.len() <= place {
            self.sources.resize_with(place + 1, Default::default);
        }
        let (sources, known) = &mut self.sources[place];
        if !std::mem::replace(known, true) {
            let frames = &mut self.frames;
            let mut frame = |anchor| frames.get(scene, anchor);
            if is_far(batch) {
                self.far.sort(number, batch, &mut frame, Quantity::Force);
            }
            // Gathered for far fields too: cells cannot hold sources whose position is not finite.
            sources.refresh(batch, frame, Quantity::Force);
        }
    }

    fn programs_on(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        sample: &SamplePoint,
        query: &impl Deref<Target = Query>,
        terms: Terms,
        wanted: impl Fn(&Program) -> bool,
        force: &mut Option<Linearised>,
    ) {
        self.index
            .at(scene.compiled, sample.world_point, &mut self.found);
        for (_, number) in &self.found {
            let program = scene.compiled.programs.get(*number);
            let is_read = |program: &&Program| match terms {
                Terms::All => true,
                Terms::ThatReadVelocities => program.reads_velocity,
                Terms::ThatReadVelocitiesOtherwise => {
                    program.reads_velocity && program.as_drag().is_none()
                }
            };
            let Some(program) = program.filter(is_read).filter(|program| wanted(program)) else {
                continue;
            };
            for instance in self.index.reach(*number).at(program, sample.world_point) {
                self.frames.fill_instance(scene, program, *instance);
                let (instance, frames) = (*instance as usize, self.frames.all());
                let (interpreter, sum) = (&mut self.interpreter, force.get_or_insert_default());
                let found = match terms {
                    Terms::All => {
                        let motion = Motion::seeded(query);
                        interpreter.linearise(program, instance, frames, query, &motion)
                    }
                    _ => {
                        let motion = Motion::by_velocity(query);
                        interpreter.linearise(program, instance, frames, query, &motion)
                    }
                };
                found.iter().for_each(|found| sum.add(found));
            }
        }
    }
}

impl Interpreter {
    /// The force of an instance of a program, with the derivatives that the motion carries.
    fn linearise<const K: usize>(
        &mut self,
        program: &Program,
        instance: usize,
        frames: &[Option<Frame>],
        query: &Query,
        motion: &Motion<Dual<K>>,
    ) -> Option<Linearised> {
        let outcome = self.run(program, instance, frames, query, motion)?;
        Some(Linearised::new(outcome.force))
    }
}

impl Sources {
    /// Adds the force of each source on a sample, with its derivative by position.
    fn linearise(
        &self,
        batch: &RadialBatch,
        sample: &SamplePoint,
        weight: f64,
        sum: &mut Linearised,
    ) {
        let (point, slope) = (to_dvec3(sample.world_point), batch.law.slope());
        let range = batch.range.map_or(f64::INFINITY, to_f64);
        self.for_each_near(sample.world_point, batch.range, |run| {
            for at in run.filter(|at| self.owner[*at] != sample.owner) {
                let d = point - self.point(at);
                let r2 = d.length_squared();
                if r2 <= range * range {
                    let weight = weight * to_f64(self.strength[at]);
                    sum.add_central(d, slope(r2), weight);
                }
            }
        });
    }
}
