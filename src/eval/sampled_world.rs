//! Samples in a world, the input of evaluators.

use crate::compile::Compiled;
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
