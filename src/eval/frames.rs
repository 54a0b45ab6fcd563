//! Where the anchors of a tree are, looked up when first asked for.

use crate::compile::{AnchorId, Compiled, NO_ANCHOR, Program};
use crate::field::{Frame, Frames};

/// The frames of one evaluation.
#[derive(Debug, Default)]
pub(super) struct FrameCache {
    frames: Vec<Option<Frame>>,
    known: Vec<bool>,
}

impl FrameCache {
    /// Forgets where everything was.
    pub(super) fn clear(&mut self, compiled: &Compiled) {
        self.frames.clear();
        self.frames.resize(compiled.anchors.len(), None);
        self.known.clear();
        self.known.resize(compiled.anchors.len(), false);
    }

    /// The frame of an anchor, if it is there.
    pub(super) fn get(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        anchor: AnchorId,
    ) -> Option<Frame> {
        let place = anchor as usize;
        if !self.known[place] {
            self.known[place] = true;
            self.frames[place] = world.frame(&compiled.anchors[place]);
        }
        self.frames[place]
    }

    /// Looks up all anchors of a program.
    pub(super) fn fill(&mut self, compiled: &Compiled, world: &impl Frames, program: &Program) {
        let anchors = program.anchors.iter().chain(&program.centres);
        for anchor in anchors.filter(|anchor| **anchor != NO_ANCHOR) {
            self.get(compiled, world, *anchor);
        }
    }

    /// By anchor: its frame, if it was looked up and is there.
    pub(super) fn all(&self) -> &[Option<Frame>] {
        &self.frames
    }
}
