//! Which samples of bodies a tree wants.

use super::entries::RadialBatch;
use super::program::Program;
use crate::field::{Cuts, Points, Sampling, SamplingRule};

/// What is to be gathered of bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SamplingRequirements {
    /// Whether colliders are looked at, or only bodies as a whole.
    pub parts: bool,
    /// Samples at several points, by [`Points`].
    pub several: [PartSampling; Points::ALL.len()],
    /// Whether those are asked for one by one.
    pub points: bool,
    /// Whether bodies are to be cut where borders pass through them.
    pub pieces: bool,
    /// Whether the volumes of parts are asked for.
    pub displaced: bool,
    /// Whether colliders are asked one by one at the centre of mass.
    pub apart: bool,
}

/// Which colliders are sampled at several points.
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
        wanted.add(batch.how);
        wanted
    }

    pub(super) fn of_program(program: &Program) -> Self {
        let mut wanted = SamplingRequirements::default();
        if program.has_force {
            wanted.add(program.how);
            wanted.points = wanted.has_many();
            wanted.displaced |= program.displaces();
        }
        wanted
    }

    fn add(&mut self, how: SamplingRule) {
        self.pieces |= how.cuts != Cuts::Never;
        self.apart |= how.sampling == Sampling::Centre && how.apart;
        self.parts |= how.sampling != Sampling::Centre || self.pieces || self.apart;
        let cut = if how.auto {
            PartSampling::AllButBalls
        } else {
            PartSampling::All
        };
        if let Some(points) = how.points() {
            let known = &mut self.several[points as usize];
            *known = cut.max(*known);
        }
    }

    /// Whether any part is sampled at many points.
    pub(crate) fn has_many(&self) -> bool {
        self.several.iter().any(|it| *it != PartSampling::None)
    }

    /// What a body wants that asks for a sampling of its own.
    pub(crate) fn with(mut self, own: Option<Sampling>) -> Self {
        if let Some(sampling) = own {
            self.add(SamplingRule::own(sampling));
        }
        self
    }
}
