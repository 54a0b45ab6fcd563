//! Constant fields: the same vector for every body at any place.

use super::contract::{BatchEvaluator, Summing};
use crate::compile::ConstantField;
use crate::field::{ForceMode, Frames};
use crate::math::{Real, Vector};
use crate::sample::SamplePoint;

/// Evaluates constants. Those of one force mode are added up first, so that a body is weighted once for each.
#[derive(Debug, Default)]
pub(super) struct Constants;

/// The sum of constants, by force mode.
#[derive(Debug)]
pub(super) struct ConstantPull {
    force: Vector,
    acceleration: Vector,
    /// A change of velocity over the step (m/s).
    change: Vector,
    dt: Real,
}

impl ConstantPull {
    /// The sums of some constants, for a step of length `dt` (s).
    pub(super) fn of(constants: &[ConstantField], dt: Real) -> Self {
        let sum = |mode: ForceMode| -> Vector {
            let fields = constants.iter().filter(|constant| constant.mode == mode);
            fields.map(|constant| constant.vector).sum()
        };
        ConstantPull {
            force: sum(ForceMode::Force),
            acceleration: sum(ForceMode::Acceleration),
            change: sum(ForceMode::VelocityChange),
            dt,
        }
    }

    /// The force on a body as a whole, or on a particle of a soft body.
    pub(super) fn on(&self, sample: &SamplePoint) -> Vector {
        let mass = sample.mass;
        let mut pull = self.force * sample.share;
        if self.acceleration != Vector::ZERO {
            pull += self.acceleration * mass;
        }
        if self.change != Vector::ZERO {
            pull += self.change * (mass / self.dt);
        }
        pull
    }
}

impl BatchEvaluator<[ConstantField]> for Constants {
    fn add(&mut self, _: u32, constants: &[ConstantField], on: &mut Summing<'_, impl Frames>) {
        let pull = ConstantPull::of(constants, on.scene.moment.dt);
        let centres = on.scene.samples.centres.iter();
        let bodies = centres.zip(&mut *on.sums.wrenches);
        if !constants.is_empty() {
            bodies.for_each(|(centre, wrench)| wrench.force += pull.on(centre));
        }
    }
}
