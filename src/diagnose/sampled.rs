//! The input of all diagnoses: fields, and bodies sampled for them.

use crate::field::FieldSet;
use crate::sample::{Moment, Samples};

/// Fields, with the bodies that were sampled for them at one moment.
pub(crate) struct SampledFields<'a, F> {
    pub set: &'a FieldSet,
    pub frames: &'a F,
    pub samples: &'a Samples,
    pub moment: Moment,
}

impl<'a, F> SampledFields<'a, F> {
    pub(crate) fn new(
        set: &'a FieldSet,
        frames: &'a F,
        samples: &'a Samples,
        moment: Moment,
    ) -> Self {
        SampledFields {
            set,
            frames,
            samples,
            moment,
        }
    }
}
