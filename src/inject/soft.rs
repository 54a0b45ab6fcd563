//! Soft bodies: each of their particles is a sample, and takes impulses.

use super::error::StepError;
use super::{Injector, Scheme, WakePolicy, blame};
use crate::compile::Prepared;
use crate::eval::Evaluator;
use crate::math::{ColliderSet, InteractionGroups, Real, RigidBodySet, Vector, to_f64};
use crate::rapier::dynamics::{SoftBody, SoftBodyHandle, SoftBodySet};
use crate::rigid::Wrench;
use crate::sample::{Kind, SamplePoint, Samples, owner};

/// What fields do to the particles of soft bodies.
#[derive(Default)]
pub(super) struct Softs {
    evaluator: Evaluator,
    samples: Samples,
    forces: Vec<Wrench>,
    /// Which soft bodies the samples are of, with the number of their first.
    bodies: Vec<(SoftBodyHandle, usize)>,
    /// Positions and velocities before the step.
    before: Vec<(SoftBodyHandle, Vec<(Vector, Vector)>)>,
}

impl Injector {
    /// Works out the forces on all particles, `elapsed` into the step; writes nothing.
    pub(crate) fn feel_soft(
        &mut self,
        compiled: Prepared<'_>,
        (dt, elapsed): (Real, Real),
        softs: &SoftBodySet,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<(), StepError> {
        if !(dt >= 0.0 && dt.is_finite()) {
            return Err(StepError::TimeStep { dt });
        }
        let mut moment = self.moment(dt);
        moment.time += to_f64(elapsed);
        let world = (bodies, colliders);
        let mut samples = std::mem::take(&mut self.softs.samples);
        samples.clear();
        self.book.of_world(&mut samples);
        self.softs.bodies.clear();
        for (handle, soft) in softs.iter() {
            let sleeps = soft.is_sleeping() && self.wake != WakePolicy::Always;
            if soft.is_enabled() && !sleeps {
                self.softs.bodies.push((handle, samples.list.len()));
                gather(soft, &mut samples);
            }
        }
        samples.sites = samples.list.len();
        samples.number();
        let Softs {
            evaluator, forces, ..
        } = &mut self.softs;
        evaluator.wrenches(&compiled, &world, &samples, moment, forces);
        let bad = forces.iter().position(|force| !force.is_finite());
        let error =
            bad.map(|particle| blame::non_finite(compiled, &world, &samples, moment, particle));
        self.softs.samples = samples;
        error.map_or(Ok(()), Err)
    }

    /// Gives the particles what was worked out before Rapier's step; returns how many took it.
    pub(crate) fn kick_soft(&mut self, dt: Real, softs: &mut SoftBodySet) -> usize {
        self.softs.before.clear();
        for (handle, soft) in softs.iter() {
            let states = soft.particle_positions().zip(soft.particle_velocities());
            self.softs.before.push((handle, states.collect()));
        }
        let whole = matches!(self.scheme, Scheme::Kick | Scheme::ExternalForce);
        self.push_soft(if whole { dt } else { dt * 0.5 }, softs)
    }

    /// The second half of the kick; returns how many particles took it.
    pub(crate) fn end_soft(&mut self, dt: Real, softs: &mut SoftBodySet) -> usize {
        match self.scheme {
            Scheme::Kick | Scheme::ExternalForce => 0,
            _ => self.push_soft(dt * 0.5, softs),
        }
    }

    fn push_soft(&self, duration: Real, softs: &mut SoftBodySet) -> usize {
        let wake = self.wake == WakePolicy::Always;
        let mut pushed = 0;
        for (handle, first) in &self.softs.bodies {
            let Some(soft) = softs.get_mut(*handle) else {
                continue;
            };
            let forces = self.softs.forces[*first..].iter();
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
    pub(crate) fn restore_soft(&self, softs: &mut SoftBodySet) {
        for (handle, states) in &self.softs.before {
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
        let sample = SamplePoint {
            world_point: soft.particle_position(number),
            arm: Vector::ZERO,
            velocity: soft.particle_velocity(number),
            body: samples.bodies.len() as u32,
            owner: owner(Some(root)),
            radius: soft.particle_radius(),
            mass: particle.mass(),
            share: if total > 0.0 {
                particle.mass() / total
            } else {
                0.0
            },
            charge: 0.0,
            volume: 0.0,
            fraction: 1.0,
            spread: 0,
            kind: Kind::Site,
            is_ball: true,
            groups: InteractionGroups::all(),
            user: 0,
            collider: None,
            at_origin: false,
        };
        samples.list.push(sample);
        samples.centres.push(SamplePoint {
            kind: Kind::Centre,
            ..sample
        });
        samples.bodies.push(root);
    }
}
