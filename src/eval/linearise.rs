//! The forces on bodies with their derivatives.

use super::frames::FrameCache;
use super::index::ProgramIndex;
use super::interpreter::Interpreter;
use crate::compile::{Compiled, Key, Program, RadialBatch};
use crate::field::{
    Dual, Frames, Linearised, LocalQuery, Motion, Query, Sampling, SamplingRule, Vec3, constant,
};
use crate::math::{DVec3, to_dvec3, to_f64};
use crate::sample::{Kind, Moment, SamplePoint, Samples};

/// One sample of a body: what is asked, and how it moves.
struct Seeded {
    query: Query,
    motion: Motion<Dual>,
}

impl Seeded {
    fn new(samples: &Samples, sample: &SamplePoint, moment: Moment) -> Self {
        let query = samples.query(sample, moment);
        Seeded {
            motion: Motion::seeded(&query),
            query,
        }
    }
}

/// Evaluates forces with their derivatives; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(crate) struct Lineariser {
    frames: FrameCache,
    index: ProgramIndex,
    machine: Interpreter<Dual>,
    found: Vec<(Key, u32)>,
}

impl Lineariser {
    /// Takes up where all anchors are.
    pub(crate) fn prepare(&mut self, compiled: &Compiled, world: &impl Frames) {
        self.frames.clear(compiled);
        self.index.refresh(compiled, &mut self.frames, world);
    }

    /// Visits the samples of one body with the force there and its derivatives by the place and
    /// velocity of the sample, in the world as it was [prepared](Self::prepare). Constant
    /// fields have none and are left out, force and all.
    pub(crate) fn of_body(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        samples: &Samples,
        moment: Moment,
        body: usize,
        mut visit: impl FnMut(&SamplePoint, &Linearised),
    ) {
        let list = samples
            .of(body)
            .into_iter()
            .flat_map(|range| &samples.list[range]);
        let whole = (&samples.centres[body], true);
        for (sample, whole) in [whole]
            .into_iter()
            .chain(list.map(|sample| (sample, false)))
        {
            let wanted = |how: SamplingRule| {
                let at_centre = how.sampling == Sampling::Centre && sample.kind == Kind::Centre;
                at_centre == whole && samples.takes(how, sample)
            };
            let seeded = Seeded::new(samples, sample, moment);
            let mut force = constant(DVec3::ZERO);
            let batches = compiled.radials.iter().map(|(_, batch)| batch);
            for batch in batches.filter(|batch| wanted(batch.how)) {
                force += self.batch_on(compiled, world, batch, &seeded);
            }
            force += self.programs_on((compiled, world), sample, &seeded, |p| wanted(p.how));
            visit(sample, &Linearised::new(&force));
        }
    }

    fn batch_on(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        batch: &RadialBatch,
        seeded: &Seeded,
    ) -> Vec3<Dual> {
        let range = batch.range.map_or(f64::INFINITY, to_f64);
        let mut sum = constant(DVec3::ZERO);
        for source in &batch.sources {
            let Some(frame) = self.frames.get(compiled, world, source.anchor) else {
                continue;
            };
            let centre = to_dvec3(frame.pose.translation);
            if centre.distance_squared(seeded.query.world_point) > range * range {
                continue;
            }
            if batch.prototype.acts_on(&seeded.query, &frame) {
                let local = LocalQuery::moving(&seeded.query, &seeded.motion, &frame);
                sum += batch.prototype.radial_force(&source.law_in(batch), &local);
            }
        }
        sum
    }

    fn programs_on(
        &mut self,
        (compiled, world): (&Compiled, &impl Frames),
        sample: &SamplePoint,
        seeded: &Seeded,
        wanted: impl Fn(&Program) -> bool,
    ) -> Vec3<Dual> {
        let mut sum = constant(DVec3::ZERO);
        self.index.at(compiled, sample.world_point, &mut self.found);
        for (_, number) in &self.found {
            let program = compiled.programs.get(*number);
            let Some(program) = program.filter(|program| wanted(program)) else {
                continue;
            };
            for instance in self.index.reach(*number).at(program, sample.world_point) {
                self.frames
                    .fill_instance(compiled, world, program, *instance);
                let Seeded { query, motion } = seeded;
                let (instance, frames) = (*instance as usize, self.frames.all());
                let machine = &mut self.machine;
                if let Some(outcome) = machine.run(program, instance, frames, query, motion) {
                    sum += outcome.force;
                }
            }
        }
        sum
    }
}
