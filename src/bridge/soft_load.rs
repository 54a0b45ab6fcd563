//! Forces on particles that are theirs during Rapier's step only.

use crate::integrate::Coupling;
use crate::math::Vector;
use crate::rapier::dynamics::{SoftBody, SoftBodyHandle, SoftBodySet};

/// A soft body that is sampled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampled {
    pub handle: SoftBodyHandle,
    /// See [`SoftBody::topology_version`].
    pub topology: u32,
    /// The place of its first particle.
    pub first: usize,
}

/// What an open step knows of the particles that it has loaded.
#[derive(Debug, Default)]
pub(crate) struct SoftFlight {
    pub(super) bodies: Vec<Sampled>,
    /// By place, how the force on those that were loaded changes with the velocity.
    pub(super) loaded: Vec<Option<Coupling>>,
}

impl SoftFlight {
    pub(super) fn clear(&mut self) {
        self.bodies.clear();
        self.loaded.clear();
    }

    /// Of the particles of a body, empty if nothing was loaded at all; `None` if the body was torn
    /// meanwhile, or is new: then it has had all that it gets of this step.
    pub(super) fn of(&self, body: Sampled) -> Option<&[Option<Coupling>]> {
        if self.loaded.is_empty() {
            return Some(&[]);
        }
        let number = self.bodies.iter().position(|it| it.handle == body.handle)?;
        let next = self.bodies.get(number + 1);
        let end = next.map_or(self.loaded.len(), |next| next.first);
        let was = self.bodies[number];
        (was.topology == body.topology).then(|| &self.loaded[was.first..end])
    }
}

/// The user's forces on the particles of a soft body, while those of fields stand on top of them.
#[derive(Clone, Debug)]
pub(crate) struct LentForces {
    pub(super) body: SoftBodyHandle,
    topology: u32,
    own: Vec<OwnForce>,
}

/// The user's force on a particle.
#[derive(Clone, Copy, Debug)]
struct OwnForce {
    particle: usize,
    /// Where it was when the body was made. The parts of a particle that was torn have this of it.
    rest: Vector,
    force: Vector,
}

impl LentForces {
    fn of(body: SoftBodyHandle, soft: &SoftBody) -> Self {
        let particles = soft.particles().iter().enumerate();
        let pushed = particles.filter(|(_, it)| it.force() != Vector::ZERO);
        let own = pushed.map(|(particle, it)| OwnForce {
            particle,
            rest: it.initial_rest_position(),
            force: it.force(),
        });
        LentForces {
            body,
            topology: soft.topology_version(),
            own: own.collect(),
        }
    }

    fn give_back(&self, soft: &mut SoftBody) {
        soft.reset_forces(false);
        let is_whole = soft.topology_version() == self.topology;
        if is_whole {
            for own in &self.own {
                soft.add_particle_force(own.particle, own.force, false);
            }
            return;
        }
        for particle in 0..soft.num_particles() {
            let rest = soft.particles()[particle].initial_rest_position();
            if let Some(own) = self.own.iter().find(|own| own.rest == rest) {
                soft.add_particle_force(particle, own.force, false);
            }
        }
    }
}

/// Takes down the users' forces on all particles.
pub(super) fn lend(softs: &SoftBodySet, lent: &mut Vec<LentForces>) {
    lent.extend(softs.iter().map(|(body, soft)| LentForces::of(body, soft)));
}

/// Gives the users their forces back, bit for bit; also where bodies were torn meanwhile.
pub(crate) fn give_back(softs: &mut SoftBodySet, lent: &[LentForces]) {
    for forces in lent {
        let mut pieces = vec![forces.body];
        while let Some(handle) = pieces.pop() {
            let Some(soft) = softs.get_mut(handle) else {
                continue;
            };
            forces.give_back(soft);
            // Pieces of earlier steps are in the list themselves.
            let torn = soft.pieces().iter();
            pieces.extend(torn.filter(|piece| lent.iter().all(|it| it.body != **piece)));
        }
    }
}
