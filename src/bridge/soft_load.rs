//! Forces on particles for the duration of Rapier's step.

use crate::integrate::LinearisedWrench;
use crate::math::Vector;
use crate::rapier::dynamics::{SoftBody, SoftBodyHandle, SoftBodySet};

/// A sampled soft body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampled {
    pub handle: SoftBodyHandle,
    /// See [`SoftBody::topology_version`].
    pub topology: u32,
    /// The index of its first particle among all sampled ones.
    pub first: usize,
}

/// The particles to which an open step has given a force.
#[derive(Debug, Default)]
pub(crate) struct SoftFlight {
    pub(super) bodies: Vec<Sampled>,
    /// By place: the linearised dependence of the force on the velocity, for particles that were loaded.
    pub(super) loaded: Vec<Option<LinearisedWrench>>,
}

impl SoftFlight {
    pub(super) fn clear(&mut self) {
        self.bodies.clear();
        self.loaded.clear();
    }

    /// The couplings of a body's particles; empty if nothing was loaded at all. `None` if the body is new or was torn
    /// in the meantime: it gets no second half of this step.
    pub(super) fn of(&self, body: Sampled) -> Option<&[Option<LinearisedWrench>]> {
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

/// The user's forces on the particles of a soft body, while forces of fields are added to them.
#[derive(Clone, Debug)]
pub(crate) struct LentForces {
    pub(super) body: SoftBodyHandle,
    topology: u32,
    own: Vec<OwnForce>,
}

/// The user's force on one particle.
#[derive(Clone, Copy, Debug)]
struct OwnForce {
    particle: usize,
    /// The particle's position when the body was made, which identifies the parts of a torn particle: they inherit it.
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

/// Records the users' forces on all particles.
pub(super) fn lend(softs: &SoftBodySet, lent: &mut Vec<LentForces>) {
    lent.extend(softs.iter().map(|(body, soft)| LentForces::of(body, soft)));
}

/// Restores the users' forces bit for bit, also in bodies that were torn in the meantime.
pub(crate) fn give_back(softs: &mut SoftBodySet, lent: &[LentForces]) {
    for forces in lent {
        let mut pieces = vec![forces.body];
        while let Some(handle) = pieces.pop() {
            let Some(soft) = softs.get_mut(handle) else {
                continue;
            };
            forces.give_back(soft);
            // Pieces from earlier steps are in the list themselves.
            let torn = soft.pieces().iter();
            pieces.extend(torn.filter(|piece| lent.iter().all(|it| it.body != **piece)));
        }
    }
}
