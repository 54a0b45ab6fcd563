//! The forces on bodies with their derivatives by place and velocity.

use std::cell::{LazyCell, OnceCell};
use std::ops::Deref;

use super::drags::drag_on;
use super::far::{FarRadials, is_far};
use super::frames::FrameCache;
use super::index::ProgramIndex;
use super::interpreter::Interpreter;
use super::quantity::{Quantity, Terms};
use super::sampled_world::SampledWorld;
use super::sources::Sources;
use crate::compile::{Key, Program, RadialBatch};
use crate::field::{Dual, Frames, Linearised, Motion, Query, SamplingRule, Vec3};
use crate::math::{DMat3, DVec3, to_dvec3, to_f64};
use crate::sample::{Kind, Moment, SamplePoint, Samples};

/// A sample of a body: its query, and its motion as numbers that carry derivatives.
struct Seeded {
    query: Query,
    motion: OnceCell<Motion<Dual<6>>>,
}

impl Seeded {
    fn new(samples: &Samples, sample: &SamplePoint, moment: Moment) -> Self {
        Seeded {
            query: samples.query(sample, moment),
            motion: OnceCell::new(),
        }
    }

    fn motion(&self) -> &Motion<Dual<6>> {
        self.motion.get_or_init(|| Motion::seeded(&self.query))
    }
}

/// A force with its derivatives, in two parts.
#[derive(Default)]
struct ForceSum {
    /// The sum of forces that carry derivatives.
    varying: Option<Vec3<Dual<6>>>,
    /// The sum of forces with derivatives in closed form.
    closed: Linearised,
}

impl ForceSum {
    fn add(&mut self, closed: &Linearised) {
        self.closed.force += closed.force;
        self.closed.by_position += closed.by_position;
        self.closed.by_velocity += closed.by_velocity;
    }

    fn vary(&mut self, force: Vec3<Dual<6>>) {
        match &mut self.varying {
            Some(sum) => *sum += force,
            none => *none = Some(force),
        }
    }

    fn total(mut self) -> Linearised {
        if let Some(varying) = self.varying {
            self.add(&Linearised::new(varying));
        }
        self.closed
    }
}

/// Evaluates forces with their derivatives; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(crate) struct Lineariser {
    frames: FrameCache,
    index: ProgramIndex,
    machine: Interpreter,
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

    /// Visits the samples of one body with the force there and its derivatives by the place and velocity of the
    /// sample, in the world as it was [prepared](Self::prepare). Constant fields, which have no derivatives, and
    /// terms that are not asked for are left out, also from the force.
    pub(crate) fn of_body(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        terms: Terms,
        body: usize,
        mut visit: impl FnMut(&SamplePoint, &Linearised),
    ) {
        let (all, samples, moment) = (terms == Terms::All, scene.samples, scene.moment);
        let list = samples.of(body).into_iter().flatten();
        let list = list.map(|number| (samples.at(number), false));
        for (sample, whole) in [(samples.centres[body], true)].into_iter().chain(list) {
            let sample = &sample;
            let wanted = |how: SamplingRule| {
                let at_centre = samples.asks_whole(how) && sample.kind == Kind::Centre;
                at_centre == whole && samples.takes(how, sample)
            };
            // Made when needed: most bodies are sampled in one way, and have no force at their other samples.
            let seeded = LazyCell::new(|| Seeded::new(samples, sample, moment));
            let mut force = None;
            let radials = scene.compiled.radials.iter();
            for (number, batch) in radials.filter(|it| all && wanted(it.1.how)) {
                let weight = to_f64(samples.weight(sample, &batch.weighting, moment));
                if weight != 0.0 && batch.prototype.is_on(moment.span) {
                    self.take_up(scene, number, batch);
                    let sum = &mut force.get_or_insert_with(ForceSum::default).closed;
                    if !is_far(batch) || !self.far.linearise(number, batch, sample, weight, sum) {
                        let (sources, _) = &self.sources[number as usize];
                        sources.linearise(batch, sample, weight, sum);
                    }
                }
            }
            let wanted = |program: &Program| wanted(program.how);
            self.programs_on(scene, sample, &seeded, terms, wanted, &mut force);
            if let Some(force) = force {
                visit(sample, &force.total());
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
            // Gathered for far fields too: cells cannot hold sources without a finite place.
            sources.refresh(batch, frame, Quantity::Force);
        }
    }

    fn programs_on(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        sample: &SamplePoint,
        seeded: &impl Deref<Target = Seeded>,
        terms: Terms,
        wanted: impl Fn(&Program) -> bool,
        force: &mut Option<ForceSum>,
    ) {
        self.index
            .at(scene.compiled, sample.world_point, &mut self.found);
        for (_, number) in &self.found {
            let program = scene.compiled.programs.get(*number);
            let asked = |program: &&Program| match terms {
                Terms::All => true,
                Terms::ThatReadVelocities => program.reads_velocity,
                Terms::ThatReadVelocitiesOtherwise => {
                    program.reads_velocity && program.as_drag().is_none()
                }
            };
            let Some(program) = program.filter(asked).filter(|program| wanted(program)) else {
                continue;
            };
            for instance in self.index.reach(*number).at(program, sample.world_point) {
                self.frames.fill_instance(scene, program, *instance);
                let query = &seeded.query;
                let (instance, frames) = (*instance as usize, self.frames.all());
                let sum = force.get_or_insert_with(ForceSum::default);
                if let Some(drag) = drag_on(program, instance, frames, query, terms) {
                    sum.add(&drag);
                    continue;
                }
                let (machine, motion) = (&mut self.machine, seeded.motion());
                if let Some(outcome) = machine.run(program, instance, frames, query, motion) {
                    sum.vary(outcome.force);
                }
            }
        }
    }
}

impl Sources {
    /// Adds the force s d of each source on a sample, and its derivative s + 2 s' d dᵀ, where s' is the
    /// derivative of s by r².
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
                if r2 > range * range {
                    continue;
                }
                let (factor, by_r2) = slope(r2);
                let weight = weight * to_f64(self.strength[at]);
                let (factor, along) = (factor * weight, d * (2.0 * by_r2 * weight));
                sum.force += d * factor;
                sum.by_position += DMat3::from_cols(along * d.x, along * d.y, along * d.z);
                sum.by_position += DMat3::from_diagonal(DVec3::splat(factor));
            }
        });
    }
}
