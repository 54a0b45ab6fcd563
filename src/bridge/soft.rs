//! Soft bodies: each of their particles is a sample, and takes impulses.

use super::sleep::WakePolicy;
use crate::compile::Compiled;
use crate::eval::Evaluator;
use crate::field::Frames;
use crate::integrate::{FASTEST, Fault, FaultKind, Scheme};
use crate::math::{Real, RigidBodyHandle, Vector};
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
    /// Those that are to be disabled.
    condemned: Vec<SoftBodyHandle>,
    /// The roots of those that are not finite: they are left to Rapier, which disables them.
    pub unsound: Vec<RigidBodyHandle>,
    /// As they were before the step.
    before: Vec<(SoftBodyHandle, SoftBody)>,
}

impl SoftBodies {
    /// Works out the forces on all particles; writes nothing.
    pub(crate) fn evaluate(
        &mut self,
        compiled: &Compiled,
        properties: &Properties,
        (softs, frames): (&SoftBodySet, &impl Frames),
        moment: Moment,
        policy: WakePolicy,
    ) -> Option<Fault> {
        let samples = &mut self.samples;
        samples.clear();
        properties.of_world(samples);
        self.bodies.clear();
        self.condemned.clear();
        self.unsound.clear();
        for (handle, soft) in softs.iter() {
            let sleeps = soft.is_sleeping() && policy != WakePolicy::Always;
            if !soft.is_enabled() || sleeps {
                continue;
            }
            if !is_sound(soft) {
                self.unsound.push(soft.root_body());
                continue;
            }
            self.bodies.push((handle, samples.list.len()));
            gather(soft, samples);
        }
        samples.sites = samples.list.len();
        samples.number();
        let forces = &mut self.forces;
        self.evaluator
            .wrenches(compiled, frames, samples, moment, forces);
        Fault::of_wrenches(forces, compiled, frames, samples, moment)
    }

    /// The particles that would be too fast after the forces have acted for some time.
    pub(crate) fn too_fast(
        &self,
        compiled: &Compiled,
        frames: &impl Frames,
        (moment, duration): (Moment, Real),
    ) -> Option<Fault> {
        let speed = |place: usize| {
            let centre = &self.samples.centres[place];
            let kick = self.forces[place].force * duration / centre.mass;
            (centre.velocity + kick).length()
        };
        let bears = |place: &usize| self.forces[*place] == Wrench::ZERO || speed(*place) <= FASTEST;
        let places = (0..self.forces.len()).filter(|place| !bears(place));
        let places: Vec<usize> = places.collect();
        let kind = FaultKind::TooFast {
            speed: speed(*places.first()?),
        };
        let who = (&self.samples, places);
        Some(Fault::new(kind, compiled, frames, who, moment))
    }

    /// Puts what is left of the forces of a fault in their place.
    pub(crate) fn leave_out(&mut self, fault: &Fault, left: &[Wrench]) {
        for (place, left) in fault.places.iter().zip(left) {
            self.forces[*place] = *left;
        }
    }

    /// Has the soft bodies of a fault disabled, and not pushed.
    pub(crate) fn condemn(&mut self, fault: &Fault) {
        for place in &fault.places {
            let owner = self.bodies.partition_point(|(_, first)| first <= place);
            let (handle, first) = self.bodies[owner - 1];
            if self.condemned.contains(&handle) {
                continue;
            }
            self.condemned.push(handle);
            let end = self.bodies.get(owner).map_or(self.forces.len(), |it| it.1);
            self.forces[first..end].fill(Wrench::ZERO);
        }
    }

    /// Does with soft bodies what Rapier does with those that are not finite.
    pub(crate) fn quarantine(&self, softs: &mut SoftBodySet) {
        for handle in &self.condemned {
            let Some(soft) = softs.get_mut(*handle) else {
                continue;
            };
            for particle in 0..soft.num_particles() {
                soft.set_particle_velocity(particle, Vector::ZERO);
            }
            soft.reset_forces(false);
            soft.set_enabled(false);
        }
    }

    /// Takes the present state, to go back to; `None` to forget it.
    pub(crate) fn take(&mut self, softs: Option<&SoftBodySet>) {
        self.before.clear();
        let softs = softs.into_iter().flat_map(SoftBodySet::iter);
        let copies = softs.map(|(handle, soft)| (handle, soft.clone()));
        self.before.extend(copies);
    }

    /// Gives the particles what was worked out before Rapier's step.
    pub(crate) fn first_half(
        &self,
        (scheme, policy): (Scheme, WakePolicy),
        dt: Real,
        softs: &mut SoftBodySet,
    ) {
        self.push(durations(scheme, dt)[0], policy, softs);
        self.quarantine(softs);
    }

    /// The second half of the kick; returns how many particles took it.
    pub(crate) fn second_half(
        &self,
        (scheme, policy): (Scheme, WakePolicy),
        dt: Real,
        softs: &mut SoftBodySet,
    ) -> usize {
        let pushed = match durations(scheme, dt)[1] {
            0.0 => 0,
            duration => self.push(duration, policy, softs),
        };
        self.quarantine(softs);
        pushed
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

    /// Puts soft bodies back as they were before the step. Of one that was torn meanwhile the particles
    /// that are still there go back.
    pub(crate) fn restore(&self, softs: &mut SoftBodySet) {
        for (handle, was) in &self.before {
            let Some(soft) = softs.get_mut(*handle) else {
                continue;
            };
            let states = was.particle_positions().zip(was.particle_velocities());
            if soft.topology_version() == was.topology_version() {
                soft.clone_from(was);
                has_moved(soft);
            } else {
                for (particle, (position, velocity)) in (0..soft.num_particles()).zip(states) {
                    soft.set_particle_position(particle, position);
                    soft.set_particle_velocity(particle, velocity);
                }
            }
        }
    }
}

/// For how long the forces act before Rapier's step, and after it.
pub(crate) fn durations(scheme: Scheme, dt: Real) -> [Real; 2] {
    match scheme {
        Scheme::Kick | Scheme::ExternalForce => [dt, 0.0],
        _ => [dt * 0.5; 2],
    }
}

/// Has Rapier bring colliders after the particles in its next step. Pinned particles may have targets,
/// which this would forget.
fn has_moved(soft: &mut SoftBody) {
    let mut particles = soft.particles().iter();
    let free = particles.position(|particle| particle.inv_mass() > 0.0);
    if let Some(free) = free.filter(|_| !soft.is_sleeping()) {
        soft.set_particle_position(free, soft.particle_position(free));
    }
}

/// Whether all particles are somewhere, and move somehow; else Rapier disables the body in its step.
fn is_sound(soft: &SoftBody) -> bool {
    let mut states = soft.particle_positions().zip(soft.particle_velocities());
    states.all(|(position, velocity)| position.is_finite() && velocity.is_finite())
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
