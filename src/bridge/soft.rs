//! Soft bodies: each of their particles is a sample, and is moved by impulses and forces.

use super::sleep::WakePolicy;
use super::soft_load::{LentForces, Sampled, SoftFlight, lend};
use super::soft_volume::{bounds, volumes};
use super::world::WorldMut;
use crate::compile::Compiled;
use crate::eval::{Evaluator, SampledWorld};
use crate::field::Frames;
use crate::integrate::{Durations, FASTEST, Fault, FaultKind};
use crate::integrate::{ParticleMotion, ParticleState, Particles};
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::rapier::dynamics::{SoftBody, SoftBodyHandle, SoftBodySet};
use crate::rigid::Wrench;
use crate::sample::{Kind, Moment, Properties, SamplePoint, Samples, owner};

/// A pinned soft body is reported if a particle lacks more than this share of a force.
const LACKING: f64 = 0.01;

/// The samples, forces and motions of the particles of soft bodies.
#[derive(Default)]
pub(crate) struct SoftBodies {
    evaluator: Evaluator,
    samples: Samples,
    forces: Vec<Wrench>,
    particles: Particles,
    /// By place, the index of a sample, like `motions`.
    states: Vec<ParticleState>,
    motions: Vec<ParticleMotion>,
    /// By place: true if part of the force was left out because of a fault.
    left_out: Vec<bool>,
    /// A buffer, by particle.
    volumes: Vec<Real>,
    /// The sampled soft bodies, in the order of their samples.
    bodies: Vec<Sampled>,
    /// Soft bodies that are to be disabled because of a fault.
    quarantined: Vec<SoftBodyHandle>,
    /// The root bodies of soft bodies that are not finite; they are left to Rapier, which disables them.
    pub unsound: Vec<RigidBodyHandle>,
    /// The root bodies of soft bodies without volume, within reach of a field that acts on volumes.
    pub without_volume: Vec<RigidBodyHandle>,
    /// The root bodies of soft bodies with pins of which a held particle would lack more than [`LACKING`] of a force
    /// that reads velocities, each with the largest such share.
    pub lacking: Vec<(RigidBodyHandle, f64)>,
    /// Copies of the soft bodies from before the step.
    before: Vec<(SoftBodyHandle, SoftBody)>,
    /// A buffer for the next open step.
    pub spare: SoftFlight,
}

impl SoftBodies {
    /// Evaluates the forces on all particles, without writing anything. Returns a fault if some are not finite.
    pub(crate) fn evaluate(
        &mut self,
        compiled: &Compiled,
        properties: &Properties,
        world: &WorldMut<'_>,
        moment: Moment,
        policy: WakePolicy,
    ) -> Option<Fault> {
        let frames = &world.view();
        self.samples.clear();
        properties.of_world(&mut self.samples);
        self.states.clear();
        self.bodies.clear();
        self.quarantined.clear();
        self.unsound.clear();
        self.without_volume.clear();
        for (handle, soft) in world.soft_bodies.iter() {
            let sleeps = soft.is_sleeping() && policy != WakePolicy::Always;
            if !soft.is_enabled() || sleeps {
                continue;
            }
            if !is_sound(soft) {
                self.unsound.push(soft.root_body());
                continue;
            }
            self.bodies.push(Sampled {
                handle,
                topology: soft.topology_version(),
                first: self.states.len(),
            });
            let displaced = compiled.requirements.displaced;
            self.gather(soft, world.gravity, displaced);
            let flat = || self.volumes.iter().all(|volume| *volume == 0.0);
            if displaced && flat() && compiled.displaces_near(frames, bounds(soft)) {
                self.without_volume.push(soft.root_body());
            }
        }
        let samples = &mut self.samples;
        samples.number();
        self.left_out.clear();
        self.left_out.resize(samples.sites.len(), false);
        let scene = SampledWorld::new(compiled, frames, samples, moment);
        self.evaluator.wrenches(&scene, &mut self.forces, None);
        Fault::of_wrenches(&self.forces, &scene)
    }

    /// Adds one sample for each particle, each as a body of its own to the evaluator.
    fn gather(&mut self, soft: &SoftBody, gravity: Vector, displaced: bool) {
        if displaced {
            volumes(soft, &mut self.volumes);
        }
        let (samples, settings) = (&mut self.samples, soft.particle_settings());
        let (root, total) = (soft.root_body(), soft.mass());
        for (number, particle) in soft.particles().iter().enumerate() {
            let mut sample = SamplePoint::at_rest(samples.bodies.len() as u32, owner(Some(root)));
            sample.world_point = particle.position();
            sample.velocity = particle.velocity();
            sample.radius = soft.particle_radius();
            sample.mass = particle.mass();
            if displaced {
                sample.volume = self.volumes[number];
            }
            sample.share = if total > 0.0 {
                particle.mass() / total
            } else {
                0.0
            };
            self.states.push(ParticleState {
                inv_mass: particle.inv_mass(),
                velocity: particle.velocity(),
                own: particle.force() + gravity * (settings.gravity_scale * particle.mass()),
                damping: settings.linear_damping,
            });
            samples.centres.push(sample);
            samples.sites.push(SamplePoint {
                kind: Kind::Particle,
                ..sample
            });
            samples.bodies.push(root);
        }
    }

    /// Computes the motion of all particles from the forces: the first half before Rapier's step, or the second half
    /// after it, for which `flight` holds the particles that had a force during the step.
    pub(crate) fn move_all(
        &mut self,
        compiled: &Compiled,
        frames: &impl Frames,
        moment: Moment,
        durations: Durations,
        flight: Option<&SoftFlight>,
    ) {
        let scene = SampledWorld::new(compiled, frames, &self.samples, moment);
        self.particles.couple(&scene, &self.forces, &self.left_out);
        self.motions.clear();
        if flight.is_none() {
            self.find_lacking(durations.whole);
        }
        for (number, body) in self.bodies.iter().enumerate() {
            let loaded = flight.map(|flight| flight.of(*body));
            for (particle, place) in self.places(number).enumerate() {
                let (state, force) = (&self.states[place], self.forces[place].force);
                self.motions.push(match loaded {
                    None => self.particles.first(place, state, force, durations),
                    Some(None) => ParticleMotion::NONE,
                    Some(Some(loaded)) => {
                        let was = loaded.get(particle).and_then(Option::as_ref);
                        // A force that is left out now already acted during the whole step.
                        if was.is_some() && self.left_out[place] {
                            ParticleMotion::NONE
                        } else {
                            self.particles.second(place, state, force, was, durations)
                        }
                    }
                });
            }
        }
    }

    /// Finds the soft bodies with pins on which fields that read velocities act too weakly.
    fn find_lacking(&mut self, dt: Real) {
        self.lacking.clear();
        if self.particles.couplings.is_empty() {
            return;
        }
        for number in 0..self.bodies.len() {
            let places = self.places(number);
            let roots = &self.samples.bodies[places.clone()];
            let states = || places.clone().zip(&self.states[places.clone()]);
            if states().all(|(_, state)| state.inv_mass > 0.0) {
                continue;
            }
            let lack = |(place, state)| self.particles.lack(place, state, dt);
            let most = states().map(lack).fold(0.0, f64::max);
            if most > LACKING {
                self.lacking.push((roots[0], most));
            }
        }
    }

    /// The places of the particles of a body, by its number in `bodies`.
    fn places(&self, number: usize) -> std::ops::Range<usize> {
        let next = self.bodies.get(number + 1);
        self.bodies[number].first..next.map_or(self.states.len(), |next| next.first)
    }

    /// The fault of the particles that would be too fast, if there are any.
    pub(crate) fn too_fast(
        &self,
        compiled: &Compiled,
        frames: &impl Frames,
        moment: Moment,
    ) -> Option<Fault> {
        let speed = |place: usize| self.motions[place].speed(&self.states[place]);
        let bears = |place: &usize| self.motions[*place].is_none() || speed(*place) <= FASTEST;
        let places = (0..self.motions.len()).filter(|place| !bears(place));
        let places: Vec<usize> = places.collect();
        let kind = FaultKind::TooFast {
            speed: speed(*places.first()?),
        };
        let scene = SampledWorld::new(compiled, frames, &self.samples, moment);
        Some(Fault::new(kind, &scene, places))
    }

    /// Replaces the forces of a fault by what remains of them.
    pub(crate) fn leave_out(&mut self, fault: &Fault, left: &[Wrench]) {
        for (place, left) in fault.places.iter().zip(left) {
            self.forces[*place] = *left;
            self.left_out[*place] = true;
        }
    }

    /// Marks the soft bodies of a fault to be disabled, and removes the forces on them.
    pub(crate) fn quarantine(&mut self, fault: &Fault) {
        for place in &fault.places {
            let number = self.bodies.partition_point(|it| it.first <= *place) - 1;
            let handle = self.bodies[number].handle;
            if self.quarantined.contains(&handle) {
                continue;
            }
            self.quarantined.push(handle);
            let places = self.places(number);
            self.forces[places.clone()].fill(Wrench::ZERO);
            self.left_out[places].fill(true);
        }
    }

    /// Stops and disables the quarantined bodies, as Rapier does with soft bodies that are not finite.
    pub(crate) fn disable_quarantined(&self, softs: &mut SoftBodySet) {
        for handle in &self.quarantined {
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

    /// Copies all soft bodies, or drops the copies for `None`.
    pub(crate) fn take(&mut self, softs: Option<&SoftBodySet>) {
        self.before.clear();
        let softs = softs.into_iter().flat_map(SoftBodySet::iter);
        let copies = softs.map(|(handle, soft)| (handle, soft.clone()));
        self.before.extend(copies);
    }

    /// Applies the motions computed before Rapier's step. If forces are added to those of users, records the latter in
    /// `lent`, to restore them after the step.
    pub(crate) fn first_half(
        &mut self,
        policy: WakePolicy,
        softs: &mut SoftBodySet,
        lent: &mut Vec<LentForces>,
    ) -> SoftFlight {
        let mut flight = std::mem::take(&mut self.spare);
        let loads = |motion: &ParticleMotion| matches!(motion, ParticleMotion::Load { .. });
        flight.clear();
        if self.motions.iter().any(loads) {
            lend(softs, lent);
            lent.retain(|forces| !self.quarantined.contains(&forces.body));
            for (place, motion) in self.motions.iter().enumerate() {
                let coupling = self.particles.couplings.get(place).copied().flatten();
                flight.loaded.push(coupling.filter(|_| loads(motion)));
            }
            flight.bodies.extend_from_slice(&self.bodies);
        }
        self.push(policy, softs);
        self.disable_quarantined(softs);
        flight
    }

    /// Applies the second half of the motions; returns the number of particles moved.
    pub(crate) fn second_half(&self, policy: WakePolicy, softs: &mut SoftBodySet) -> usize {
        let pushed = self.push(policy, softs);
        self.disable_quarantined(softs);
        pushed
    }

    fn push(&self, policy: WakePolicy, softs: &mut SoftBodySet) -> usize {
        let wake = policy == WakePolicy::Always;
        let mut pushed = 0;
        for (number, body) in self.bodies.iter().enumerate() {
            let Some(soft) = softs.get_mut(body.handle) else {
                continue;
            };
            for (particle, place) in self.places(number).enumerate() {
                let motion = &self.motions[place];
                if motion.is_none() {
                    continue;
                }
                match *motion {
                    ParticleMotion::Kick(change) => {
                        let mass = self.samples.centres[place].mass;
                        soft.apply_particle_impulse(particle, change * mass, wake);
                    }
                    ParticleMotion::Load { force, .. } => {
                        soft.add_particle_force(particle, force, wake);
                    }
                }
                pushed += 1;
            }
        }
        pushed
    }

    /// Restores soft bodies from their copies. In a body that was torn in the meantime, only the positions and
    /// velocities of the particles that it still has are restored.
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

/// Makes Rapier move the colliders to the particles in its next step, by setting the position of a free particle.
/// Setting that of a pinned one would clear its target.
fn has_moved(soft: &mut SoftBody) {
    let mut particles = soft.particles().iter();
    let free = particles.position(|particle| particle.inv_mass() > 0.0);
    if let Some(free) = free.filter(|_| !soft.is_sleeping()) {
        soft.set_particle_position(free, soft.particle_position(free));
    }
}

/// Returns true if all positions and velocities are finite; otherwise Rapier disables the body in its step.
fn is_sound(soft: &SoftBody) -> bool {
    let mut states = soft.particle_positions().zip(soft.particle_velocities());
    states.all(|(position, velocity)| position.is_finite() && velocity.is_finite())
}
