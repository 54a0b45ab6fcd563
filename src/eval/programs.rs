//! Evaluates programs on bodies: several samples at once in lanes where possible, else one by one by the interpreter.

use super::contract::{BatchEvaluator, Summing, Sums};
use super::cut::{BodyCuts, CutBody, SampleOf};
use super::index::ProgramIndex;
use super::interpreter::Interpreter;
use super::simd::{LaneInput, LaneOutput, WIDTH};
use super::slowings::DragOn;
use crate::compile::{Compiled, Key, Keyed, Program};
use crate::field::{Cuts, Frames};
use crate::math::{DVec3, Real, Vector, from_dvec3, from_f64, to_dvec3};
use crate::number::lanes_of;
use crate::sample::{PlacedBlock, SamplePoint, Samples};
use crate::threads::each_chunk;

/// Groups of samples that one thread evaluates at a time.
const CHUNK: usize = 32;

/// Evaluates programs; keeps their index and its buffers between calls.
#[derive(Debug, Default)]
pub(super) struct Programs {
    index: ProgramIndex,
    interpreter: Interpreter,
    jobs: Vec<Job>,
    reactions: Vec<(usize, Vector, Vector)>,
    cuts: BodyCuts,
    near: Vec<u32>,
    /// The single samples at which a program is evaluated, as for [`sample_at`], and the indices of the runs.
    places: Vec<u32>,
    runs: Vec<u32>,
    /// Pairs of an instance and a sample, as for [`sample_at`], or the number of a block.
    pairs: Vec<(u32, u32)>,
    /// The results for several samples at once.
    found: Vec<LaneOutput>,
}

/// The sample of an index that counts the centres first, then the sites.
fn sample_at(samples: &Samples, place: u32) -> &SamplePoint {
    let (place, count) = (place as usize, samples.centres.len());
    let centre = samples.centres.get(place);
    centre.unwrap_or_else(|| &samples.sites[place - count])
}

/// An instance of a program that is evaluated on several samples.
struct LaneJob<'a> {
    input: LaneInput<'a>,
    /// The closed form of the instance, if it is drag or wind.
    drag: Option<DragOn>,
}

/// The force of an instance on a fraction of a part.
struct Felt<'a> {
    part: &'a SamplePoint,
    fraction: Real,
    arm: Vector,
    world_point: Vector,
    exact: DVec3,
}

impl<'a> Felt<'a> {
    fn on_sample(sample: &'a SamplePoint, exact: DVec3) -> Self {
        Felt {
            part: sample,
            fraction: sample.fraction,
            arm: sample.arm,
            world_point: sample.world_point,
            exact,
        }
    }
}

/// A program to be evaluated at one sample or run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Job {
    /// The key of the program.
    key: Key,
    number: u32,
    /// An index that counts the centres first, then the sites, then the runs; or [`ALL`].
    sample: u32,
}

/// Stands for all samples.
const ALL: u32 = u32::MAX;

impl BatchEvaluator<Program> for Programs {
    fn begin(&mut self, on: &mut Summing<'_, impl Frames>) {
        self.index.refresh(on.scene, on.frames);
    }

    fn add(&mut self, number: u32, program: &Program, on: &mut Summing<'_, impl Frames>) {
        let (samples, rule) = (on.scene.samples, program.sampling_rule);
        if matches!(rule.cuts, Cuts::Shares | Cuts::Parts) {
            for body in 0..samples.bodies.len() as u32 {
                self.cut(number, program, body, on);
            }
        }
        self.places.clear();
        for centre in samples.centres_for(rule) {
            if !self.cut(number, program, centre.body, on) {
                self.places.push(centre.body);
            }
        }
        let count = samples.centres.len();
        let sites = samples.uncut_sites_for(rule);
        self.places
            .extend(sites.map(|(number, _)| (count + number) as u32));
        self.runs.clear();
        self.runs
            .extend(samples.uncut_runs_for(rule).map(|(number, _)| number));
        self.add_listed(number, program, on);
    }
}

impl Programs {
    /// Adds the forces of all programs, each at the samples that it may reach.
    pub(super) fn add_all(&mut self, on: &mut Summing<'_, impl Frames>) {
        let compiled = on.scene.compiled;
        if !self.index.is_in_use() {
            let programs = compiled.programs.iter();
            for (number, program) in programs.filter(|(_, program)| program.has_force) {
                self.add(number, program, on);
            }
            return;
        }
        let jobs = self.find_jobs(compiled, on.scene.samples);
        for jobs in jobs.chunk_by(|a, b| a.key == b.key) {
            let number = jobs[0].number;
            let Some(program) = compiled.programs.get(number) else {
                continue;
            };
            if jobs.iter().any(|job| job.sample == ALL) {
                self.add(number, program, on)
            } else {
                self.add_on(jobs, program, on)
            }
        }
        self.jobs = jobs;
    }

    /// The samples that each program may act on, in the order of the programs.
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
        let count = samples.centres.len();
        let singles = samples.centres.iter().chain(&samples.sites);
        for (place, sample) in singles.enumerate() {
            self.index
                .bounded_at(sample.world_point, |number| add(number, place as u32));
        }
        if compiled.requirements.points || samples.apart || !samples.overrides.is_empty() {
            let first = count + samples.sites.len();
            for (number, run) in samples.clouds.runs.iter().enumerate() {
                let point = samples.centres[run.whole.body as usize].world_point;
                let add = |program| add(program, (first + number) as u32);
                self.index.bounded_near(point, samples.extent_of(run), add);
            }
        }
        // Bodies are cut by programs that reach any part of them.
        for (place, (centre, bulk)) in samples.centres.iter().zip(&samples.bulks).enumerate() {
            let cut_by = |number: u32| {
                let program = compiled.programs.get(number);
                if program.is_some_and(|program| program.sampling_rule.cuts != Cuts::Never) {
                    add(number, place as u32);
                }
            };
            let (point, extent) = (centre.world_point, from_f64(bulk.extent));
            self.index.bounded_near(point, extent, cut_by);
        }
        for number in compiled.program_log.unbounded() {
            add(*number, ALL);
        }
        jobs.sort_unstable();
        jobs.dedup();
        jobs
    }

    /// Adds the forces of a program on some samples.
    fn add_on(&mut self, jobs: &[Job], program: &Program, on: &mut Summing<'_, impl Frames>) {
        let (number, samples, rule) = (jobs[0].number, on.scene.samples, program.sampling_rule);
        let (count, sites) = (samples.centres.len(), samples.sites.len());
        self.places.clear();
        self.runs.clear();
        for place in jobs.iter().map(|job| job.sample) {
            if let Some(centre) = samples.centres.get(place as usize) {
                let is_wanted = !self.cut(number, program, centre.body, on)
                    && samples.asks_whole(rule)
                    && samples.takes(rule, centre);
                self.places.extend(is_wanted.then_some(place));
            } else if let Some(sample) = samples.sites.get(place as usize - count) {
                let is_wanted = samples.takes_uncut(rule, sample);
                self.places.extend(is_wanted.then_some(place));
            } else {
                let run = place as usize - count - sites;
                let is_wanted = samples.takes_uncut(rule, &samples.clouds.runs[run].whole);
                self.runs.extend(is_wanted.then_some(run as u32));
            }
        }
        self.add_listed(number, program, on);
    }

    /// Adds the forces of a program on the samples and runs in its lists.
    fn add_listed(&mut self, number: u32, program: &Program, on: &mut Summing<'_, impl Frames>) {
        let samples = on.scene.samples;
        let mut pairs = std::mem::take(&mut self.pairs);
        pairs.clear();
        let reach = self.index.reach(number);
        for place in &self.places {
            let point = sample_at(samples, *place).world_point;
            let instances = reach.at(program, point);
            pairs.extend(instances.iter().map(|instance| (*instance, *place)));
        }
        self.each_instance(program, &mut pairs, on, Self::add_on_samples);
        pairs.clear();
        let reach = self.index.reach(number);
        for run in &self.runs {
            let run = &samples.clouds.runs[*run as usize];
            let point = samples.centres[run.whole.body as usize].world_point;
            reach.around(program, point, samples.extent_of(run), &mut self.near);
            for instance in &self.near {
                pairs.extend(run.blocks().map(|block| (*instance, block)));
            }
        }
        self.each_instance(program, &mut pairs, on, Self::add_on_blocks);
        self.pairs = pairs;
        self.react(samples, &mut on.sums);
    }

    /// Calls `add` for each instance, with its pairs.
    fn each_instance(
        &mut self,
        program: &Program,
        pairs: &mut [(u32, u32)],
        on: &mut Summing<'_, impl Frames>,
        mut add: impl FnMut(&mut Self, &LaneJob<'_>, &[(u32, u32)], &mut Sums<'_>),
    ) {
        let (scene, samples, moment) = (on.scene, on.scene.samples, on.scene.moment);
        if program.instances.len() > 1 {
            pairs.sort_unstable();
        }
        for pairs in pairs.chunk_by(|a, b| a.0 == b.0) {
            on.frames.fill_instance(scene, program, pairs[0].0);
            let instance = pairs[0].0 as usize;
            let job = LaneJob {
                input: LaneInput {
                    program,
                    instance,
                    frames: on.frames.all(),
                    samples,
                    moment,
                },
                drag: DragOn::new(program, instance, moment),
            };
            add(self, &job, pairs, &mut on.sums);
        }
    }

    /// Adds the forces of an instance on several samples.
    fn add_on_samples(&mut self, job: &LaneJob<'_>, pairs: &[(u32, u32)], sums: &mut Sums<'_>) {
        let sample = |place: u32| sample_at(job.input.samples, place);
        let mut all_found = std::mem::take(&mut self.found);
        all_found.clear();
        all_found.resize_with(pairs.len().div_ceil(WIDTH), LaneOutput::default);
        each_chunk(&mut all_found, CHUNK, |first, found| {
            let several = pairs.chunks(WIDTH).skip(first);
            for (found, several) in found.iter_mut().zip(several) {
                let place = |lane: usize| several[lane.min(several.len() - 1)].1;
                let all: [_; WIDTH] = std::array::from_fn(|lane| sample(place(lane)));
                *found = job.input.on_samples(&all[..several.len()]);
            }
        });
        for (found, several) in all_found.iter().zip(pairs.chunks(WIDTH)) {
            for lane in lanes_of(found.defined) {
                let felt = Felt::on_sample(sample(several[lane].1), found.exact_force(lane));
                self.add_force(job, several[lane].1, &felt, sums);
            }
            for lane in lanes_of(found.doubtful) {
                self.add_one(job, several[lane].1, sums);
            }
        }
        self.found = all_found;
    }

    /// Adds the force of an instance on one sample.
    fn add_one(&mut self, job: &LaneJob<'_>, place: u32, sums: &mut Sums<'_>) {
        let sample = sample_at(job.input.samples, place);
        if let Some(force) = job.input.interpreted(sample, &mut self.interpreter) {
            let felt = Felt::on_sample(sample, force);
            self.add_force(job, place, &felt, sums);
        }
    }

    /// Adds a force on one sample.
    fn add_force(&mut self, job: &LaneJob<'_>, place: u32, felt: &Felt<'_>, sums: &mut Sums<'_>) {
        let force = from_dvec3(felt.exact);
        let count = job.input.samples.centres.len();
        match (place as usize).checked_sub(count) {
            Some(place) => sums.forces[place] += force,
            None => sums.wrenches[place as usize].force += force,
        }
        self.note(job, felt, sums);
    }

    /// Adds the forces of an instance on several blocks.
    fn add_on_blocks(&mut self, job: &LaneJob<'_>, pairs: &[(u32, u32)], sums: &mut Sums<'_>) {
        let (input, samples) = (&job.input, job.input.samples);
        let mut all_found = std::mem::take(&mut self.found);
        all_found.clear();
        all_found.resize_with(pairs.len(), LaneOutput::default);
        each_chunk(&mut all_found, CHUNK, |first, found| {
            for (found, pair) in found.iter_mut().zip(&pairs[first..]) {
                *found = input.on_block(pair.1);
            }
        });
        for (found, (_, block)) in all_found.iter().zip(pairs) {
            let placed = samples.block(*block);
            for lane in lanes_of(found.defined) {
                self.add_in_block(job, &placed, lane, found.exact_force(lane), sums);
            }
            for lane in lanes_of(found.doubtful) {
                let force = input.interpreted(&placed.sample(lane), &mut self.interpreter);
                if let Some(force) = force {
                    self.add_in_block(job, &placed, lane, force, sums);
                }
            }
        }
        self.found = all_found;
    }

    /// Adds a force on one sample of a block.
    fn add_in_block(
        &mut self,
        job: &LaneJob<'_>,
        placed: &PlacedBlock<'_>,
        lane: usize,
        exact: DVec3,
        sums: &mut Sums<'_>,
    ) {
        let felt = Felt {
            part: &placed.run.whole,
            fraction: placed.fractions[lane],
            arm: placed.arm(lane),
            world_point: placed.world_point(lane),
            exact,
        };
        let force = from_dvec3(exact);
        let wrench = &mut sums.wrenches[felt.part.body as usize];
        wrench.force += force;
        wrench.torque += felt.arm.cross(force);
        self.note(job, &felt, sums);
    }

    /// Records the derivative and the reaction of a force.
    fn note(&mut self, job: &LaneJob<'_>, felt: &Felt<'_>, sums: &mut Sums<'_>) {
        let LaneInput {
            program,
            instance,
            frames,
            samples,
            ..
        } = job.input;
        if let (Some(slowings), Some(drag)) = (&mut sums.slowings, &job.drag) {
            let slowing = drag.of_part(felt.part, felt.fraction, felt.exact);
            slowings.add(felt.part.body, to_dvec3(felt.arm), felt.exact, &slowing);
        }
        if program.reacts {
            let frame = program.frame(instance, 0, frames);
            let carrier = frame.and_then(|frame| frame.body);
            let body = carrier.and_then(|carrier| samples.of_body(carrier));
            let force = from_dvec3(felt.exact);
            self.reactions
                .extend(body.map(|body| (body, force, felt.world_point)));
        }
    }

    /// Adds the wrench of a program on a body that it cuts. Returns false if it does not cut the body.
    fn cut(
        &mut self,
        number: u32,
        program: &Program,
        body: u32,
        on: &mut Summing<'_, impl Frames>,
    ) -> bool {
        let scene = on.scene;
        let Some(bulk) = scene.samples.cut(program.sampling_rule, body) else {
            return false;
        };
        // Rounded up, so that no instance that barely reaches the body is missed.
        let extent = from_f64(bulk.extent) * (1.0 + Real::EPSILON * 4.0);
        let point = scene.samples.centres[body as usize].world_point;
        let reach = self.index.reach(number);
        reach.around(program, point, extent, &mut self.near);
        if self.near.is_empty() {
            return true;
        }
        for instance in &self.near {
            on.frames.fill_instance(scene, program, *instance);
        }
        let interpreter = &mut self.interpreter;
        let mut whole = Vector::ZERO;
        let (mut sum, mut turn) = (DVec3::ZERO, DVec3::ZERO);
        let near = self.near.iter().map(|instance| *instance as usize);
        let frames = on.frames.all();
        let cut = CutBody {
            samples: scene.samples,
            moment: scene.moment,
            number: body,
        };
        self.cuts
            .each(program, frames, near, cut, |instance, sample| {
                let mut force = |query| interpreter.force(program, instance, frames, query);
                match sample {
                    SampleOf::Whole(query) => {
                        let one = force(query).map(from_dvec3);
                        whole += one.unwrap_or(Vector::ZERO);
                    }
                    SampleOf::Piece(query, weight, arm) => {
                        let one = force(query).map_or(DVec3::ZERO, |force| force * weight);
                        sum += one;
                        turn += arm.cross(one);
                    }
                }
            });
        let wrench = &mut on.sums.wrenches[body as usize];
        wrench.force += whole + from_dvec3(sum);
        wrench.torque += from_dvec3(turn);
        true
    }

    /// Adds the opposite forces to the bodies that carry the fields.
    fn react(&mut self, samples: &Samples, sums: &mut Sums<'_>) {
        for (place, force, world_point) in self.reactions.drain(..) {
            let arm = world_point - samples.centres[place].world_point;
            sums.wrenches[place].force -= force;
            sums.wrenches[place].torque -= arm.cross(force);
        }
    }
}
