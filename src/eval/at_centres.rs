//! Evaluates fields that pull at centres of mass, on eight bodies at a time and without a list of samples.

use fearless_simd::{Simd, dispatch};

use super::constants::ConstantPull;
use super::frames::FrameCache;
use super::interpreter::Interpreter;
use super::lanes::{lanes_of, level};
use super::sampled_world::SampledWorld;
use super::slowings::DragOn;
use super::wide::{LaneInput, LaneOutput, WIDTH};
use crate::compile::{Compiled, RadialBatch};
use crate::field::{Frames, Lanes, Number, Plain, Vec3};
use crate::math::{DVec3, Real, RigidBodyHandle, Vector, to_dvec3, to_f64};
use crate::rigid::Slowing;
use crate::sample::{Moment, SamplePoint, Samples, owner};

/// The number of bodies that are evaluated together.
pub(crate) const TOGETHER: usize = WIDTH;

/// The force of all fields on a body, in world axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CentreForce {
    pub force: DVec3,
    /// The derivative by velocity of drag and wind, which are part of the force.
    pub slowing: Slowing,
}

/// Evaluates a set that acts [at centres of mass](Compiled::at_centres). Keeps its buffers between calls.
#[derive(Debug)]
pub(crate) struct CentreEvaluator {
    frames: FrameCache,
    machine: Interpreter,
    moment: Moment,
    constants: ConstantPull,
    /// The handles of the bodies to be evaluated; it has no other content.
    these: Samples,
    /// The sample of each of them, at its centre of mass. Entries after the last body are left from earlier
    /// calls.
    samples: [SamplePoint; WIDTH],
}

impl Default for CentreEvaluator {
    fn default() -> Self {
        let moment = Moment::NEVER;
        CentreEvaluator {
            frames: FrameCache::default(),
            machine: Interpreter::default(),
            moment,
            constants: ConstantPull::of(&[], moment.dt),
            these: Samples::made_elsewhere(),
            samples: std::array::from_fn(|lane| SamplePoint::at_rest(lane as u32, owner(None))),
        }
    }
}

/// The forces on up to eight bodies.
pub(crate) struct CentreForces {
    forces: Vec3<Lanes>,
    slowings: [Slowing; WIDTH],
}

impl CentreForces {
    /// The force on one of the bodies.
    #[inline]
    pub(crate) fn on(&self, lane: usize) -> CentreForce {
        let Vec3 { x, y, z } = &self.forces;
        CentreForce {
            force: DVec3::new(x.0[lane], y.0[lane], z.0[lane]),
            slowing: self.slowings[lane],
        }
    }
}

impl CentreEvaluator {
    /// Looks up the frames of all fields, and starts without bodies.
    pub(crate) fn begin(&mut self, compiled: &Compiled, world: &impl Frames, moment: Moment) {
        self.moment = moment;
        self.constants = ConstantPull::of(&compiled.constants, moment.dt);
        self.these.bodies.clear();
        self.frames.clear(compiled);
        let scene = SampledWorld::new(compiled, world, &self.these, moment);
        for source in compiled.radials.iter().flat_map(|it| &it.1.sources) {
            self.frames.get(&scene, source.anchor);
        }
        for (_, program) in compiled.programs.iter() {
            self.frames.fill(&scene, program);
        }
    }

    /// Adds a body to those to be evaluated, of which there are at most [`TOGETHER`], with its centre of mass.
    #[inline]
    pub(crate) fn ask(
        &mut self,
        body: RigidBodyHandle,
        world_com: Vector,
        linvel: Vector,
        mass: Real,
    ) {
        let sample = &mut self.samples[self.these.bodies.len()];
        (sample.world_point, sample.velocity) = (world_com, linvel);
        (sample.mass, sample.owner) = (mass, owner(Some(body)));
        self.these.bodies.push(body);
    }

    /// Removes all bodies.
    pub(crate) fn clear(&mut self) {
        self.these.bodies.clear();
    }

    /// The forces on these bodies, with the fields at the places they had at [`begin`](Self::begin).
    pub(crate) fn forces(&mut self, compiled: &Compiled) -> CentreForces {
        let count = self.these.bodies.len();
        // Lanes without a body repeat the last one.
        for lane in count..WIDTH {
            let number = self.samples[lane].body;
            self.samples[lane] = self.samples[count - 1];
            self.samples[lane].body = number;
        }
        let mut felt = self.sources(compiled);
        for (_, program) in compiled.programs.iter().filter(|it| it.1.has_force) {
            for instance in 0..program.instances.len() {
                let asked = LaneInput {
                    program,
                    instance,
                    frames: self.frames.all(),
                    samples: &self.these,
                    moment: self.moment,
                };
                let found = asked.in_lanes(&self.samples, count);
                let drag = DragOn::new(program, instance, self.moment);
                for lane in lanes_of(found.defined | found.doubtful) {
                    let doubted = found.doubtful >> lane & 1 == 1;
                    let force = if doubted {
                        asked.interpreted(&self.samples[lane], &mut self.machine)
                    } else {
                        Some(found.exact_force(lane))
                    };
                    let Some(force) = force else {
                        continue;
                    };
                    felt.add(lane, force);
                    if let Some(drag) = &drag {
                        let sample = &self.samples[lane];
                        let slowing = drag.slowing(sample, sample.fraction, force);
                        felt.slowings[lane].add(&slowing);
                    }
                }
            }
        }
        felt
    }

    /// The forces of constants and radial fields.
    fn sources(&self, compiled: &Compiled) -> CentreForces {
        let pulls = self.samples.each_ref().map(|it| self.constants.on(it));
        let pull = |axis| Lanes::from_fn(|lane| to_f64(pulls[lane][axis]));
        let mut forces = Vec3::new(pull(0), pull(1), pull(2));
        let is_on = |batch: &RadialBatch| batch.prototype.is_on(self.moment.span);
        for (_, batch) in compiled.radials.iter().filter(|it| is_on(it.1)) {
            let sum = dispatch!(level(), simd => simd.vectorize(
                #[inline(always)]
                || self.pulls(batch),
            ));
            let weight = |sample| self.these.weight(sample, &batch.weighting, self.moment);
            let weights = self.samples.each_ref().map(weight);
            forces += sum * Lanes::from_fn(|lane| to_f64(weights[lane]));
        }
        CentreForces {
            forces,
            slowings: [Slowing::default(); WIDTH],
        }
    }

    /// The sum of the forces of a batch on bodies with a weight of one.
    #[inline(always)]
    fn pulls(&self, batch: &RadialBatch) -> Vec3<Lanes> {
        let place = |axis| Lanes::from_fn(|lane| to_f64(self.samples[lane].world_point[axis]));
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
        sum
    }
}

impl CentreForces {
    fn add(&mut self, lane: usize, force: DVec3) {
        let Vec3 { x, y, z } = &mut self.forces;
        x.0[lane] += force.x;
        y.0[lane] += force.y;
        z.0[lane] += force.z;
    }
}

impl LaneInput<'_> {
    fn in_lanes(&self, samples: &[SamplePoint; WIDTH], count: usize) -> LaneOutput {
        let samples = samples.each_ref();
        dispatch!(level(), simd => self.on_samples(simd, &samples[..count]))
    }
}
