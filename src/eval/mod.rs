//! Evaluate: batches × probes → forces.

mod adaptive;
mod cells;
mod frames;
mod grid;
mod hierarchy;
mod kernel;
mod lanes;
mod linearise;
mod mutual;
mod pairs;
mod probe;
mod program;
mod radial;

use crate::compile::{Compiled, Program};
use crate::field::{Frame, Frames, LocalQuery, Motion, real};
use crate::math::{Real, Vector, from_dvec3, to_f64};

pub(crate) use adaptive::Solid;
pub(crate) use cells::{Cells, Content};
pub(crate) use hierarchy::hierarchy;
pub(crate) use linearise::Lineariser;
pub(crate) use pairs::{Clump, PairList};
pub(crate) use probe::{Kind, Moment, Probe, Probes, UserValues, owner};
pub(crate) use program::Machine;

use adaptive::{Bordered, Refiner};
use frames::FrameCache;
use program::Reach;
use radial::Radials;

/// A force and the torque about the centre of mass that comes with it, world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Force.
    pub force: Vector,
    /// Torque about the centre of mass.
    pub torque: Vector,
}

impl Wrench {
    /// No force and no torque.
    pub const ZERO: Wrench = Wrench {
        force: Vector::ZERO,
        torque: Vector::ZERO,
    };

    /// Whether all components are finite.
    pub fn is_finite(&self) -> bool {
        self.force.is_finite() && self.torque.is_finite()
    }
}

/// A bound of how far a [`Wrench`] may be off; see [`Fields::wrench_error`](crate::Fields).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    machine: Machine,

    frames: FrameCache,
    forces: Vec<Vector>,
    refiner: Refiner,
}

impl Evaluator {
    /// The wrench on each body of `probes`.
    pub(crate) fn wrenches(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        probes: &Probes,
        moment: Moment,
        wrenches: &mut Vec<Wrench>,
    ) {
        self.frames.clear(compiled);
        wrenches.clear();
        wrenches.resize(probes.bodies.len(), Wrench::ZERO);
        self.refiner.forget(probes);
        self.constants(compiled, probes, moment, wrenches);
        self.radials(compiled, world, probes, moment, Quantity::Force);
        self.reaches
            .resize_with(compiled.programs.len(), Reach::default);
        for (number, program) in compiled.programs.iter().enumerate() {
            if program.has_force {
                self.frames.fill(compiled, world, program);
                self.program(number, program, probes, moment, wrenches);
            }
        }
        for (probe, force) in probes.list.iter().zip(&self.forces) {
            let wrench = &mut wrenches[probe.body as usize];
            wrench.force += *force;
            wrench.torque += probe.arm.cross(*force);
        }
    }

    /// Sums all radial batches into `self.forces`.
    fn radials(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        probes: &Probes,
        moment: Moment,
        quantity: Quantity,
    ) {
        self.forces.clear();
        self.forces.resize(probes.list.len(), Vector::ZERO);
        for (number, batch) in compiled.radials.iter().enumerate() {
            if quantity == Quantity::Potential && !batch.law.has_potential() {
                continue;
            }
            let (frames, forces) = (&mut self.frames, &mut self.forces);
            let frame = |anchor| frames.get(compiled, world, anchor);
            self.radials
                .add((number, batch), frame, probes, moment, quantity, forces);
        }
    }

    fn constants(
        &self,
        compiled: &Compiled,
        probes: &Probes,
        moment: Moment,
        wrenches: &mut [Wrench],
    ) {
        use crate::field::{Coupling, Reading};
        for reading in [
            Reading::Force,
            Reading::Acceleration,
            Reading::VelocityChange,
        ] {
            let fields = compiled.constants.iter().filter(|c| c.reading == reading);
            let vector: Vector = fields.map(|constant| constant.vector).sum();
            if vector == Vector::ZERO {
                continue;
            }
            let weighting = crate::compile::Weighting {
                reading,
                coupling: Coupling::Share,
                groups: None,
            };
            for (centre, wrench) in probes.centres.iter().zip(&mut *wrenches) {
                wrench.force += vector * probes.weight(centre, &weighting, moment);
            }
        }
    }

    fn program(
        &mut self,
        number: usize,
        program: &Program,
        probes: &Probes,
        moment: Moment,
        wrenches: &mut [Wrench],
    ) {
        let frames = self.frames.all();
        let reach = &mut self.reaches[number];
        reach.refresh(program, frames);
        let field = Bordered {
            program,
            frames,
            probes,
            moment,
        };
        self.refiner.run(&field, reach, &mut self.machine, wrenches);
        let machine = &mut self.machine;
        let mut reactions = Vec::new();
        let mut force_at = |probe: &Probe| {
            let instances = reach.at(probe.world_point);
            if instances.is_empty() {
                return Vector::ZERO;
            }
            let query = probes.query(probe, moment);
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
                    let place = carrier.and_then(|carrier| probes.of_body(carrier));
                    reactions.extend(place.map(|place| (place, one, probe.world_point)));
                }
            }
            force
        };
        for centre in probes.centres_for(program.how) {
            wrenches[centre.body as usize].force += force_at(centre);
        }
        for (index, probe) in probes.samples_for(program.how) {
            if !self.refiner.has_done(probe.body) {
                self.forces[index] += force_at(probe);
            }
        }
        for (place, force, world_point) in reactions {
            let arm = world_point - probes.centres[place].world_point;
            wrenches[place].force -= force;
            wrenches[place].torque -= arm.cross(force);
        }
    }

    /// The bound of the error of the last wrench on a body, by its number.
    pub(crate) fn error(&self, body: usize) -> Option<WrenchError> {
        self.refiner.error(body)
    }

    /// The potential energy of all bodies of `probes`.
    pub(crate) fn potential_energy(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        probes: &Probes,
        moment: Moment,
    ) -> PotentialEnergy {
        self.frames.clear(compiled);
        let mut energy = PotentialEnergy::default();
        for constant in &compiled.constants {
            for centre in &probes.centres {
                let mass = if constant.reading == crate::field::Reading::Force {
                    1.0
                } else {
                    centre.mass
                };
                energy.total -= to_f64(constant.vector.dot(centre.world_point) * mass);
            }
        }
        self.radials(compiled, world, probes, moment, Quantity::Potential);
        let without = compiled.radials.iter();
        energy.without = without.filter(|batch| !batch.law.has_potential()).count();
        energy.total += self.forces.iter().map(|sum| to_f64(sum.x)).sum::<f64>();
        for program in compiled.programs.iter().filter(|program| program.has_force) {
            self.frames.fill(compiled, world, program);
            match program_energy(program, self.frames.all(), probes, moment) {
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
    probes: &Probes,
    moment: Moment,
) -> Option<f64> {
    let [field] = &program.leaves[..] else {
        return None;
    };
    let mut total = 0.0;
    let samples = probes.samples_for(program.how).map(|(_, probe)| probe);
    for probe in probes.centres_for(program.how).chain(samples) {
        let query = probes.query(probe, moment);
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
