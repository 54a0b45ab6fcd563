//! The bodies that are evaluated before a step, because the evaluation of the last step does not hold for them.

use super::scene::StepScene;
use crate::field::Anchor;
use crate::integrate::Evaluation;
use crate::rigid::Body;
use crate::sample::Samples;

/// The bodies that have to be evaluated before a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Due {
    None,
    /// Those that are new or were changed between the steps.
    Some,
    All,
}

/// Some of the bodies that were read, with buffers for their evaluation.
#[derive(Default)]
pub(super) struct DueBodies {
    /// Their places among all bodies that were read, in order.
    pub places: Vec<usize>,
    pub bodies: Vec<Body>,
    samples: Samples,
    pub evaluation: Evaluation,
}

/// The anchors that are not on sampled bodies.
#[derive(Default)]
pub(super) struct AnchorsApart {
    /// The revision of the fields and the stamp of the samples that they were found for.
    pub made_for: Option<[u64; 2]>,
    pub anchors: Vec<Anchor>,
}

impl DueBodies {
    /// Swaps these bodies and samples with those of a scene.
    pub(super) fn swap(&mut self, scene: &mut StepScene) {
        std::mem::swap(&mut self.bodies, &mut scene.bodies);
        std::mem::swap(&mut self.samples, &mut scene.samples);
    }
}
