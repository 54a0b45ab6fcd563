//! The nodes of trees in a flat list, and queries on it.

use std::sync::Arc;

use super::anchor::Anchor;
use super::axis::Axis;
use super::leaf::Field;
use super::modifier::Modifier;
use super::operator::Operator;
use super::priority::Override;
use super::sampling::SamplingRule;
use super::scalar::Scalar;

#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) enum Node {
    Leaf(Box<Field>),
    Operation {
        operator: Operator,
        operands: Vec<u32>,
    },
    Instances {
        prototype: u32,
        anchors: Arc<[Anchor]>,
    },
    Modified {
        operand: u32,
        modifier: Modifier,
    },
    /// Operands of falling priority.
    Layers {
        operands: Vec<u32>,
        modes: Arc<[Override]>,
    },
    /// The place of a field that was removed: defined nowhere.
    Vacant,
}

impl Node {
    /// Returns true if the number of its operands is valid.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn is_whole(&self) -> bool {
        let count = self.operands().len();
        match self {
            Node::Leaf(_) | Node::Modified { .. } | Node::Vacant => true,
            Node::Operation { operator, .. } if operator.is_associative() => count >= 2,
            Node::Operation { .. } => count == 2,
            Node::Instances { anchors, .. } => !anchors.is_empty(),
            Node::Layers { modes, .. } => !modes.is_empty() && modes.len() == count,
        }
    }

    /// The nodes it combines.
    pub(crate) fn operands(&self) -> &[u32] {
        match self {
            Node::Leaf(_) | Node::Vacant => &[],
            Node::Operation { operands, .. } | Node::Layers { operands, .. } => operands,
            Node::Instances {
                prototype: operand, ..
            }
            | Node::Modified { operand, .. } => std::slice::from_ref(operand),
        }
    }

    pub(super) fn operands_mut(&mut self) -> &mut [u32] {
        match self {
            Node::Leaf(_) | Node::Vacant => &mut [],
            Node::Operation { operands, .. } | Node::Layers { operands, .. } => operands,
            Node::Instances {
                prototype: operand, ..
            }
            | Node::Modified { operand, .. } => std::slice::from_mut(operand),
        }
    }
}

/// A list of nodes that refer to each other by their places in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nodes<'a>(pub &'a [Node]);

impl<'a> Nodes<'a> {
    pub(crate) fn get(self, place: u32) -> &'a Node {
        self.0.get(place as usize).unwrap_or(&Node::Vacant)
    }

    /// The fields, each with its place.
    pub(crate) fn leaves(self) -> impl Iterator<Item = (usize, &'a Field)> {
        let nodes = self.0.iter().enumerate();
        nodes.filter_map(|(place, node)| match node {
            Node::Leaf(field) => Some((place, &**field)),
            _ => None,
        })
    }

    /// The fields at and below a node, from the last to the first.
    pub(crate) fn leaves_below(self, node: u32) -> Vec<u32> {
        let nodes = self.postorder(node).into_iter().rev();
        nodes.filter(|node| self.field(*node).is_some()).collect()
    }

    pub(crate) fn field(self, node: u32) -> Option<&'a Field> {
        match self.get(node) {
            Node::Leaf(field) => Some(field),
            _ => None,
        }
    }

    /// The name of the field or operation at a place, for messages.
    pub(crate) fn label(self, place: u32) -> String {
        match self.get(place) {
            Node::Leaf(field) => field.label(place as usize),
            Node::Operation { operator, .. } => format!("operation #{place} ({operator})"),
            Node::Instances { .. } => format!("instances #{place}"),
            Node::Modified { .. } => format!("scale or limit #{place}"),
            Node::Layers { .. } => format!("layers #{place}"),
            Node::Vacant => format!("field #{place} (removed)"),
        }
    }

    /// The scale at a node; `None` for nodes of other kinds.
    pub(crate) fn scale(self, node: u32) -> Option<&'a Scalar> {
        match self.get(node) {
            Node::Modified {
                modifier: Modifier::Scale { scale, .. },
                ..
            } => Some(scale),
            _ => None,
        }
    }

    /// The nodes at and below a node.
    pub(crate) fn below(self, node: u32) -> Vec<u32> {
        let (mut found, mut next) = (vec![node], 0);
        while let Some(node) = found.get(next) {
            next += 1;
            found.extend(self.get(*node).operands());
        }
        found
    }

    /// The sampling rule of a term.
    pub(crate) fn sampling_rule(self, term: u32) -> SamplingRule {
        let below = self.below(term);
        let scales = below.iter().filter_map(|node| self.scale(*node));
        let fields = below.iter().filter_map(|node| self.field(*node));
        let mut rule = SamplingRule::of_term(fields, scales);
        // Operators and limits are not linear.
        let is_plain =
            |node: &u32| matches!(self.get(*node), Node::Leaf(_) | Node::Instances { .. });
        rule.linear &= below.iter().all(is_plain);
        rule
    }

    /// The anchors of a node, or of its instances.
    pub(crate) fn anchors_at(self, node: u32) -> &'a [Anchor] {
        match self.get(node) {
            Node::Leaf(field) => std::slice::from_ref(&field.anchor),
            Node::Instances { anchors, .. } => anchors,
            Node::Modified {
                modifier: Modifier::Scale { anchor, .. },
                ..
            } => std::slice::from_ref(anchor),
            _ => &[],
        }
    }

    /// The axes that the field or scale at a node names.
    pub(crate) fn axes_at(self, node: u32) -> impl Iterator<Item = &'a Axis> {
        let of_field = self.field(node).into_iter().flat_map(Field::axes);
        let of_scale = self.scale(node).into_iter().flat_map(Scalar::axes);
        of_field.chain(of_scale)
    }

    /// The nodes at and below a node, with operands before their users, in the order of operands.
    pub(crate) fn postorder(self, root: u32) -> Vec<u32> {
        let (mut found, mut open) = (Vec::new(), vec![root]);
        // In reverse first: each node before its operands, and these from the last to the first.
        while let Some(node) = open.pop() {
            found.push(node);
            open.extend(self.get(node).operands());
        }
        found.reverse();
        found
    }
}
