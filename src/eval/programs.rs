//! Programs by the interpreter, at one sample after the other.

use super::contract::{BatchEvaluator, Scene, Sums};
use super::cut::{Asked, BodyCuts};
use super::frames::FrameCache;
use super::index::ProgramIndex;
use super::instances::Reach;
use super::interpreter::Interpreter;
use crate::compile::{Compiled, Key, Program};
use crate::field::{Cuts, Frames, Motion, Sampling, SamplingRule, real};
use crate::math::{DVec3, Real, Vector, from_dvec3, from_f64};
use crate::sample::{Kind, SamplePoint, Samples};

/// Evaluates programs; keeps where they reach between calls.
#[derive(Debug, Default)]
pub(super) struct Programs {
    index: ProgramIndex,
    machine: Interpreter,
    jobs: Vec<Job>,
    reactions: Vec<(usize, Vector, Vector)>,
    cuts: BodyCuts,
    near: Vec<u32>,
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

impl BatchEvaluator<Program> for Programs {
    fn begin(&mut self, scene: &Scene<'_, impl Frames>, frames: &mut FrameCache) {
        self.index.refresh(scene.compiled, frames, scene.world);
    }

    fn add(
        &mut self,
        batch: (u32, &Program),
        scene: &Scene<'_, impl Frames>,
        frames: &mut FrameCache,
        sums: &mut Sums<'_>,
    ) {
        self.add_where(batch, scene, frames, sums, |_| true);
    }
}

impl Programs {
    /// Adds what all programs give, each on the samples that it may reach.
    pub(super) fn add_all(
        &mut self,
        scene: &Scene<'_, impl Frames>,
        frames: &mut FrameCache,
        sums: &mut Sums<'_>,
    ) {
        if !self.index.is_in_use() {
            let programs = scene.compiled.programs.iter();
            for batch in programs.filter(|(_, program)| program.has_force) {
                self.add(batch, scene, frames, sums);
            }
            return;
        }
        let jobs = self.find_jobs(scene.compiled, scene.samples);
        for jobs in jobs.chunk_by(|a, b| a.key == b.key) {
            let number = jobs[0].number;
            let Some(program) = scene.compiled.programs.get(number) else {
                continue;
            };
            match jobs.iter().any(|job| job.sample == ALL) {
                true => self.add((number, program), scene, frames, sums),
                false => self.add_on((number, program), scene, frames, (sums, jobs)),
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
        let all = samples.centres.iter().chain(samples.placed());
        for (place, sample) in all.enumerate() {
            self.index
                .bounded_at(sample.world_point, |number| add(number, place as u32));
        }
        // Bodies are cut by what reaches any of them.
        for (place, (centre, bulk)) in samples.centres.iter().zip(&samples.bulks).enumerate() {
            let cut_by = |number: u32| {
                let program = compiled.programs.get(number);
                if program.is_some_and(|program| program.how.cuts != Cuts::Never) {
                    add(number, place as u32);
                }
            };
            let near = (centre.world_point, from_f64(bulk.extent));
            self.index.bounded_near(near, cut_by);
        }
        for number in compiled.roster.unbounded() {
            add(*number, ALL);
        }
        jobs.sort_unstable();
        jobs.dedup();
        jobs
    }

    /// Where the instances of a program reach, and what runs them.
    pub(super) fn tools(&mut self, number: u32) -> (&Reach, &mut Interpreter) {
        (self.index.reach(number), &mut self.machine)
    }

    /// Adds what a program gives on the samples of some bodies, given by their numbers.
    pub(super) fn add_where(
        &mut self,
        (number, program): (u32, &Program),
        scene: &Scene<'_, impl Frames>,
        frames: &mut FrameCache,
        sums: &mut Sums<'_>,
        wanted: impl Fn(u32) -> bool,
    ) {
        let (samples, how) = (scene.samples, program.how);
        if how.cuts == Cuts::Parts {
            for body in 0..samples.bodies.len() as u32 {
                self.cut((number, program), scene, frames, (sums, body));
            }
        }
        for centre in samples.centres_for(how) {
            if self.cut((number, program), scene, frames, (sums, centre.body)) {
                continue;
            }
            let force = self.force_at((number, program), scene, frames, centre);
            sums.wrenches[centre.body as usize].force += force;
        }
        for (place, sample) in samples.samples_for(how) {
            if wanted(sample.body) && samples.cut(how, sample.body).is_none() {
                sums.forces[place] += self.force_at((number, program), scene, frames, sample);
            }
        }
        self.react(samples, sums);
    }

    /// Adds what a program gives on some samples.
    fn add_on(
        &mut self,
        (number, program): (u32, &Program),
        scene: &Scene<'_, impl Frames>,
        frames: &mut FrameCache,
        (sums, jobs): (&mut Sums<'_>, &[Job]),
    ) {
        let (samples, how) = (scene.samples, program.how);
        let count = samples.centres.len();
        for place in jobs.iter().map(|job| job.sample as usize) {
            if let Some(centre) = samples.centres.get(place) {
                if self.cut((number, program), scene, frames, (sums, centre.body)) {
                    continue;
                }
                if how.sampling == Sampling::Centre && samples.takes(how, centre) {
                    let force = self.force_at((number, program), scene, frames, centre);
                    sums.wrenches[centre.body as usize].force += force;
                }
            } else if takes(samples, how, &samples.list[place - count]) {
                let sample = &samples.list[place - count];
                let force = self.force_at((number, program), scene, frames, sample);
                sums.forces[place - count] += force;
            }
        }
        self.react(samples, sums);
    }

    /// Adds what a program gives on a body that it cuts; whether it does.
    fn cut(
        &mut self,
        (number, program): (u32, &Program),
        scene: &Scene<'_, impl Frames>,
        frames: &mut FrameCache,
        (sums, body): (&mut Sums<'_>, u32),
    ) -> bool {
        let Some(bulk) = scene.samples.cut(program.how, body) else {
            return false;
        };
        // Rounded up, not to lose what only just reaches.
        let extent = from_f64(bulk.extent) * (1.0 + Real::EPSILON * 4.0);
        let point = scene.samples.centres[body as usize].world_point;
        let reach = self.index.reach(number);
        reach.around(program, (point, extent), &mut self.near);
        if self.near.is_empty() {
            return true;
        }
        for instance in &self.near {
            frames.fill_instance(scene.compiled, scene.world, program, *instance);
        }
        let machine = &mut self.machine;
        let mut whole = Vector::ZERO;
        let (mut sum, mut turn) = (DVec3::ZERO, DVec3::ZERO);
        let near = self.near.iter().map(|instance| *instance as usize);
        let (frames, samples) = (frames.all(), (scene.samples, scene.moment));
        self.cuts
            .each((program, frames), near, samples, body, |instance, asked| {
                let mut force = |query| {
                    let motion = Motion::of(query);
                    let outcome = machine.run(program, instance, frames, query, &motion);
                    outcome.map(|outcome| real(&outcome.force))
                };
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
        let wrench = &mut sums.wrenches[body as usize];
        wrench.force += whole + from_dvec3(sum);
        wrench.torque += from_dvec3(turn);
        true
    }

    /// The force of a program on one sample; takes note of reactions.
    fn force_at(
        &mut self,
        (number, program): (u32, &Program),
        scene: &Scene<'_, impl Frames>,
        frames: &mut FrameCache,
        sample: &SamplePoint,
    ) -> Vector {
        let instances = self.index.reach(number).at(program, sample.world_point);
        if instances.is_empty() {
            return Vector::ZERO;
        }
        let query = scene.samples.query(sample, scene.moment);
        let motion = Motion::of(&query);
        let mut force = Vector::ZERO;
        for instance in instances {
            frames.fill_instance(scene.compiled, scene.world, program, *instance);
            let (instance, frames) = (*instance as usize, frames.all());
            let outcome = self.machine.run(program, instance, frames, &query, &motion);
            let Some(outcome) = outcome else { continue };
            let one = from_dvec3(real(&outcome.force));
            force += one;
            if program.reacts {
                let carrier = program.frame(instance, 0, frames).and_then(|f| f.body);
                let place = carrier.and_then(|carrier| scene.samples.of_body(carrier));
                let reaction = place.map(|place| (place, one, sample.world_point));
                self.reactions.extend(reaction);
            }
        }
        force
    }

    /// Adds the opposite forces on the bodies that carry the fields.
    fn react(&mut self, samples: &Samples, sums: &mut Sums<'_>) {
        for (place, force, world_point) in self.reactions.drain(..) {
            let arm = world_point - samples.centres[place].world_point;
            sums.wrenches[place].force -= force;
            sums.wrenches[place].torque -= arm.cross(force);
        }
    }
}

/// Whether a program that is sampled like this takes a sample of the list.
fn takes(samples: &Samples, how: SamplingRule, sample: &SamplePoint) -> bool {
    let at_centre = how.sampling == Sampling::Centre;
    let in_list = !(at_centre && samples.overrides.is_empty());
    in_list
        && samples.cut(how, sample.body).is_none()
        && samples.takes(how, sample)
        && !(at_centre && sample.kind == Kind::Centre)
}
