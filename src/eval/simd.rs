//! Programs on eight samples at a time: the walk of the [interpreter](super::interpreter) over [`Lanes`]. The bits
//! for each sample are those of the interpreter at that sample alone.
//!
//! A sample on the surface of a region, or with a number that is not finite, is *in doubt*, and left to the
//! interpreter.

use std::array::from_fn;

use super::interpreter::{Interpreter, SampleContext};
use crate::compile::Program;
use crate::field::{Frame, Motion, Numbers, Open, Queries};
use crate::math::{DVec3, Real, to_dvec3, to_f64};
use crate::number::{LANES, LaneMask, Lanes, Number, Plain, Vec3, in_registers};
use crate::sample::{BLOCK, Moment, PlacedBlock, SamplePoint, Samples};

/// The number of samples that are evaluated together.
pub(super) const WIDTH: usize = LANES;

/// An instance of a program, and the moment at which it is evaluated.
pub(super) struct LaneInput<'a> {
    pub program: &'a Program,
    pub instance: usize,
    pub frames: &'a [Option<Frame>],
    pub samples: &'a Samples,
    pub moment: Moment,
}

/// The forces of an instance on up to eight samples, with a bit for each sample on which it is defined, and for
/// each that is in doubt.
#[derive(Debug, Default)]
pub(super) struct LaneOutput {
    forces: [[f64; WIDTH]; 3],
    pub defined: u64,
    pub doubtful: u64,
}

impl LaneOutput {
    /// The force, in `f64`, on a sample on which the instance is defined.
    pub(super) fn exact_force(&self, lane: usize) -> DVec3 {
        let [x, y, z] = &self.forces;
        DVec3::new(x[lane], y[lane], z[lane])
    }
}

/// The force of a program in lanes.
pub(super) struct LaneForce {
    pub force: Vec3<Lanes>,
    /// Where it is defined for certain.
    pub defined: LaneMask,
    /// Where the interpreter decides: on a border, or where numbers are not finite.
    pub doubtful: LaneMask,
}

impl SampleContext<'_, Lanes> {
    /// Runs the program in the widest registers of the machine. Not inlined, so that this large function is compiled
    /// once for all callers.
    #[inline(never)]
    pub(super) fn in_lanes(&self) -> LaneForce {
        in_registers(
            #[inline(always)]
            || {
                let here = Open::new();
                let value = self.walk(&here);
                let Vec3 { x, y, z } = value.vector;
                let finite = is_finite(x) & is_finite(y) & is_finite(z);
                let doubtful = here.on_a_surface() | (value.defined & !finite);
                LaneForce {
                    force: value.vector,
                    defined: value.defined & !doubtful,
                    doubtful,
                }
            },
        )
    }
}

impl LaneInput<'_> {
    /// Runs the instance on one to eight samples.
    pub(super) fn on_samples(&self, samples: &[&SamplePoint]) -> LaneOutput {
        let last = samples.len().min(WIDTH) - 1;
        // Lanes without a sample repeat the last one.
        let all: [&SamplePoint; WIDTH] = from_fn(|lane| samples[lane.min(last)]);
        let point = |axis| of_each(&all, |sample| to_dvec3(sample.world_point)[axis]);
        let velocity = |axis| of_each(&all, |sample| to_dvec3(sample.velocity)[axis]);
        let motion = Motion {
            point: Vec3::new(point(0), point(1), point(2)),
            velocity: Vec3::new(velocity(0), velocity(1), velocity(2)),
        };
        self.run(&self.queries(&all), &motion, last + 1)
    }

    /// Runs the instance on a block of samples.
    pub(super) fn on_block(&self, block: u32) -> LaneOutput {
        let placed = self.samples.block(block);
        let vector = |[x, y, z]: &[[Real; BLOCK]; 3]| Vec3::new(lanes(x), lanes(y), lanes(z));
        let motion = Motion {
            point: vector(&placed.world_points),
            velocity: vector(&placed.velocities),
        };
        self.run(&self.block_queries(&placed), &motion, placed.count)
    }

    /// The force on a sample that is in doubt.
    pub(super) fn interpreted(
        &self,
        sample: &SamplePoint,
        interpreter: &mut Interpreter,
    ) -> Option<DVec3> {
        let query = self.samples.query(sample, self.moment);
        interpreter.force(self.program, self.instance, self.frames, &query)
    }

    /// A program that has no form in lanes leaves all samples in doubt.
    fn run(&self, queries: &Queries, motion: &Motion<Lanes>, count: usize) -> LaneOutput {
        let all = (1 << count) - 1;
        if !self.program.in_lanes {
            return LaneOutput {
                doubtful: all,
                ..LaneOutput::default()
            };
        }
        let (program, frames) = (self.program, self.frames);
        let place = SampleContext::new(program, self.instance, frames, queries, motion);
        let felt = place.in_lanes();
        let Vec3 { x, y, z } = felt.force;
        LaneOutput {
            forces: [x.0, y.0, z.0],
            defined: felt.defined.bits() & all,
            doubtful: felt.doubtful.bits() & all,
        }
    }

    fn block_queries(&self, placed: &PlacedBlock<'_>) -> Queries {
        let part = &placed.run.whole;
        let of_part = |number: Real| Lanes::from(to_f64(number));
        Queries {
            numbers: Numbers {
                time: self.moment.time,
                dt: to_f64(self.moment.dt),
                radius: of_part(part.radius),
                mass: of_part(part.mass),
                share: of_part(part.share),
                charge: of_part(part.charge),
                fraction: lanes(placed.fractions),
            },
            span: self.moment.span,
            bodies: [self.samples.bodies[part.body as usize]; WIDTH],
            groups: [part.groups; WIDTH],
        }
    }

    fn queries(&self, samples: &[&SamplePoint; WIDTH]) -> Queries {
        Queries {
            numbers: Numbers {
                time: self.moment.time,
                dt: to_f64(self.moment.dt),
                radius: of_each(samples, |sample| to_f64(sample.radius)),
                mass: of_each(samples, |sample| to_f64(sample.mass)),
                share: of_each(samples, |sample| to_f64(sample.share)),
                charge: of_each(samples, |sample| to_f64(sample.charge)),
                fraction: of_each(samples, |sample| to_f64(sample.fraction)),
            },
            span: self.moment.span,
            bodies: samples.map(|sample| self.samples.bodies[sample.body as usize]),
            groups: samples.map(|sample| sample.groups),
        }
    }
}

#[inline(always)]
fn lanes(numbers: &[Real; BLOCK]) -> Lanes {
    Lanes::from_fn(|lane| to_f64(numbers[lane]))
}

/// A number of each sample.
#[inline(always)]
fn of_each(samples: &[&SamplePoint; WIDTH], number: impl Fn(&SamplePoint) -> f64) -> Lanes {
    Lanes::from_fn(|lane| number(samples[lane]))
}

#[inline(always)]
fn is_finite(numbers: Lanes) -> <Lanes as Number>::Mask {
    numbers.abs().below(f64::INFINITY)
}

#[cfg(test)]
pub(super) mod tests;
