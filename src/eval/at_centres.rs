//! Fields on bodies that they pull at their centres of mass, eight bodies at a time: no list of samples is
//! made for these.

use fearless_simd::{Simd, dispatch};

use super::constants::Pull;
use super::drags::DragOn;
use super::frames::FrameCache;
use super::interpreter::Interpreter;
use super::lanes::{lanes_of, level};
use super::wide::{Asked, Found, WIDTH};
use crate::compile::{Compiled, RadialBatch};
use crate::field::{Frames, Lanes, Motion, Number, Plain, Vec3, real};
use crate::math::{DVec3, RigidBodyHandle, to_dvec3, to_f64};
use crate::rigid::Slowing;
use crate::sample::{Moment, SamplePoint, Samples};

/// A body that is asked about.
#[derive(Clone, Copy)]
pub(crate) struct Centre {
    pub body: RigidBodyHandle,
    /// At its centre of mass; the number of its body is its place among those that are asked about.
    pub sample: SamplePoint,
}

/// So many bodies are evaluated at once.
pub(crate) const AT_ONCE: usize = WIDTH;

/// The force of all fields on a body.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CentreForce {
    pub force: DVec3,
    /// How drag and wind, which are part of it, change with the velocity.
    pub slowing: Slowing,
}

/// Evaluates a set that acts [at centres of mass](Compiled::at_centres); keeps its buffers between calls.
#[derive(Debug)]
pub(crate) struct CentreEvaluator {
    frames: FrameCache,
    machine: Interpreter,
    /// The bodies that are asked about, and nothing else.
    these: Samples,
}

impl Default for CentreEvaluator {
    fn default() -> Self {
        CentreEvaluator {
            frames: FrameCache::default(),
            machine: Interpreter::default(),
            these: Samples::made_elsewhere(),
        }
    }
}

impl CentreEvaluator {
    /// Looks up where all fields are.
    pub(crate) fn begin(&mut self, compiled: &Compiled, world: &impl Frames) {
        self.frames.clear(compiled);
        for source in compiled.radials.iter().flat_map(|it| &it.1.sources) {
            self.frames.get(compiled, world, source.anchor);
        }
        for (_, program) in compiled.programs.iter() {
            self.frames.fill(compiled, world, program);
        }
    }

    /// The forces on one to eight bodies, where the fields [are](Self::begin).
    pub(crate) fn forces(
        &mut self,
        compiled: &Compiled,
        moment: Moment,
        centres: &[Centre],
    ) -> [CentreForce; AT_ONCE] {
        self.these.bodies.clear();
        self.these
            .bodies
            .extend(centres.iter().map(|centre| centre.body));
        let mut forces = [CentreForce::default(); AT_ONCE];
        let constants = Pull::of(&compiled.constants, moment.dt);
        for (centre, sum) in centres.iter().zip(&mut forces) {
            sum.force = to_dvec3(constants.on(&centre.sample));
        }
        let last = centres.len() - 1;
        let samples: [_; AT_ONCE] = std::array::from_fn(|lane| &centres[lane.min(last)].sample);
        let is_on = |batch: &RadialBatch| batch.prototype.is_on(moment.span);
        for (_, batch) in compiled.radials.iter().filter(|it| is_on(it.1)) {
            let pulls = dispatch!(level(), simd => simd.vectorize(
                #[inline(always)]
                || self.pulls(batch, &samples),
            ));
            for ((sample, pull), sum) in samples.iter().zip(pulls).zip(&mut forces) {
                sum.force += pull * to_f64(self.these.weight(sample, &batch.weighting, moment));
            }
        }
        for (_, program) in compiled.programs.iter().filter(|it| it.1.has_force) {
            for instance in 0..program.instances.len() {
                let part = DragOn {
                    program,
                    instance,
                    moment,
                };
                let mut add = |lane: usize, force| {
                    let sum: &mut CentreForce = &mut forces[lane];
                    let slowing = part.slowing(samples[lane], force);
                    sum.force += force;
                    sum.slowing.add(&slowing.unwrap_or_default());
                };
                let found = self.in_lanes(&part, &samples[..centres.len()]);
                for lane in lanes_of(found.defined) {
                    add(lane, found.exact_force(lane));
                }
                for lane in lanes_of(found.doubtful) {
                    if let Some(force) = self.interpret(&part, &centres[lane]) {
                        add(lane, force);
                    }
                }
            }
        }
        forces
    }

    /// What the sources of a batch do to bodies of a weight of one.
    #[inline(always)]
    fn pulls(&self, batch: &RadialBatch, samples: &[&SamplePoint; AT_ONCE]) -> [DVec3; AT_ONCE] {
        let place = |axis| Lanes::from_fn(|lane| to_f64(samples[lane].world_point[axis]));
        let point = Vec3::new(place(0), place(1), place(2));
        let range2 = batch.range.map_or(f64::INFINITY, |it| to_f64(it).powi(2));
        let mut sum = Vec3::<Lanes>::zero();
        for source in &batch.sources {
            let Some(frame) = &self.frames.all()[source.anchor as usize] else {
                continue;
            };
            let way = point - to_dvec3(frame.pose.translation);
            let r2 = way.dot(way);
            let factor = batch.law.factor(r2) * to_f64(source.strength);
            sum += way * Lanes::select(r2.above(range2), 0.0.into(), factor);
        }
        let Vec3 { x, y, z } = sum;
        std::array::from_fn(|lane| DVec3::new(x.0[lane], y.0[lane], z.0[lane]))
    }

    fn in_lanes(&self, part: &DragOn<'_>, samples: &[&SamplePoint]) -> Found {
        let asked = Asked {
            program: part.program,
            instance: part.instance,
            frames: self.frames.all(),
            samples: &self.these,
            moment: part.moment,
        };
        dispatch!(level(), simd => asked.on(simd, samples))
    }

    /// The force of an instance on a body that lies at a border, or where numbers are out of range.
    fn interpret(&mut self, part: &DragOn<'_>, centre: &Centre) -> Option<DVec3> {
        let query = self.these.query(&centre.sample, part.moment);
        let (frames, motion) = (self.frames.all(), Motion::of(&query));
        let machine = &mut self.machine;
        let outcome = machine.run(part.program, part.instance, frames, &query, &motion)?;
        Some(real(outcome.force))
    }
}
