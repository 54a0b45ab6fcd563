//! What every evaluator promises.

use super::frames::FrameCache;
use super::slowings::BodySlowings;
use crate::compile::Compiled;
use crate::field::Frames;
use crate::math::Vector;
use crate::rigid::Wrench;
use crate::sample::{Moment, Samples};

/// What is evaluated on: samples at one moment, and a world in which anchors are found.
pub(super) struct Scene<'a, F> {
    pub compiled: &'a Compiled,
    pub world: &'a F,
    pub samples: &'a Samples,
    pub moment: Moment,
}

/// What evaluators add to.
pub(super) struct Sums<'a> {
    /// The force on each sample of the list.
    pub forces: &'a mut [Vector],
    /// What acts on each body as a whole, beside the forces on its samples.
    pub wrenches: &'a mut [Wrench],
    /// How drag and wind slow the bodies, if that is asked for.
    pub slowings: Option<&'a mut BodySlowings>,
}

/// Evaluates batches of one kind. `tests` in this folder hold each one to it:
///
/// - it adds to the sums what the [reference](crate::reference) gives, within rounding, on all
///   samples that take the batch, and on no others;
/// - sources whose anchor is gone, or that are off, give nothing; nor do those of the body itself;
/// - what it keeps from call to call (buffers, neighbours, hierarchies) does not show in any bit.
pub(super) trait BatchEvaluator<B: ?Sized> {
    /// Takes up the scene, before any batch of it.
    fn begin(&mut self, _scene: &Scene<'_, impl Frames>, _frames: &mut FrameCache) {}

    /// Adds what a batch gives. The number tells it from the others of its kind.
    fn add(
        &mut self,
        batch: (u32, &B),
        scene: &Scene<'_, impl Frames>,
        frames: &mut FrameCache,
        sums: &mut Sums<'_>,
    );
}
