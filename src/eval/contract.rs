//! The trait that all evaluators implement, with the scene they read and the sums they add to.

use super::frames::FrameCache;
use super::slowings::BodySlowings;
use crate::compile::Compiled;
use crate::field::Frames;
use crate::math::Vector;
use crate::rigid::Wrench;
use crate::sample::{Moment, Samples};

/// The samples at one moment on which fields are evaluated, and a world in which anchors are found.
pub(crate) struct SampledWorld<'a, F> {
    pub compiled: &'a Compiled,
    pub world: &'a F,
    pub samples: &'a Samples,
    pub moment: Moment,
}

impl<'a, F> SampledWorld<'a, F> {
    pub(crate) fn new(
        compiled: &'a Compiled,
        world: &'a F,
        samples: &'a Samples,
        moment: Moment,
    ) -> Self {
        SampledWorld {
            compiled,
            world,
            samples,
            moment,
        }
    }
}

/// The sums that evaluators add to.
pub(super) struct Sums<'a> {
    /// The force on each placed sample of the list.
    pub forces: &'a mut [Vector],
    /// The wrench on each body as a whole, besides the forces on its samples.
    pub wrenches: &'a mut [Wrench],
    /// The derivatives by velocity of drag and wind on the bodies, if they are asked for.
    pub slowings: Option<&'a mut BodySlowings>,
}

/// An evaluator of batches of one kind. The suite in `tests` checks that:
///
/// - it adds to the sums what the [reference](crate::reference) gives, within rounding, at all samples of the
///   batch and at no others;
/// - sources whose anchor is gone, or that are off, add nothing, nor do those of the sampled body itself;
/// - buffers, neighbours and hierarchies that it keeps between calls do not change any bit of the result.
pub(super) trait BatchEvaluator<B: ?Sized> {
    /// Prepares for a scene, before any batch of it.
    fn begin(&mut self, _scene: &SampledWorld<'_, impl Frames>, _frames: &mut FrameCache) {}

    /// Adds the forces of a batch. The number tells the batch from others of its kind.
    fn add(
        &mut self,
        number: u32,
        batch: &B,
        scene: &SampledWorld<'_, impl Frames>,
        frames: &mut FrameCache,
        sums: &mut Sums<'_>,
    );
}
