//! Constant fields: the same vector for every body at any place.

use super::contract::{BatchEvaluator, Summing};
use crate::compile::ConstantField;
use crate::field::{ForceMode, Frames};
use crate::math::{DVec3, Real, Vector, from_dvec3, to_dvec3, to_f64};
use crate::number::{Number, Vec3, constant, real};
use crate::sample::SamplePoint;

/// Evaluates constant fields. Their vectors are first added up by force mode, so a body is weighted once per mode.
#[derive(Debug, Default)]
pub(super) struct Constants;

/// The sums of constant fields, by force mode.
#[derive(Debug)]
pub(super) struct ConstantPull {
    force: DVec3,
    acceleration: DVec3,
    /// A change of velocity over the step (m/s).
    change: DVec3,
    dt: f64,
}

impl ConstantPull {
    /// The sums of some constant fields, for a step of length `dt` (s).
    pub(super) fn of(constants: &[ConstantField], dt: Real) -> Self {
        let sum = |mode: ForceMode| -> DVec3 {
            let fields = constants.iter().filter(|constant| constant.mode == mode);
            fields.map(|constant| to_dvec3(constant.vector)).sum()
        };
        ConstantPull {
            force: sum(ForceMode::Force),
            acceleration: sum(ForceMode::Acceleration),
            change: sum(ForceMode::VelocityChange),
            dt: to_f64(dt),
        }
    }

    /// The force on a part with this mass and this share of the mass of its body.
    #[inline(always)]
    pub(super) fn on<T: Number>(&self, mass: T, share: T) -> Vec3<T> {
        let mut pull = constant::<T>(self.force) * share;
        if self.acceleration != DVec3::ZERO {
            pull += constant::<T>(self.acceleration) * mass;
        }
        if self.change != DVec3::ZERO {
            pull += constant::<T>(self.change) * (mass / self.dt);
        }
        pull
    }

    /// The force on a body as a whole, or on a particle of a soft body.
    fn on_sample(&self, sample: &SamplePoint) -> Vector {
        from_dvec3(real(self.on(to_f64(sample.mass), to_f64(sample.share))))
    }
}

impl BatchEvaluator<[ConstantField]> for Constants {
    fn add(&mut self, _: u32, constants: &[ConstantField], on: &mut Summing<'_, impl Frames>) {
        let pull = ConstantPull::of(constants, on.scene.moment.dt);
        let centres = on.scene.samples.centres.iter();
        let bodies = centres.zip(&mut *on.sums.wrenches);
        if !constants.is_empty() {
            bodies.for_each(|(centre, wrench)| wrench.force += pull.on_sample(centre));
        }
    }
}
