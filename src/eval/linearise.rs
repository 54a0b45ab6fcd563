//! The forces on bodies with their derivatives.

use std::cell::LazyCell;
use std::ops::Deref;

use super::frames::FrameCache;
use super::index::ProgramIndex;
use super::interpreter::Interpreter;
use crate::compile::{Compiled, Key, Program, RadialBatch, Step};
use crate::field::{
    Dual, Frame, Frames, Linearised, LocalQuery, Motion, Query, Sampling, SamplingRule, Vec3,
    constant,
};
use crate::math::{DMat3, DVec3, Vector, to_dvec3, to_f64};
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

/// A force with its derivatives, in two parts.
struct Sum {
    /// Of what carries derivatives along.
    varying: Vec3<Dual>,
    /// Of what has them in closed form.
    closed: Linearised,
}

impl Default for Sum {
    fn default() -> Self {
        Sum {
            varying: constant(DVec3::ZERO),
            // The default of a matrix is the identity.
            closed: Linearised {
                force: DVec3::ZERO,
                by_position: DMat3::ZERO,
                by_velocity: DMat3::ZERO,
            },
        }
    }
}

impl Sum {
    fn add(&mut self, closed: &Linearised) {
        self.closed.force += closed.force;
        self.closed.by_position += closed.by_position;
        self.closed.by_velocity += closed.by_velocity;
    }

    fn total(mut self) -> Linearised {
        self.add(&Linearised::new(&self.varying));
        self.closed
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
            // Most bodies are sampled in one way.
            let seeded = LazyCell::new(|| Seeded::new(samples, sample, moment));
            let mut force = None;
            let batches = compiled.radials.iter().map(|(_, batch)| batch);
            for batch in batches.filter(|batch| wanted(batch.how)) {
                let sum = force.get_or_insert_with(Sum::default);
                sum.varying += self.batch_on(compiled, world, batch, &seeded);
            }
            self.programs_on(
                (compiled, world),
                sample,
                &seeded,
                |p| wanted(p.how),
                &mut force,
            );
            if let Some(force) = force {
                visit(sample, &force.total());
            }
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
        seeded: &impl Deref<Target = Seeded>,
        wanted: impl Fn(&Program) -> bool,
        force: &mut Option<Sum>,
    ) {
        self.index.at(compiled, sample.world_point, &mut self.found);
        for (_, number) in &self.found {
            let program = compiled.programs.get(*number);
            let Some(program) = program.filter(|program| wanted(program)) else {
                continue;
            };
            for instance in self.index.reach(*number).at(program, sample.world_point) {
                self.frames
                    .fill_instance(compiled, world, program, *instance);
                let Seeded { query, motion } = &**seeded;
                let (instance, frames) = (*instance as usize, self.frames.all());
                let sum = force.get_or_insert_with(Sum::default);
                if let Some(drag) = drag_on(program, instance, frames, query) {
                    sum.add(&drag);
                    continue;
                }
                let machine = &mut self.machine;
                if let Some(outcome) = machine.run(program, instance, frames, query, motion) {
                    sum.varying += outcome.force;
                }
            }
        }
    }
}

/// The force of a program that is one drag, defined everywhere.
fn drag_on(
    program: &Program,
    instance: usize,
    frames: &[Option<Frame>],
    query: &Query,
) -> Option<Linearised> {
    let leaf = match (&program.steps[..], &program.leaves[..]) {
        ([Step::Leaf(0)], [leaf]) if leaf.region.is_everywhere() => leaf,
        _ => return None,
    };
    let frame = program.frame(instance, 0, frames)?;
    let acts = frame.angvel == Vector::ZERO && leaf.acts_on(query, frame);
    let local = acts.then(|| LocalQuery::new(query, frame))?;
    leaf.drag_of(program.strength(instance, 0), &local)
}
