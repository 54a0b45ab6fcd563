//! Layers of different priority, which may replace each other or exclude the rest.

use super::nodes::Node;
use super::priority::Override;
use super::tree::Tree;

/// One operand of [`Tree::layers`], with its priority.
#[derive(Clone, Debug)]
#[must_use = "setters and operators take the value and return the changed one"]
pub struct Layer {
    pub(crate) tree: Tree,
    pub(crate) priority: i32,
    pub(crate) mode: Override,
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

    /// Sets the priority. Layers of higher priority come first.
    pub fn priority(mut self, priority: i32) -> Self {
        self.priority = priority;
        self
    }

    /// Where the layer is defined, drops the forces of layers of higher priority.
    pub fn replacing(mut self) -> Self {
        self.mode.replaces = true;
        self
    }

    /// Where the layer is defined, leaves out layers of lower priority.
    pub fn stopping(mut self) -> Self {
        self.mode.stops = true;
        self
    }
}

impl Tree {
    /// Layers of different priority, with the rules of other engines' zones.
    ///
    /// At each sample the layers that are defined there are gone through from the highest
    /// [priority](Layer::priority) to the lowest (in their order, where priorities are equal). Each
    /// adds its force; one that [replaces](Layer::replacing) first drops what was gathered; after
    /// one that [stops](Layer::stopping), the rest is left out. These are glTF's `OMI_physics_gravity`
    /// booleans; with them, Godot's modes are *combine* (neither), *combine-replace* (stop),
    /// *replace* (both) and *replace-combine* (replace).
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let world = Layer::new(Field::uniform(Vector::Y * -9.81).force_mode(ForceMode::Acceleration));
    /// let lift = Field::uniform(Vector::Y).force_mode(ForceMode::Acceleration);
    /// let shaft = lift.within(Region::cylinder(10.0, 1.0));
    /// let tree = Tree::layers([world, Layer::new(shaft).priority(1).replacing().stopping()]);
    /// # let _ = tree;
    /// ```
    pub fn layers(layers: impl IntoIterator<Item = Layer>) -> Self {
        let filled = |layer: &Layer| !layer.tree.nodes.is_empty();
        let mut layers: Vec<Layer> = layers.into_iter().filter(filled).collect();
        layers.sort_by_key(|layer| std::cmp::Reverse(layer.priority));
        let modes = layers.iter().map(|layer| layer.mode).collect();
        let mut tree = Tree::empty();
        let mut operands = Vec::new();
        for layer in layers {
            tree.append(layer.tree);
            operands.push(tree.root());
        }
        if !operands.is_empty() {
            tree.nodes.push(Node::Layers { operands, modes });
        }
        tree
    }
}
