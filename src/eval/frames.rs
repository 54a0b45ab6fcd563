//! The present frames of anchors, looked up when they are first needed.

use super::sampled_world::SampledWorld;
use crate::compile::{AnchorId, Compiled, NO_ANCHOR, Program};
use crate::field::{Frame, Frames};

/// The frames of one evaluation.
#[derive(Debug, Default)]
pub(super) struct FrameCache {
    frames: Vec<Option<Frame>>,
    /// For each anchor, the evaluation in which it was last looked up.
    known: Vec<u64>,
    evaluation: u64,
}

impl FrameCache {
    /// Starts an evaluation, in which each frame is looked up again. The cost does not depend on the number of
    /// anchors, unless it has grown.
    pub(super) fn clear(&mut self, compiled: &Compiled) {
        let count = compiled.anchors.len();
        if self.frames.len() < count {
            self.frames.resize(count, None);
            self.known.resize(count, 0);
        }
        self.evaluation += 1;
    }

    /// The frame of an anchor; `None` if the body or collider that carries it was removed.
    pub(super) fn get(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        anchor: AnchorId,
    ) -> Option<Frame> {
        let place = anchor as usize;
        if self.known[place] != self.evaluation {
            self.known[place] = self.evaluation;
            self.frames[place] = scene.world.frame(&scene.compiled.anchors[place]);
        }
        self.frames[place]
    }

    /// Looks up the anchors of the leaves and modifiers of an instance.
    pub(super) fn fill_instance(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        program: &Program,
        instance: u32,
    ) {
        let stride = program.stride();
        let first = instance as usize * stride;
        for anchor in &program.instances.anchors[first..first + stride] {
            if *anchor != NO_ANCHOR {
                self.get(scene, *anchor);
            }
        }
    }

    /// Looks up all anchors of a program.
    pub(super) fn fill(&mut self, scene: &SampledWorld<'_, impl Frames>, program: &Program) {
        for anchor in program.instances.anchors() {
            self.get(scene, anchor);
        }
    }

    /// The frame of each anchor. Only those looked up in this evaluation are up to date.
    pub(super) fn all(&self) -> &[Option<Frame>] {
        &self.frames
    }
}
