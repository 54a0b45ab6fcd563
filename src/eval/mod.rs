//! Evaluate: batches × samples → forces.

mod adaptive;
mod frames;
mod interpreter;
mod kernel;
mod lanes;
mod linearise;
mod pairwise;
mod radial;

use crate::compile::{Compiled, Program};
use crate::field::{Frame, Frames, LocalQuery, Motion, real};
use crate::math::{Real, Vector, from_dvec3, to_f64};
use crate::rigid::Wrench;
use crate::sample::{Moment, SamplePoint, Samples};

pub(crate) use interpreter::Interpreter;
pub(crate) use linearise::Lineariser;

use adaptive::{Bordered, Refiner};
use frames::FrameCache;
use interpreter::Reach;
use radial::Radials;

/// A bound of how far a [`Wrench`] may be off; see [`Fields::wrench_error`](crate::Fields).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub struct WrenchError {
    /// Length of the force that is missing or too much.
    pub force: Real,
    /// Length of the torque that is missing or too much.
    pub torque: Real,
}

/// The potential energy of bodies in fields.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PotentialEnergy {
    /// The sum over all fields that have a potential. A field anchored to a body counts half,
    /// because the field of the body it acts on acts back; so it is exact where fields of bodies
    /// come in such pairs.
    pub total: f64,
    /// Terms without a potential: drag, closures, and operators other than the sum of union.
    pub without: usize,
}

/// What is summed over sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    Force,
    /// The potential, in x; half of it where the source belongs to a body, because the body it
    /// acts on has a field that acts back.
    Potential,
}

/// Evaluates a compiled tree; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(crate) struct Evaluator {
    radials: Radials,
    /// One per program, because each keeps its hierarchy while nothing moves.
    reaches: Vec<Reach>,
    machine: Interpreter,

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
        self.reaches
            .resize_with(compiled.programs.len(), Reach::default);
        for (number, program) in compiled.programs.iter().enumerate() {
            if program.has_force {
                self.frames.fill(compiled, world, program);
                self.program(number, program, samples, moment, wrenches);
            }
        }
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
        for (number, batch) in compiled.radials.iter().enumerate() {
            if quantity == Quantity::Potential && !batch.law.has_potential() {
                continue;
            }
            let (frames, forces) = (&mut self.frames, &mut self.forces);
            let frame = |anchor| frames.get(compiled, world, anchor);
            self.radials
                .add((number, batch), frame, samples, moment, quantity, forces);
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

    fn program(
        &mut self,
        number: usize,
        program: &Program,
        samples: &Samples,
        moment: Moment,
        wrenches: &mut [Wrench],
    ) {
        let frames = self.frames.all();
        let reach = &mut self.reaches[number];
        reach.refresh(program, frames);
        let field = Bordered {
            program,
            frames,
            samples,
            moment,
        };
        self.refiner.run(&field, reach, &mut self.machine, wrenches);
        let machine = &mut self.machine;
        let mut reactions = Vec::new();
        let mut force_at = |sample: &SamplePoint| {
            let instances = reach.at(sample.world_point);
            if instances.is_empty() {
                return Vector::ZERO;
            }
            let query = samples.query(sample, moment);
            let motion = Motion::of(&query);
            let mut force = Vector::ZERO;
            for instance in instances {
                let instance = *instance as usize;
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
        for centre in samples.centres_for(program.how) {
            wrenches[centre.body as usize].force += force_at(centre);
        }
        for (index, sample) in samples.samples_for(program.how) {
            if !self.refiner.has_done(sample.body) {
                self.forces[index] += force_at(sample);
            }
        }
        for (place, force, world_point) in reactions {
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
        let without = compiled.radials.iter();
        energy.without = without.filter(|batch| !batch.law.has_potential()).count();
        energy.total += self.forces.iter().map(|sum| to_f64(sum.x)).sum::<f64>();
        for program in compiled.programs.iter().filter(|program| program.has_force) {
            self.frames.fill(compiled, world, program);
            match program_energy(program, self.frames.all(), samples, moment) {
                Some(potential) => energy.total += potential,
                None => energy.without += 1,
            }
        }
        energy
    }
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
        for frame in program
            .anchors
            .iter()
            .filter_map(|anchor| frames[*anchor as usize].as_ref())
        {
            if !field.acts_on(&query, frame) {
                continue;
            }
            let local = LocalQuery::new(&query, frame);
            let here = crate::field::Neighbourhood::open();
            if field.region.pieces(&local, &here).any() {
                let share = field.energy_share(frame.body.is_some());
                total += field.potential(&local)? * share;
            }
        }
    }
    Some(total)
}
