//! Particles of soft bodies in fields.
//!
//! A force that reads no velocities is an impulse before Rapier's step and another after it. One that does is a load:
//! its mean along the free path of the particle under it, gravity, the user's force and damping, applied where Rapier
//! applies gravity. So drag acts on the velocity due to gravity, whatever number of iterations Rapier divides its step
//! into.

use super::coupling::{ExternalTerms, LinearisedWrench, Slope};
use super::jacobian;
use super::scheme::Scheme;
use crate::eval::{Lineariser, SampledWorld, Terms};
use crate::field::Frames;
use crate::math::{DVec3, Real, Vector, from_dvec3, to_dvec3, to_f64};
use crate::rapier::na::{Matrix3, Vector6};
use crate::rigid::{Mobility, Wrench, of_wrench, pair, phi1, six};

/// A particle when a half of a step begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParticleState {
    /// Zero for a particle that cannot move.
    pub inv_mass: Real,
    pub velocity: Vector,
    /// Gravity and the user's force.
    pub own: Vector,
    pub damping: Real,
}

/// The motion that fields give a particle.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ParticleMotion {
    /// A change of velocity.
    Kick(Vector),
    /// A force during Rapier's step, and the velocity that the particle has after it if nothing holds it.
    Load { force: Vector, arrives: Vector },
}

impl ParticleMotion {
    pub(crate) const NONE: ParticleMotion = ParticleMotion::Kick(Vector::ZERO);

    pub(crate) fn is_none(&self) -> bool {
        matches!(self, ParticleMotion::Kick(change) if *change == Vector::ZERO)
    }

    /// The speed of a particle after this motion.
    pub(crate) fn speed(&self, state: &ParticleState) -> Real {
        match self {
            ParticleMotion::Kick(change) => (state.velocity + *change).length(),
            ParticleMotion::Load { arrives, .. } => arrives.length(),
        }
    }
}

/// The times over which forces act: `before` Rapier's step if they read no velocities, and `after` it for all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Durations {
    pub whole: Real,
    pub before: Real,
    pub after: Real,
}

impl Durations {
    pub(crate) fn new(scheme: Scheme, dt: Real) -> Self {
        let (before, after) = match scheme {
            Scheme::Kick | Scheme::ExternalForce => (dt, 0.0),
            _ => (dt * 0.5, dt * 0.5),
        };
        Durations {
            whole: dt,
            before,
            after,
        }
    }
}

/// The derivatives of the forces on particles by their velocities; its buffers are reused.
#[derive(Default)]
pub(crate) struct Particles {
    lineariser: Lineariser,
    /// The linearised force on each particle; empty if no field reads velocities.
    pub couplings: Vec<Option<LinearisedWrench>>,
}

impl Particles {
    /// Computes the derivatives of the forces by velocity, except for particles in `left_out`.
    pub(crate) fn couple(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        forces: &[Wrench],
        left_out: &[bool],
    ) {
        self.couplings.clear();
        if !scene.compiled.reads_velocity {
            return;
        }
        self.lineariser.prepare(scene);
        let centres = &scene.samples.centres;
        for (place, force) in forces.iter().enumerate() {
            let coupling = (!left_out[place]).then(|| {
                let (lineariser, terms) = (&mut self.lineariser, Terms::ThatReadVelocities);
                let own = jacobian::of_body(lineariser, scene, terms, place, DVec3::ZERO);
                let slope = Slope::of_body(&own.by_velocity);
                let at = six(to_dvec3(centres[place].velocity), DVec3::ZERO);
                let felt = slope.is_finite() && !slope.is_zero();
                let evaluated = of_wrench(*force);
                let in_part = scene.compiled.ignores_velocity_in_part;
                let precise = if in_part { &evaluated } else { &own.wrench };
                felt.then(|| LinearisedWrench::new(precise, slope, &evaluated, at))
            });
            self.couplings.push(coupling.flatten());
        }
    }

    /// The share of a force that reads velocities which a particle lacks if it is held where it is, because its load is
    /// the mean of the force on a free one: 1 − φ₁(−k·dt) for a drag of rate k.
    pub(crate) fn lack(&self, place: usize, state: &ParticleState, dt: Real) -> f64 {
        let rate = |it: &LinearisedWrench| it.slope.fastest(&state.mobility());
        let rate = self.coupling(place).map_or(0.0, rate);
        1.0 - phi1(-rate * to_f64(dt))
    }

    fn coupling(&self, place: usize) -> Option<&LinearisedWrench> {
        self.couplings.get(place)?.as_ref()
    }

    /// The motion of a particle before Rapier's step.
    pub(crate) fn first(
        &self,
        place: usize,
        state: &ParticleState,
        force: Vector,
        durations: Durations,
    ) -> ParticleMotion {
        if state.inv_mass == 0.0 || durations.whole == 0.0 {
            return ParticleMotion::NONE;
        }
        let coupling = self.coupling(place);
        let load = coupling.and_then(|coupling| state.load(coupling, to_f64(durations.whole)));
        load.unwrap_or(ParticleMotion::Kick(
            force * durations.before * state.inv_mass,
        ))
    }

    /// The motion of a particle after Rapier's step; `was` is the coupling with which it was loaded. The load had the
    /// force at the step's start for the whole step, so half of its change with position and time remains.
    pub(crate) fn second(
        &self,
        place: usize,
        state: &ParticleState,
        force: Vector,
        was: Option<&LinearisedWrench>,
        durations: Durations,
    ) -> ParticleMotion {
        if state.inv_mass == 0.0 || durations.after == 0.0 {
            return ParticleMotion::NONE;
        }
        let now = six(to_dvec3(state.velocity), DVec3::ZERO);
        let coupling = self.coupling(place);
        let is = coupling.map_or_else(|| six(to_dvec3(force), DVec3::ZERO), |it| it.at(&now));
        let had = was.map_or_else(Vector6::zeros, |was| was.at(&now));
        let (change, duration) = (is - had, to_f64(durations.after));
        let mean = coupling.and_then(|coupling| {
            let (mobility, none) = (state.mobility(), ExternalTerms::default());
            coupling.mean(&mobility, &change, &none, duration)
        });
        let (mean, _) = pair(&mean.unwrap_or(change));
        ParticleMotion::Kick(from_dvec3(mean * (duration * to_f64(state.inv_mass))))
    }
}

impl ParticleState {
    fn mobility(&self) -> Mobility {
        Mobility {
            inv_mass: DVec3::splat(to_f64(self.inv_mass)),
            inv_inertia: Matrix3::zeros(),
        }
    }

    /// The load with which Rapier's step, with its damping at the end, arrives at the velocity to which the forces
    /// lead.
    fn load(&self, coupling: &LinearisedWrench, dt: f64) -> Option<ParticleMotion> {
        let mass = to_f64(self.inv_mass).recip();
        let (velocity, own) = (to_dvec3(self.velocity), to_dvec3(self.own));
        let damping = to_f64(self.damping);
        let external = ExternalTerms {
            pull: six(own, DVec3::ZERO),
            damping: [damping, 0.0],
            momentum: six(velocity * mass, DVec3::ZERO),
        };
        let here = coupling.at(&six(velocity, DVec3::ZERO));
        let (mean, _) = pair(&coupling.mean(&self.mobility(), &here, &external, dt)?);
        let arrives = velocity + mean * (dt / mass);
        let force = (arrives * (1.0 + dt * damping) - velocity) * (mass / dt) - own;
        let [force, arrives] = [force, arrives].map(from_dvec3);
        force
            .is_finite()
            .then_some(ParticleMotion::Load { force, arrives })
    }
}
