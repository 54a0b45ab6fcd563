//! Evaluates programs on bodies: several samples at once where they can, else one by one with the interpreter.

use fearless_simd::dispatch;

use super::contract::{BatchEvaluator, Summing, Sums};
use super::cut::{Asked, BodyCuts, CutBody};
use super::index::ProgramIndex;
use super::interpreter::Interpreter;
use super::lanes::{lanes_of, level};
use super::slowings::DragOn;
use super::wide::{LaneInput, LaneOutput, WIDTH};
use crate::compile::{Compiled, Key, Keyed, Program};
use crate::field::{Cuts, Frames};
use crate::math::{DVec3, Real, Vector, from_dvec3, from_f64, to_dvec3};
use crate::sample::{SamplePoint, Samples};
use crate::threads::each_chunk;

/// Groups of samples that one thread evaluates at a time.
const CHUNK: usize = 32;

/// Evaluates programs; keeps their index and its buffers between calls.
#[derive(Debug, Default)]
pub(super) struct Programs {
    index: ProgramIndex,
    machine: Interpreter,
    jobs: Vec<Job>,
    reactions: Vec<(usize, Vector, Vector)>,
    cuts: BodyCuts,
    near: Vec<u32>,
    /// The places of the samples at which a program is evaluated.
    asked: Vec<u32>,
    /// Pairs of an instance and the place of a sample.
    pairs: Vec<(u32, u32)>,
    /// The results for several samples at once.
    found: Vec<LaneOutput>,
}

/// The sample at a place among the centres and then the list.
fn sample_at(samples: &Samples, place: u32) -> &SamplePoint {
    let (place, count) = (place as usize, samples.centres.len());
    let centre = samples.centres.get(place);
    centre.unwrap_or_else(|| &samples.list[place - count])
}

/// An instance of a program that is evaluated on several samples.
struct Asking<'a> {
    wide: LaneInput<'a>,
    /// Its closed form, if it is drag or wind.
    drag: Option<DragOn>,
}

/// A program to be evaluated at one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Job {
    /// The key of the program.
    key: Key,
    number: u32,
    /// The place of the sample among the centres and then the list, or [`ALL`].
    sample: u32,
}

/// Stands for all samples.
const ALL: u32 = u32::MAX;

impl BatchEvaluator<Program> for Programs {
    fn begin(&mut self, on: &mut Summing<'_, impl Frames>) {
        self.index.refresh(on.scene, on.frames);
    }

    fn add(&mut self, number: u32, program: &Program, on: &mut Summing<'_, impl Frames>) {
        let (samples, how) = (on.scene.samples, program.how);
        if matches!(how.cuts, Cuts::Shares | Cuts::Parts) {
            for body in 0..samples.bodies.len() as u32 {
                self.cut(number, program, body, on);
            }
        }
        self.asked.clear();
        for centre in samples.centres_for(how) {
            if !self.cut(number, program, centre.body, on) {
                self.asked.push(centre.body);
            }
        }
        let count = samples.centres.len();
        let asked = samples
            .samples_for(how)
            .filter(|(_, sample)| samples.cut(how, sample.body).is_none());
        self.asked
            .extend(asked.map(|(place, _)| (count + place) as u32));
        self.add_asked(number, program, on);
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
        let all = samples.centres.iter().chain(samples.placed());
        for (place, sample) in all.enumerate() {
            self.index
                .bounded_at(sample.world_point, |number| add(number, place as u32));
        }
        // Bodies are cut by programs that reach any part of them.
        for (place, (centre, bulk)) in samples.centres.iter().zip(&samples.bulks).enumerate() {
            let cut_by = |number: u32| {
                let program = compiled.programs.get(number);
                if program.is_some_and(|program| program.how.cuts != Cuts::Never) {
                    add(number, place as u32);
                }
            };
            let (point, extent) = (centre.world_point, from_f64(bulk.extent));
            self.index.bounded_near(point, extent, cut_by);
        }
        for number in compiled.roster.unbounded() {
            add(*number, ALL);
        }
        jobs.sort_unstable();
        jobs.dedup();
        jobs
    }

    /// Adds the forces of a program on some samples.
    fn add_on(&mut self, jobs: &[Job], program: &Program, on: &mut Summing<'_, impl Frames>) {
        let (number, samples, how) = (jobs[0].number, on.scene.samples, program.how);
        let count = samples.centres.len();
        self.asked.clear();
        for place in jobs.iter().map(|job| job.sample) {
            let is_asked = match samples.centres.get(place as usize) {
                Some(centre) => {
                    !self.cut(number, program, centre.body, on)
                        && samples.asks_whole(how)
                        && samples.takes(how, centre)
                }
                None => {
                    let sample = &samples.list[place as usize - count];
                    samples.takes_of_list(how, sample) && samples.cut(how, sample.body).is_none()
                }
            };
            if is_asked {
                self.asked.push(place);
            }
        }
        self.add_asked(number, program, on);
    }

    /// Adds the forces of a program on the samples in `asked`.
    fn add_asked(&mut self, number: u32, program: &Program, on: &mut Summing<'_, impl Frames>) {
        let (scene, samples) = (on.scene, on.scene.samples);
        let reach = self.index.reach(number);
        self.pairs.clear();
        for place in &self.asked {
            let point = sample_at(samples, *place).world_point;
            let instances = reach.at(program, point);
            let pairs = instances.iter().map(|instance| (*instance, *place));
            self.pairs.extend(pairs);
        }
        if program.instances.len() > 1 {
            self.pairs.sort_unstable();
        }
        let pairs = std::mem::take(&mut self.pairs);
        for run in pairs.chunk_by(|a, b| a.0 == b.0) {
            on.frames.fill_instance(scene, program, run[0].0);
            let (instance, moment) = (run[0].0 as usize, scene.moment);
            let asked = Asking {
                wide: LaneInput {
                    program,
                    instance,
                    frames: on.frames.all(),
                    samples,
                    moment,
                },
                drag: DragOn::new(program, instance, moment),
            };
            let sums = &mut on.sums;
            if program.in_lanes {
                self.add_in_lanes(&asked, run, sums)
            } else {
                run.iter()
                    .for_each(|(_, place)| self.add_one(&asked, *place, sums))
            }
        }
        self.pairs = pairs;
        self.react(samples, &mut on.sums);
    }

    /// Adds the forces of an instance on several samples.
    fn add_in_lanes(&mut self, asked: &Asking<'_>, run: &[(u32, u32)], sums: &mut Sums<'_>) {
        let mut all_found = std::mem::take(&mut self.found);
        all_found.clear();
        all_found.resize_with(run.len().div_ceil(WIDTH), LaneOutput::default);
        each_chunk(&mut all_found, CHUNK, |first, found| {
            let runs = run.chunks(WIDTH).skip(first);
            dispatch!(level(), simd => for (found, run) in found.iter_mut().zip(runs) {
                let wide = &asked.wide;
                let sample = |lane: usize| sample_at(wide.samples, run[lane.min(run.len() - 1)].1);
                let several: [_; WIDTH] = std::array::from_fn(sample);
                *found = wide.on(simd, &several[..run.len()]);
            });
        });
        for (found, run) in all_found.iter().zip(run.chunks(WIDTH)) {
            for lane in lanes_of(found.defined) {
                self.add_force(asked, run[lane].1, found.exact_force(lane), sums);
            }
            for lane in lanes_of(found.doubtful) {
                self.add_one(asked, run[lane].1, sums);
            }
        }
        self.found = all_found;
    }

    /// Adds the force of an instance on one sample.
    fn add_one(&mut self, asked: &Asking<'_>, place: u32, sums: &mut Sums<'_>) {
        let sample = sample_at(asked.wide.samples, place);
        if let Some(force) = asked.wide.interpreted(sample, &mut self.machine) {
            self.add_force(asked, place, force, sums);
        }
    }

    /// Adds a force on one sample, and notes its reaction.
    fn add_force(&mut self, asked: &Asking<'_>, place: u32, exact: DVec3, sums: &mut Sums<'_>) {
        let LaneInput {
            program,
            instance,
            frames,
            samples,
            ..
        } = asked.wide;
        let count = samples.centres.len();
        if let (Some(slowings), Some(drag)) = (&mut sums.slowings, &asked.drag) {
            let sample = sample_at(samples, place);
            let slowing = drag.slowing(sample, exact);
            slowings.add(sample.body, to_dvec3(sample.arm), exact, &slowing);
        }
        let force = from_dvec3(exact);
        match (place as usize).checked_sub(count) {
            Some(place) => sums.forces[place] += force,
            None => sums.wrenches[place as usize].force += force,
        }
        if program.reacts {
            let frame = program.frame(instance, 0, frames);
            let carrier = frame.and_then(|frame| frame.body);
            let body = carrier.and_then(|carrier| samples.of_body(carrier));
            let point = sample_at(samples, place).world_point;
            self.reactions.extend(body.map(|body| (body, force, point)));
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
        let Some(bulk) = scene.samples.cut(program.how, body) else {
            return false;
        };
        // Rounded up, so that instances are not lost that only just reach the body.
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
        let machine = &mut self.machine;
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
            .each(program, frames, near, cut, |instance, asked| {
                let mut force = |query| machine.force(program, instance, frames, query);
                match asked {
                    Asked::Whole(query) => {
                        let one = force(query).map(from_dvec3);
                        whole += one.unwrap_or(Vector::ZERO);
                    }
                    Asked::Piece(query, weight, arm) => {
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
