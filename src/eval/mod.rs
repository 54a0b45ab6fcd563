//! Evaluate: batches × samples → forces.

mod adaptive;
mod frames;
mod index;
mod instances;
mod interpreter;
mod kernel;
mod lanes;
mod linearise;
mod pairwise;
mod quantity;
mod radial;

use crate::compile::{Compiled, Key, Program, RadialBatch};
use crate::field::{Frame, Frames, LocalQuery, Motion, Sampling, SamplingRule, real};
use crate::math::{Vector, from_dvec3, to_f64};
use crate::rigid::Wrench;
use crate::sample::{Kind, Moment, SamplePoint, Samples};

pub(crate) use interpreter::Interpreter;
pub(crate) use linearise::Lineariser;
pub use quantity::{PotentialEnergy, WrenchError};

use adaptive::{Bordered, Refiner};
use frames::FrameCache;
use index::ProgramIndex;
use quantity::Quantity;
use radial::Radials;

/// Evaluates a compiled tree; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(crate) struct Evaluator {
    radials: Radials,
    index: ProgramIndex,
    machine: Interpreter,
    jobs: Vec<Job>,
    reactions: Vec<(usize, Vector, Vector)>,
    frames: FrameCache,
    forces: Vec<Vector>,
    refiner: Refiner,
}

impl Evaluator {
    /// The wrench on each body of `samples`.
    pub(crate) fn wrenches(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        samples: &Samples,
        moment: Moment,
        wrenches: &mut Vec<Wrench>,
    ) {
        self.frames.clear(compiled);
        wrenches.clear();
        wrenches.resize(samples.bodies.len(), Wrench::ZERO);
        self.refiner.forget(samples);
        self.constants(compiled, samples, moment, wrenches);
        self.radials(compiled, world, samples, moment, Quantity::Force);
        self.programs(compiled, world, samples, moment, wrenches);
        for (sample, force) in samples.list.iter().zip(&self.forces) {
            let wrench = &mut wrenches[sample.body as usize];
            wrench.force += *force;
            wrench.torque += sample.arm.cross(*force);
        }
    }

    /// Sums all radial batches into `self.forces`.
    fn radials(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        samples: &Samples,
        moment: Moment,
        quantity: Quantity,
    ) {
        self.forces.clear();
        self.forces.resize(samples.list.len(), Vector::ZERO);
        for (number, batch) in compiled.radials.iter() {
            let unknown = quantity == Quantity::Potential && !batch.law.has_potential();
            if unknown || !batch.prototype.is_on(moment.time) {
                continue;
            }
            let (frames, forces) = (&mut self.frames, &mut self.forces);
            let frame = |anchor| frames.get(compiled, world, anchor);
            self.radials.add(
                (number as usize, batch),
                frame,
                samples,
                moment,
                quantity,
                forces,
            );
        }
    }

    fn constants(
        &self,
        compiled: &Compiled,
        samples: &Samples,
        moment: Moment,
        wrenches: &mut [Wrench],
    ) {
        use crate::field::{Coupling, ForceMode};
        for mode in [
            ForceMode::Force,
            ForceMode::Acceleration,
            ForceMode::VelocityChange,
        ] {
            let fields = compiled.constants.iter().filter(|c| c.mode == mode);
            let vector: Vector = fields.map(|constant| constant.vector).sum();
            if vector == Vector::ZERO {
                continue;
            }
            let weighting = crate::compile::Weighting {
                mode,
                coupling: Coupling::Share,
                groups: None,
            };
            for (centre, wrench) in samples.centres.iter().zip(&mut *wrenches) {
                wrench.force += vector * samples.weight(centre, &weighting, moment);
            }
        }
    }

    /// Adds what all programs give.
    fn programs(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        samples: &Samples,
        moment: Moment,
        wrenches: &mut [Wrench],
    ) {
        self.index.refresh(compiled, &mut self.frames, world);
        let scene = Scene {
            compiled,
            world,
            samples,
            moment,
        };
        // Cells are sampled all over a body, not at its samples.
        if !self.index.is_in_use() || !samples.solids.is_empty() {
            for (number, program) in compiled.programs.iter().filter(|(_, p)| p.has_force) {
                self.program(number, program, &scene, None, wrenches);
            }
            return;
        }
        let jobs = self.find_jobs(compiled, samples);
        for jobs in jobs.chunk_by(|a, b| a.key == b.key) {
            let number = jobs[0].number;
            if let Some(program) = compiled.programs.get(number) {
                let these = jobs.iter().all(|job| job.sample != ALL).then_some(jobs);
                self.program(number, program, &scene, these, wrenches);
            }
        }
        self.jobs = jobs;
    }

    /// Which programs may act on which samples, program by program in their order.
    fn find_jobs(&mut self, compiled: &Compiled, samples: &Samples) -> Vec<Job> {
        let mut jobs = std::mem::take(&mut self.jobs);
        jobs.clear();
        let mut add = |number: u32, sample: u32| {
            let key = compiled.programs.get(number).map(Program::key);
            jobs.extend(key.map(|key| Job {
                key,
                number,
                sample,
            }));
        };
        let all = samples.centres.iter().chain(&samples.list);
        for (place, sample) in all.enumerate() {
            self.index
                .bounded_at(sample.world_point, |number| add(number, place as u32));
        }
        for number in compiled.roster.unbounded() {
            add(*number, ALL);
        }
        jobs.sort_unstable();
        jobs
    }

    /// Adds what a program gives on all samples, or on some.
    fn program(
        &mut self,
        number: u32,
        program: &Program,
        scene: &Scene<'_, impl Frames>,
        these: Option<&[Job]>,
        wrenches: &mut [Wrench],
    ) {
        let Scene {
            compiled,
            world,
            samples,
            moment,
        } = *scene;
        if !samples.solids.is_empty() {
            self.frames.fill(compiled, world, program);
            let field = Bordered {
                program,
                frames: self.frames.all(),
                samples,
                moment,
            };
            let reach = self.index.reach(number);
            self.refiner.run(&field, reach, &mut self.machine, wrenches);
        }
        let (frames, machine) = (&mut self.frames, &mut self.machine);
        let reach = self.index.reach(number);
        let reactions = &mut self.reactions;
        reactions.clear();
        let mut force_at = |sample: &SamplePoint| {
            let instances = reach.at(program, sample.world_point);
            if instances.is_empty() {
                return Vector::ZERO;
            }
            let query = samples.query(sample, moment);
            let motion = Motion::of(&query);
            let mut force = Vector::ZERO;
            for instance in instances {
                frames.fill_instance(compiled, world, program, *instance);
                let (instance, frames) = (*instance as usize, frames.all());
                let outcome = machine.run(program, instance, frames, &query, &motion);
                let Some(outcome) = outcome else { continue };
                let one = from_dvec3(real(&outcome.force));
                force += one;
                if program.reacts {
                    let carrier = program.frame(instance, 0, frames).and_then(|f| f.body);
                    let place = carrier.and_then(|carrier| samples.of_body(carrier));
                    reactions.extend(place.map(|place| (place, one, sample.world_point)));
                }
            }
            force
        };
        let how = program.how;
        let count = samples.centres.len();
        if let Some(these) = these {
            for place in these.iter().map(|job| job.sample as usize) {
                if let Some(centre) = samples.centres.get(place) {
                    if how.sampling == Sampling::Centre && samples.takes(how, centre) {
                        wrenches[centre.body as usize].force += force_at(centre);
                    }
                } else if takes(samples, how, &samples.list[place - count]) {
                    self.forces[place - count] += force_at(&samples.list[place - count]);
                }
            }
        } else {
            for centre in samples.centres_for(how) {
                wrenches[centre.body as usize].force += force_at(centre);
            }
            for (index, sample) in samples.samples_for(how) {
                if !self.refiner.has_done(sample.body) {
                    self.forces[index] += force_at(sample);
                }
            }
        }
        for (place, force, world_point) in self.reactions.drain(..) {
            let arm = world_point - samples.centres[place].world_point;
            wrenches[place].force -= force;
            wrenches[place].torque -= arm.cross(force);
        }
    }

    /// The bound of the error of the last wrench on a body, by its number.
    pub(crate) fn error(&self, body: usize) -> Option<WrenchError> {
        self.refiner.error(body)
    }

    /// The potential energy of all bodies of `samples`.
    pub(crate) fn potential_energy(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        samples: &Samples,
        moment: Moment,
    ) -> PotentialEnergy {
        self.frames.clear(compiled);
        let mut energy = PotentialEnergy::default();
        for constant in &compiled.constants {
            for centre in &samples.centres {
                let mass = if constant.mode == crate::field::ForceMode::Force {
                    1.0
                } else {
                    centre.mass
                };
                energy.total -= to_f64(constant.vector.dot(centre.world_point) * mass);
            }
        }
        self.radials(compiled, world, samples, moment, Quantity::Potential);
        let on = |batch: &RadialBatch| batch.prototype.is_on(moment.time);
        let batches = compiled.radials.iter().map(|(_, batch)| batch);
        let without = batches.filter(|batch| !batch.law.has_potential() && on(batch));
        energy.without = without.count();
        energy.total += self.forces.iter().map(|sum| to_f64(sum.x)).sum::<f64>();
        let programs = compiled.programs.iter().map(|(_, program)| program);
        for program in programs.filter(|program| program.has_force) {
            self.frames.fill(compiled, world, program);
            match program_energy(program, self.frames.all(), samples, moment) {
                Some(potential) => energy.total += potential,
                None => energy.without += 1,
            }
        }
        energy
    }
}

/// One program on one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Job {
    /// Of the program.
    key: Key,
    number: u32,
    /// Its place among the centres and then the list of samples, or [`ALL`].
    sample: u32,
}

/// In place of a sample.
const ALL: u32 = u32::MAX;

/// What programs are evaluated on.
struct Scene<'a, F> {
    compiled: &'a Compiled,
    world: &'a F,
    samples: &'a Samples,
    moment: Moment,
}

/// Whether a program that is sampled like this takes a sample of the list.
fn takes(samples: &Samples, how: SamplingRule, sample: &SamplePoint) -> bool {
    let at_centre = how.sampling == Sampling::Centre;
    let in_list = !(at_centre && samples.overrides.is_empty());
    in_list && samples.takes(how, sample) && !(at_centre && sample.kind == Kind::Centre)
}

/// The potential of a program of one field, if that has one.
fn program_energy(
    program: &Program,
    frames: &[Option<Frame>],
    samples: &Samples,
    moment: Moment,
) -> Option<f64> {
    let [field] = &program.leaves[..] else {
        return None;
    };
    let mut total = 0.0;
    let list = samples.samples_for(program.how).map(|(_, sample)| sample);
    for sample in samples.centres_for(program.how).chain(list) {
        let query = samples.query(sample, moment);
        let anchors = program.instances.anchors.iter().enumerate();
        for (instance, anchor) in anchors {
            let Some(frame) = frames[*anchor as usize].as_ref() else {
                continue;
            };
            if !field.acts_on(&query, frame) {
                continue;
            }
            let local = LocalQuery::new(&query, frame);
            let here = crate::field::Neighbourhood::open();
            if field.region.pieces(&local, &here).any() {
                let share = field.energy_share(frame.body.is_some());
                let strength = program.strength(instance, 0);
                total += field.potential_of(strength, &local)? * share;
            }
        }
    }
    Some(total)
}
