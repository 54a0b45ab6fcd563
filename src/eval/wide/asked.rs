//! What is asked of a program.

use crate::compile::Program;
use crate::field::Frame;
use crate::sample::{Moment, Samples};

/// An instance of a program, and when it is asked.
pub(in crate::eval) struct Asked<'a> {
    pub program: &'a Program,
    pub instance: usize,
    pub frames: &'a [Option<Frame>],
    pub samples: &'a Samples,
    pub moment: Moment,
}

impl Asked<'_> {
    /// The frame that a leaf or modifier sees the samples in, if it has one.
    #[inline(always)]
    pub(super) fn frame(&self, anchored: usize) -> Option<&Frame> {
        self.program.frame(self.instance, anchored, self.frames)
    }
}
