//! Where the anchors of fields are, looked up when first asked for.

use crate::compile::{AnchorId, Compiled, NO_ANCHOR, Program};
use crate::field::{Frame, Frames};

/// The frames of one evaluation.
#[derive(Debug, Default)]
pub(super) struct FrameCache {
    frames: Vec<Option<Frame>>,
    /// By anchor: the evaluation it was looked up in.
    known: Vec<u32>,
    evaluation: u32,
}

impl FrameCache {
    /// Forgets where everything was. Costs nothing, however many anchors there are.
    pub(super) fn clear(&mut self, compiled: &Compiled) {
        let count = compiled.anchors.len();
        if self.frames.len() < count {
            self.frames.resize(count, None);
            self.known.resize(count, 0);
        }
        if self.evaluation == u32::MAX {
            self.known.fill(0);
            self.evaluation = 0;
        }
        self.evaluation += 1;
    }

    /// The frame of an anchor, if it is there.
    pub(super) fn get(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        anchor: AnchorId,
    ) -> Option<Frame> {
        let place = anchor as usize;
        if self.known[place] != self.evaluation {
            self.known[place] = self.evaluation;
            self.frames[place] = world.frame(&compiled.anchors[place]);
        }
        self.frames[place]
    }

    /// Looks up what the leaves and modifiers of an instance hang on.
    pub(super) fn fill_instance(
        &mut self,
        compiled: &Compiled,
        world: &impl Frames,
        program: &Program,
        instance: u32,
    ) {
        let stride = program.stride();
        let first = instance as usize * stride;
        for anchor in &program.instances.anchors[first..first + stride] {
            if *anchor != NO_ANCHOR {
                self.get(compiled, world, *anchor);
            }
        }
    }

    /// Looks up all anchors of a program.
    pub(super) fn fill(&mut self, compiled: &Compiled, world: &impl Frames, program: &Program) {
        for anchor in program.instances.anchors() {
            self.get(compiled, world, anchor);
        }
    }

    /// By anchor: its frame, if it was looked up in this evaluation and is there.
    pub(super) fn all(&self) -> &[Option<Frame>] {
        &self.frames
    }
}
