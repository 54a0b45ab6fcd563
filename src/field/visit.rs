//! Views of the parts of trees, for code that writes, draws or translates them.
//!
//! [`Tree::nodes_view`], [`Field::view`], [`Region::steps`] and [`Scalar::steps`] show everything in a tree.
//!
//! ```
//! use rapier3d_fields::field::visit::NodeView;
//! use rapier3d_fields::prelude::*;
//! let tree = Field::uniform(Vector::X).sum_union(Field::point_gravity(4.0).named("sun"));
//! let nodes: Vec<NodeView<'_>> = tree.nodes_view().collect();
//! let NodeView::Field(sun) = &nodes[1] else { panic!("a field") };
//! assert_eq!(sun.view().name, Some("sun"));
//! let NodeView::Operation { operator, operands } = &nodes[2] else { panic!("an operation") };
//! assert_eq!((*operator, *operands), (Operator::SumUnion, &[0, 1][..]));
//! ```

pub use super::over_axes::{OverAxes, Shape as ShapeOverAxes};
pub use super::region::RegionStep;
pub use super::scalar::{Curve, ScalarStep};
pub use super::solid::Solid;
pub use super::solid_shape::SolidShape;

use super::anchor::Anchor;
use super::formula::Formula;
use super::layer::Layer;
use super::leaf::{Coupling, Field, ForceMode};
use super::modifier::Modifier;
use super::nodes::Node;
use super::operator::Operator;
use super::region::Region;
use super::sampling::Sampling;
use super::scalar::Scalar;
use super::tree::Tree;
use crate::math::{InteractionGroups, Real};

/// A node of a tree. Operands are numbers of nodes before it.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum NodeView<'a> {
    /// A leaf.
    Field(&'a Field),
    /// An operator, applied from left to right.
    Operation {
        /// The operator.
        operator: Operator,
        /// The nodes that it combines.
        operands: &'a [u32],
    },
    /// A copy of one prototype at each anchor.
    Instances {
        /// The prototype.
        prototype: u32,
        /// The anchors of the copies.
        anchors: &'a [Anchor],
    },
    /// A composite times a number.
    Scaled {
        /// The composite.
        operand: u32,
        /// The factor.
        scale: &'a Scalar,
        /// The frame in which the scale reads the sample.
        anchor: &'a Anchor,
    },
    /// A composite, shortened if it is too long.
    Limited {
        /// The composite.
        operand: u32,
        /// The greatest length.
        length: Real,
    },
    /// Layers, of falling priority.
    Layers {
        /// The composites of the layers.
        operands: &'a [u32],
        /// For each layer, whether it replaces and whether it stops.
        modes: &'a [Override],
    },
    /// A field that was removed: defined nowhere.
    Removed,
}

pub use super::priority::Override;

/// The parts of a field.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct FieldView<'a> {
    /// Its name.
    pub name: Option<&'a str>,
    /// The set where it is defined.
    pub region: &'a Region,
    /// The function from a sample to a vector.
    pub formula: &'a Formula,
    /// The frame that it moves with.
    pub anchor: &'a Anchor,
    /// The quantity that the vector stands for.
    pub force_mode: ForceMode,
    /// The factor of the vector at each sample.
    pub coupling: &'a Coupling,
    /// A further factor, which depends on the sample.
    pub scale: Option<&'a Scalar>,
    /// The length to which the vector is shortened.
    pub limit: Option<Real>,
    /// The groups of colliders that it acts on; `None` for all colliders.
    pub groups: Option<InteractionGroups>,
    /// True if the opposite force acts on the body that carries it.
    pub reacts: bool,
    /// The points of a body at which it is sampled.
    pub sampling: Sampling,
    /// A setter that was called and does not fit the formula. Such a field is refused.
    pub misfit: Option<&'static str>,
}

impl Tree {
    /// The nodes. Operands are before the operators that use them; the root is the last.
    pub fn nodes_view(&self) -> impl ExactSizeIterator<Item = NodeView<'_>> {
        self.nodes().0.iter().map(|node| match node {
            Node::Leaf(field) => NodeView::Field(field),
            Node::Operation { operator, operands } => NodeView::Operation {
                operator: *operator,
                operands,
            },
            Node::Instances { prototype, anchors } => NodeView::Instances {
                prototype: *prototype,
                anchors,
            },
            Node::Modified {
                operand,
                modifier: Modifier::Scale { scale, anchor },
            } => NodeView::Scaled {
                operand: *operand,
                scale,
                anchor,
            },
            Node::Modified {
                operand,
                modifier: Modifier::Limit(length),
            } => NodeView::Limited {
                operand: *operand,
                length: *length,
            },
            Node::Layers { operands, modes } => NodeView::Layers { operands, modes },
            Node::Vacant => NodeView::Removed,
        })
    }

    /// The name of a node in messages.
    pub fn node_label(&self, node: u32) -> String {
        self.nodes().label(node)
    }
}

impl Field {
    /// The parts that it is made of.
    pub fn view(&self) -> FieldView<'_> {
        FieldView {
            name: self.name.as_deref(),
            region: &self.region,
            formula: &self.formula,
            anchor: &self.anchor,
            force_mode: self.mode,
            coupling: &self.coupling,
            scale: self.scale.as_ref(),
            limit: self.limit,
            groups: self.groups,
            reacts: self.reacts,
            sampling: self.sampling,
            misfit: self.misfit,
        }
    }
}

impl Region {
    /// The steps that it is made of, in postfix order: operands before operations.
    pub fn steps(&self) -> &[RegionStep] {
        &self.steps
    }
}

impl Scalar {
    /// The steps that it is made of, in postfix order: operands before operations.
    pub fn steps(&self) -> &[ScalarStep] {
        &self.steps
    }
}

impl Layer {
    /// Sets both modes at once.
    pub fn mode(mut self, mode: Override) -> Self {
        self.mode = mode;
        self
    }
}
