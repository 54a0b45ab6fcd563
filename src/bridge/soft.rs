//! Soft bodies: each of their particles is a sample, and takes impulses.

use super::sleep::WakePolicy;
use crate::compile::Compiled;
use crate::eval::Evaluator;
use crate::integrate::{Fault, Scheme};
use crate::math::{Real, Vector};
use crate::rapier::dynamics::{SoftBody, SoftBodyHandle, SoftBodySet};
use crate::rigid::Wrench;
use crate::sample::{Kind, Moment, Properties, SamplePoint, Samples, owner};

/// What fields do to the particles of soft bodies.
#[derive(Default)]
pub(crate) struct SoftBodies {
    evaluator: Evaluator,
    samples: Samples,
    forces: Vec<Wrench>,
    /// Which soft bodies the samples are of, with the number of their first.
    bodies: Vec<(SoftBodyHandle, usize)>,
    /// Positions and velocities before the step.
    before: Vec<(SoftBodyHandle, Vec<(Vector, Vector)>)>,
}

impl SoftBodies {
    /// Works out the forces on all particles; writes nothing.
    pub(crate) fn evaluate(
        &mut self,
        compiled: &Compiled,
        properties: &Properties,
        (softs, frames): (&SoftBodySet, &impl crate::field::Frames),
        moment: Moment,
        policy: WakePolicy,
    ) -> Result<(), Fault> {
        let samples = &mut self.samples;
        samples.clear();
        properties.of_world(samples);
        self.bodies.clear();
        for (handle, soft) in softs.iter() {
            let sleeps = soft.is_sleeping() && policy != WakePolicy::Always;
            if soft.is_enabled() && !sleeps {
                self.bodies.push((handle, samples.list.len()));
                gather(soft, samples);
            }
        }
        samples.sites = samples.list.len();
        samples.number();
        let forces = &mut self.forces;
        self.evaluator
            .wrenches(compiled, frames, samples, moment, forces);
        let bad = forces.iter().position(|force| !force.is_finite());
        let fault =
            |particle| Fault::non_finite(compiled, frames, (&self.samples, particle), moment);
        bad.map_or(Ok(()), |particle| Err(fault(particle)))
    }

    /// Gives the particles what was worked out before Rapier's step; returns how many took it.
    pub(crate) fn first_half(
        &mut self,
        (scheme, policy): (Scheme, WakePolicy),
        dt: Real,
        softs: &mut SoftBodySet,
    ) -> usize {
        self.before.clear();
        for (handle, soft) in softs.iter() {
            let states = soft.particle_positions().zip(soft.particle_velocities());
            self.before.push((handle, states.collect()));
        }
        let whole = matches!(scheme, Scheme::Kick | Scheme::ExternalForce);
        self.push(if whole { dt } else { dt * 0.5 }, policy, softs)
    }

    /// The second half of the kick; returns how many particles took it.
    pub(crate) fn second_half(
        &self,
        (scheme, policy): (Scheme, WakePolicy),
        dt: Real,
        softs: &mut SoftBodySet,
    ) -> usize {
        match scheme {
            Scheme::Kick | Scheme::ExternalForce => 0,
            _ => self.push(dt * 0.5, policy, softs),
        }
    }

    fn push(&self, duration: Real, policy: WakePolicy, softs: &mut SoftBodySet) -> usize {
        let wake = policy == WakePolicy::Always;
        let mut pushed = 0;
        for (handle, first) in &self.bodies {
            let Some(soft) = softs.get_mut(*handle) else {
                continue;
            };
            let forces = self.forces[*first..].iter();
            for (particle, wrench) in (0..soft.num_particles()).zip(forces) {
                if wrench.force != Vector::ZERO {
                    soft.apply_particle_impulse(particle, wrench.force * duration, wake);
                    pushed += 1;
                }
            }
        }
        pushed
    }

    /// Puts the particles back where they were before the step.
    pub(crate) fn restore(&self, softs: &mut SoftBodySet) {
        for (handle, states) in &self.before {
            let Some(soft) = softs.get_mut(*handle) else {
                continue;
            };
            for (particle, (position, velocity)) in
                (0..soft.num_particles()).zip(states.iter().copied())
            {
                soft.set_particle_position(particle, position);
                soft.set_particle_velocity(particle, velocity);
            }
        }
    }
}

/// One sample per particle, each a body of its own to the evaluator.
fn gather(soft: &SoftBody, samples: &mut Samples) {
    let root = soft.root_body();
    let total = soft.mass();
    for (number, particle) in soft.particles().iter().enumerate() {
        let mut sample = SamplePoint::at_rest(samples.bodies.len() as u32, owner(Some(root)));
        sample.world_point = soft.particle_position(number);
        sample.velocity = soft.particle_velocity(number);
        sample.radius = soft.particle_radius();
        sample.mass = particle.mass();
        sample.share = if total > 0.0 {
            particle.mass() / total
        } else {
            0.0
        };
        samples.centres.push(sample);
        samples.list.push(SamplePoint {
            kind: Kind::Site,
            ..sample
        });
        samples.bodies.push(root);
    }
}
