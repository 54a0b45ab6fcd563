//! Layers of different priority.

use super::tree::Tree;

/// One operand of [`Tree::layers`].
#[derive(Clone, Debug)]
#[must_use = "setters and operators take the value and return the changed one"]
pub struct Layer {
    pub(crate) tree: Tree,
    pub(crate) priority: i32,
    pub(crate) mode: Override,
}

/// What a layer does to the others where it is defined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub struct Override {
    /// Drops what layers of higher priority gave.
    pub replaces: bool,
    /// Leaves layers of lower priority out.
    pub stops: bool,
}

impl Layer {
    /// A layer of priority zero that adds to the others.
    pub fn new(tree: impl Into<Tree>) -> Self {
        Layer {
            tree: tree.into(),
            priority: 0,
            mode: Override::default(),
        }
    }

    /// Sets the priority; layers of higher priority come first.
    pub fn priority(mut self, priority: i32) -> Self {
        self.priority = priority;
        self
    }

    /// Drops, where it is defined, what layers of higher priority gave.
    pub fn replacing(mut self) -> Self {
        self.mode.replaces = true;
        self
    }

    /// Leaves out, where it is defined, layers of lower priority.
    pub fn stopping(mut self) -> Self {
        self.mode.stops = true;
        self
    }
}
