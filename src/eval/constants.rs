//! The same vector for every body, whatever its place.

use super::contract::{BatchEvaluator, Scene, Sums};
use super::frames::FrameCache;
use crate::compile::{ConstantField, Weighting};
use crate::field::{ForceMode, Frames};
use crate::math::Vector;

/// Adds up all constants first: one weight of a body for all of a kind.
#[derive(Debug, Default)]
pub(super) struct Constants;

impl BatchEvaluator<[ConstantField]> for Constants {
    fn add(
        &mut self,
        (_, constants): (u32, &[ConstantField]),
        scene: &Scene<'_, impl Frames>,
        _: &mut FrameCache,
        sums: &mut Sums<'_>,
    ) {
        for mode in [
            ForceMode::Force,
            ForceMode::Acceleration,
            ForceMode::VelocityChange,
        ] {
            let fields = constants.iter().filter(|constant| constant.mode == mode);
            let vector: Vector = fields.map(|constant| constant.vector).sum();
            if vector == Vector::ZERO {
                continue;
            }
            let weighting = Weighting::shared(mode);
            let bodies = scene.samples.centres.iter().zip(&mut *sums.wrenches);
            for (centre, wrench) in bodies {
                wrench.force += vector * scene.samples.weight(centre, &weighting, scene.moment);
            }
        }
    }
}
