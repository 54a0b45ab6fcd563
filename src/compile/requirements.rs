//! The kinds of samples that the terms of a set need.

use super::entries::RadialBatch;
use super::program::Program;
use crate::field::{Cuts, Points, Sampling, SamplingRule};

/// The kinds of samples that have to be gathered from bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SamplingRequirements {
    /// True if colliders are sampled; otherwise bodies are sampled as a whole only.
    pub parts: bool,
    /// For each set of [`Points`], the colliders that are sampled at them.
    pub several: [PartSampling; Points::ALL.len()],
    /// True if any program is sampled at these points; radial batches alone do not count.
    pub points: bool,
    /// True if bodies are to be cut where borders pass through them.
    pub pieces: bool,
    /// True if any force depends on the volumes of parts.
    pub displaced: bool,
    /// True if colliders are sampled one by one at the centre of mass.
    pub apart: bool,
}

/// The colliders that are sampled at several points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PartSampling {
    #[default]
    None,
    AllButBalls,
    All,
}

impl SamplingRequirements {
    pub(super) fn of_batch(batch: &RadialBatch) -> Self {
        let mut wanted = SamplingRequirements::default();
        wanted.add(batch.sampling_rule);
        wanted
    }

    pub(super) fn of_program(program: &Program) -> Self {
        let mut wanted = SamplingRequirements::default();
        if program.has_force {
            wanted.add(program.sampling_rule);
            wanted.points = wanted.has_many();
            wanted.displaced |= program.displaces();
        }
        wanted
    }

    fn add(&mut self, rule: SamplingRule) {
        self.pieces |= rule.cuts != Cuts::Never;
        self.apart |= rule.sampling == Sampling::Centre && rule.apart;
        self.parts |= rule.sampling != Sampling::Centre || self.pieces || self.apart;
        let cut = if rule.auto {
            PartSampling::AllButBalls
        } else {
            PartSampling::All
        };
        if let Some(points) = rule.points() {
            let known = &mut self.several[points as usize];
            *known = cut.max(*known);
        }
    }

    /// Returns true if any part is sampled at several points.
    pub(crate) fn has_many(&self) -> bool {
        self.several.iter().any(|it| *it != PartSampling::None)
    }

    /// These requirements with those of the sampling that was set for a body, if there is one.
    pub(crate) fn with(mut self, own: Option<Sampling>) -> Self {
        if let Some(sampling) = own {
            self.add(SamplingRule::own(sampling));
        }
        self
    }
}
