//! A term of the tree as a postfix program.

use std::sync::Arc;

use crate::field::{Anchor, Field, Modifier, Node, Operator, Override, SamplingRule, Tree};
use crate::math::Real;

use super::AnchorId;

/// One prototype and its instances.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    pub steps: Vec<Step>,
    pub leaves: Vec<Field>,
    pub modes: Vec<Arc<[Override]>>,
    /// The place in the tree of whatever has an anchor, for messages; as `anchors`.
    pub places: Vec<u32>,
    pub modifiers: Vec<Modifier>,
    /// The anchor of each leaf, then of each modifier (or [`NO_ANCHOR`]), of each instance:
    /// [`Program::stride`] of them per instance.
    pub anchors: Vec<AnchorId>,
    /// The anchor of each instance, around which `reach` is measured.
    pub centres: Vec<AnchorId>,
    /// No instance acts farther than this from its anchor.
    pub reach: Option<Real>,
    pub how: SamplingRule,
    /// Whether the opposite force acts on the body that carries the fields.
    pub reacts: bool,
    /// Whether any leaf can give a force; otherwise the program only masks detection fields.
    pub has_force: bool,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// Push leaf number n.
    Leaf(u32),
    /// Combine the last n values.
    Apply(Operator, u32),
    /// Change the last value by modifier number n.
    Modify(u32),
    /// Combine the last n values, which are layers; the number of their modes.
    Layers(u32, u32),
}

/// In place of the anchor of a modifier that has none.
pub(crate) const NO_ANCHOR: AnchorId = AnchorId::MAX;

impl Program {
    /// Anchors, and places, per instance.
    pub(crate) fn stride(&self) -> usize {
        self.leaves.len() + self.modifiers.len()
    }

    /// Lowers the subtree at `root`, seen as the prototype of instances that come later; also
    /// returns the place of each leaf and then of each modifier.
    pub(crate) fn lower(tree: &Tree, root: u32) -> (Self, Vec<u32>) {
        let mut program = Program {
            steps: Vec::new(),
            leaves: Vec::new(),
            modifiers: Vec::new(),
            modes: Vec::new(),
            places: Vec::new(),
            anchors: Vec::new(),
            centres: Vec::new(),
            reach: reach(tree, root, true),
            how: tree.how(root),
            has_force: false,
            reacts: false,
        };
        let mut modifier_places = Vec::new();
        program.push(tree, root, &Anchor::WORLD, &mut modifier_places);
        program.reacts = program.leaves.iter().any(|leaf| leaf.reacts);
        program.has_force = program.leaves.iter().any(|leaf| !leaf.is_contact());
        let mut places = std::mem::take(&mut program.places);
        places.extend(modifier_places);
        (program, places)
    }

    /// The depth of a tree is limited, so recursion is safe.
    fn push(&mut self, tree: &Tree, node: u32, instance: &Anchor, modifier_places: &mut Vec<u32>) {
        match &tree.nodes()[node as usize] {
            Node::Leaf(field) => {
                let mut field = (**field).clone();
                field.anchor = field.anchor.within(instance);
                self.steps.push(Step::Leaf(self.leaves.len() as u32));
                self.leaves.push(field);
                self.places.push(node);
            }
            Node::Operation { operator, operands } => {
                for operand in operands {
                    self.push(tree, *operand, instance, modifier_places);
                }
                self.steps
                    .push(Step::Apply(*operator, operands.len() as u32));
            }
            Node::Modified { operand, modifier } => {
                self.push(tree, *operand, instance, modifier_places);
                self.steps.push(Step::Modify(self.modifiers.len() as u32));
                let mut modifier = modifier.clone();
                if let Modifier::Scale { anchor, .. } = &mut modifier {
                    *anchor = anchor.within(instance);
                }
                self.modifiers.push(modifier);
                modifier_places.push(node);
            }
            Node::Layers { operands, modes } => {
                for operand in operands {
                    self.push(tree, *operand, instance, modifier_places);
                }
                self.steps
                    .push(Step::Layers(operands.len() as u32, self.modes.len() as u32));
                self.modes.push(modes.clone());
            }
            Node::Instances { prototype, anchors } => {
                for anchor in anchors.iter() {
                    self.push(tree, *prototype, &anchor.within(instance), modifier_places);
                }
                let count = anchors.len() as u32;
                self.steps.push(Step::Apply(Operator::SumUnion, count));
            }
        }
    }
}

/// How far from the instance's anchor the subtree can act, if that is bounded.
///
/// Fields anchored elsewhere than to the instance (`relative` says whether world anchors mean
/// the instance) make it unbounded.
fn reach(tree: &Tree, node: u32, relative: bool) -> Option<Real> {
    match &tree.nodes()[node as usize] {
        Node::Leaf(field) => match field.anchor {
            Anchor::World { local_pose } if relative => {
                let radius = field.region.bounding_radius()?;
                Some(local_pose.translation.length() + radius)
            }
            _ => None,
        },
        Node::Operation { operator, operands } => {
            let mut reaches = operands.iter().map(|o| reach(tree, *o, relative));
            match operator {
                Operator::Difference => reaches.next().flatten(),
                _ if operator.is_intersection() => reaches.flatten().reduce(Real::min),
                _ => most(reaches),
            }
        }
        Node::Modified { .. } | Node::Layers { .. } => {
            let operands = tree.nodes()[node as usize].operands();
            most(operands.iter().map(|o| reach(tree, *o, relative)))
        }
        Node::Instances { prototype, anchors } => {
            let below = reach(tree, *prototype, relative)?;
            anchors
                .iter()
                .try_fold(0.0, |most: Real, anchor| match anchor {
                    Anchor::World { local_pose } => {
                        Some(most.max(local_pose.translation.length() + below))
                    }
                    _ => None,
                })
        }
    }
}

/// The largest, if all are bounded.
fn most(mut reaches: impl Iterator<Item = Option<Real>>) -> Option<Real> {
    reaches.try_fold(0.0, |most: Real, reach| Some(most.max(reach?)))
}
