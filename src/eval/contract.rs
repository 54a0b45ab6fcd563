//! The trait that all evaluators implement, with the scene they read and the sums they add to.

use super::frames::FrameCache;
use super::sampled_world::SampledWorld;
use super::slowings::BodySlowings;
use crate::field::Frames;
use crate::math::Vector;
use crate::rigid::Wrench;

/// The sums that evaluators add to.
pub(super) struct Sums<'a> {
    /// The force on each site.
    pub forces: &'a mut [Vector],
    /// The wrench on each body besides the forces on its sites.
    pub wrenches: &'a mut [Wrench],
    /// The derivatives by velocity of drag and wind on the bodies, if they are asked for.
    pub slowings: Option<&'a mut BodySlowings>,
}

/// The inputs of an evaluation in progress, and the sums that it adds to.
pub(super) struct Summing<'a, F> {
    pub scene: &'a SampledWorld<'a, F>,
    pub frames: &'a mut FrameCache,
    pub sums: Sums<'a>,
}

/// An evaluator of batches of one kind. The suite in `tests` checks that:
///
/// - it adds to the sums what the [reference](crate::reference) gives, within rounding, at all samples of the
///   batch and at no others;
/// - sources whose anchor is gone, or that are off, add nothing, nor do those of the sampled body itself;
/// - buffers, neighbours and hierarchies that it keeps between calls do not change any bit of the result.
pub(super) trait BatchEvaluator<B: ?Sized> {
    /// Prepares for a scene, before any batch of it.
    fn begin(&mut self, _on: &mut Summing<'_, impl Frames>) {}

    /// Adds the forces of a batch. The number tells the batch from others of its kind.
    fn add(&mut self, number: u32, batch: &B, on: &mut Summing<'_, impl Frames>);
}
