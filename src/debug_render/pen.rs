//! Drawing of finite lines, up to a largest number.

use crate::math::Vector;
use crate::rapier::dynamics::{RigidBody, RigidBodyHandle};
use crate::rapier::pipeline::{DebugColor, DebugRenderBackend, DebugRenderObject};

/// The result of one call of [`render`](crate::debug_render::FieldDebugRenderPipeline::render).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct FieldDebugRenderOutcome {
    /// The number of lines that were drawn.
    pub lines: usize,
    /// The number of lines, and of arrows, that were left out because they were infinite or NaN.
    pub not_finite: usize,
    /// True if something was left out because of [`max_lines`](crate::debug_render::FieldDebugRenderStyle::max_lines).
    pub limit_reached: bool,
}

/// Draws lines through a backend.
pub(super) struct Pen<'a, B> {
    backend: &'a mut B,
    no_body: DebugRenderObject<'a>,
    object: DebugRenderObject<'a>,
    max_lines: usize,
    outcome: FieldDebugRenderOutcome,
}

impl<'a, B: DebugRenderBackend> Pen<'a, B> {
    pub fn new(backend: &'a mut B, no_body: &'a RigidBody, max_lines: usize) -> Self {
        let no_body = DebugRenderObject::RigidBody(RigidBodyHandle::invalid(), no_body);
        Pen {
            backend,
            no_body,
            object: no_body,
            max_lines,
            outcome: FieldDebugRenderOutcome::default(),
        }
    }

    /// Sets the object of the lines that follow; `None` for no body. Returns false if the backend filters it out.
    pub fn begin(&mut self, object: Option<DebugRenderObject<'a>>) -> bool {
        self.object = object.unwrap_or(self.no_body);
        self.backend.filter_object(self.object)
    }

    pub fn line(&mut self, a: Vector, b: Vector, color: DebugColor) {
        if !(a.is_finite() && b.is_finite()) {
            self.outcome.not_finite += 1;
        } else if self.outcome.lines >= self.max_lines {
            self.outcome.limit_reached = true;
        } else {
            self.outcome.lines += 1;
            self.backend.draw_line(self.object, a, b, color);
        }
    }

    /// Counts something that is not finite and was not drawn.
    pub fn note_not_finite(&mut self) {
        self.outcome.not_finite += 1;
    }

    /// Returns true if a line was left out because of `max_lines`: no line will be drawn any more.
    pub fn is_full(&self) -> bool {
        self.outcome.limit_reached
    }

    pub fn outcome(&self) -> FieldDebugRenderOutcome {
        self.outcome
    }
}
