//! Evaluates compiled fields on samples: wrenches on bodies, potential energies, and derivatives.

mod at_centres;
mod clouds;
mod constants;
mod contract;
mod cut;
mod energy;
mod far;
mod frames;
mod index;
mod instances;
mod interpreter;
mod kernel;
mod lanes;
mod linearise;
mod one_way;
mod pairwise;
mod programs;
mod quantity;
mod radial;
mod sampled_world;
mod simd;
mod slowings;
mod sources;
#[cfg(test)]
mod tests;

use crate::compile::{RadialBatch, Weighting};
use crate::field::Frames;
use crate::math::{Vector, to_f64};
use crate::rigid::Wrench;

pub(crate) use at_centres::{
    CentreBlock, CentreEvaluator, CentreForce, TOGETHER, in_lane, widened,
};
pub(crate) use interpreter::Interpreter;
pub(crate) use linearise::Lineariser;
pub use quantity::PotentialEnergy;
pub(crate) use quantity::Terms;
pub(crate) use sampled_world::SampledWorld;
pub(crate) use slowings::{BodySlowing, BodySlowings};

use constants::Constants;
use contract::{BatchEvaluator, Summing, Sums};
use energy::program_energy;
use frames::FrameCache;
use programs::Programs;
use quantity::Quantity;
use radial::Radials;

/// Evaluates a compiled set; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(crate) struct Evaluator {
    radials: Radials,
    programs: Programs,
    frames: FrameCache,
    forces: Vec<Vector>,
}

impl Evaluator {
    /// The wrench on each body of `samples`. Drag and wind in closed form, with their derivatives by velocity,
    /// are also added to `slowings`, if given.
    pub(crate) fn wrenches(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        wrenches: &mut Vec<Wrench>,
        slowings: Option<&mut BodySlowings>,
    ) {
        let (compiled, samples) = (scene.compiled, scene.samples);
        wrenches.clear();
        wrenches.resize(samples.bodies.len(), Wrench::ZERO);
        self.start(scene);
        let on = &mut Summing {
            scene,
            frames: &mut self.frames,
            sums: Sums {
                forces: &mut self.forces,
                wrenches,
                slowings,
            },
        };
        Constants.add(0, &compiled.constants, on);
        self.radials.add(0, &compiled.radials, on);
        self.programs.begin(on);
        self.programs.add_all(on);
        for (sample, force) in samples.sites.iter().zip(&self.forces) {
            let wrench = &mut wrenches[sample.body as usize];
            wrench.force += *force;
            wrench.torque += sample.arm.cross(*force);
        }
    }

    fn start(&mut self, scene: &SampledWorld<'_, impl Frames>) {
        self.frames.clear(scene.compiled);
        self.forces.clear();
        self.forces.resize(scene.samples.sites.len(), Vector::ZERO);
    }

    /// The potential energy of all bodies of `samples`.
    pub(crate) fn potential_energy(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
    ) -> PotentialEnergy {
        let (compiled, samples, moment) = (scene.compiled, scene.samples, scene.moment);
        self.start(scene);
        let mut energy = PotentialEnergy::default();
        for constant in &compiled.constants {
            let weighting = Weighting::shared(constant.mode);
            for centre in &samples.centres {
                let weight = samples.weight(centre, &weighting, moment);
                energy.total -= to_f64(constant.vector.dot(centre.world_point) * weight);
            }
        }
        let mut of_bodies = vec![Wrench::ZERO; samples.bodies.len()];
        let on = &mut Summing {
            scene,
            frames: &mut self.frames,
            sums: Sums {
                forces: &mut self.forces,
                wrenches: &mut of_bodies,
                slowings: None,
            },
        };
        let radials = &compiled.radials;
        self.radials.add_quantity(radials, on, Quantity::Potential);
        let lacks =
            |batch: &RadialBatch| batch.prototype.is_on(moment.span) && !batch.law.has_potential();
        energy.without += radials.iter().filter(|(_, batch)| lacks(batch)).count();
        let of_bodies = of_bodies.iter().map(|sum| &sum.force);
        let sums = self.forces.iter().chain(of_bodies);
        energy.total += sums.map(|sum| to_f64(sum.x)).sum::<f64>();
        let programs = compiled.programs.iter().map(|(_, program)| program);
        for program in programs.filter(|program| program.has_force) {
            self.frames.fill(scene, program);
            let (known, all) = program_energy(program, self.frames.all(), samples, moment);
            energy.total += known;
            energy.without += usize::from(!all);
        }
        energy
    }
}
