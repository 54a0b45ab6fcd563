//! A term of the tree as a postfix program.

use std::sync::Arc;

use crate::field::{Anchor, Field, Frame, Modifier, Node, Nodes, Operator, Override, SamplingRule};
use crate::math::Real;

use super::anchors::NO_ANCHOR;
use super::instances::Instances;

/// One prototype and its instances.
#[derive(Debug)]
pub(crate) struct Program {
    pub steps: Vec<Step>,
    pub leaves: Vec<Field>,
    pub modes: Vec<Arc<[Override]>>,
    pub modifiers: Vec<Modifier>,
    pub instances: Instances,
    /// Of a program of one field, which fields like it may join.
    pub likeness: Option<u64>,
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
    /// Push what is not defined anywhere.
    Nowhere,
    /// Push leaf number n.
    Leaf(u32),
    /// Combine the last n values.
    Apply(Operator, u32),
    /// Change the last value by modifier number n.
    Modify(u32),
    /// Combine the last n values, which are layers; the number of their modes.
    Layers(u32, u32),
}

/// Where leaves and modifiers of a program come from.
#[derive(Default)]
struct Places {
    leaves: Vec<u32>,
    modifiers: Vec<u32>,
}

impl Program {
    /// The strength of a leaf of an instance.
    pub(crate) fn strength(&self, instance: usize, leaf: usize) -> Real {
        let own = self.instances.strengths.get(instance);
        own.copied().unwrap_or(self.leaves[leaf].strength)
    }

    /// The frame of a leaf or modifier of an instance, if it has one.
    pub(crate) fn frame<'a>(
        &self,
        instance: usize,
        anchored: usize,
        frames: &'a [Option<Frame>],
    ) -> Option<&'a Frame> {
        let anchor = self.instances.anchors[instance * self.stride() + anchored];
        let there = anchor != NO_ANCHOR;
        there.then(|| frames[anchor as usize].as_ref()).flatten()
    }

    /// Anchors, and places, per instance.
    pub(crate) fn stride(&self) -> usize {
        self.leaves.len() + self.modifiers.len()
    }

    /// Lowers the subtree at `root`, seen as the prototype of instances that come later; also
    /// returns the place of each leaf and then of each modifier.
    pub(crate) fn lower(nodes: Nodes<'_>, root: u32) -> (Self, Vec<u32>) {
        let mut program = Program {
            steps: Vec::new(),
            leaves: Vec::new(),
            modifiers: Vec::new(),
            modes: Vec::new(),
            instances: Instances::default(),
            likeness: None,
            reach: reach(nodes, root, true),
            how: nodes.how(root),
            has_force: false,
            reacts: false,
        };
        let mut places = Places::default();
        program.push(nodes, root, &Anchor::WORLD, &mut places);
        program.reacts = program.leaves.iter().any(|leaf| leaf.reacts);
        program.has_force = program
            .leaves
            .iter()
            .any(|leaf| leaf.enabled && !leaf.is_contact());
        places.leaves.extend(places.modifiers);
        (program, places.leaves)
    }

    /// The depth of a tree is limited, so recursion is safe.
    fn push(&mut self, nodes: Nodes<'_>, node: u32, instance: &Anchor, places: &mut Places) {
        match nodes.get(node) {
            Node::Leaf(field) => {
                let mut field = (**field).clone();
                field.anchor = field.anchor.within(instance);
                self.steps.push(Step::Leaf(self.leaves.len() as u32));
                self.leaves.push(field);
                places.leaves.push(node);
            }
            Node::Vacant => self.steps.push(Step::Nowhere),
            Node::Operation { operator, operands } => {
                for operand in operands {
                    self.push(nodes, *operand, instance, places);
                }
                self.steps
                    .push(Step::Apply(*operator, operands.len() as u32));
            }
            Node::Modified { operand, modifier } => {
                self.push(nodes, *operand, instance, places);
                self.steps.push(Step::Modify(self.modifiers.len() as u32));
                let mut modifier = modifier.clone();
                if let Modifier::Scale { anchor, .. } = &mut modifier {
                    *anchor = anchor.within(instance);
                }
                self.modifiers.push(modifier);
                places.modifiers.push(node);
            }
            Node::Layers { operands, modes } => {
                for operand in operands {
                    self.push(nodes, *operand, instance, places);
                }
                self.steps
                    .push(Step::Layers(operands.len() as u32, self.modes.len() as u32));
                self.modes.push(modes.clone());
            }
            Node::Instances { prototype, anchors } => {
                for anchor in anchors.iter() {
                    self.push(nodes, *prototype, &anchor.within(instance), places);
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
fn reach(nodes: Nodes<'_>, node: u32, relative: bool) -> Option<Real> {
    match nodes.get(node) {
        Node::Leaf(field) => match field.anchor {
            Anchor::World { local_pose } if relative => {
                let radius = field.region.bounding_radius()?;
                Some(local_pose.translation.length() + radius)
            }
            _ => None,
        },
        Node::Vacant => Some(0.0),
        Node::Operation { operator, operands } => {
            let mut reaches = operands.iter().map(|o| reach(nodes, *o, relative));
            match operator {
                Operator::Difference => reaches.next().flatten(),
                _ if operator.is_intersection() => reaches.flatten().reduce(Real::min),
                _ => most(reaches),
            }
        }
        Node::Modified { .. } | Node::Layers { .. } => {
            let operands = nodes.get(node).operands();
            most(operands.iter().map(|o| reach(nodes, *o, relative)))
        }
        Node::Instances { prototype, anchors } => {
            let below = reach(nodes, *prototype, relative)?;
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
