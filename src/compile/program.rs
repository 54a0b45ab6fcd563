//! A term of the tree as a postfix program.

use crate::field::{Anchor, Field, Node, Operator, Tree};
use crate::math::Real;

use super::AnchorId;

/// One prototype and its instances.
#[derive(Debug)]
pub(crate) struct Program {
    pub steps: Vec<Step>,
    pub leaves: Vec<Field>,
    /// The place in the tree of each leaf of each instance, for messages.
    pub places: Vec<u32>,
    /// The anchor of each leaf of each instance: `leaves.len()` of them per instance.
    pub anchors: Vec<AnchorId>,
    /// The anchor of each instance, around which `reach` is measured.
    pub centres: Vec<AnchorId>,
    /// No instance acts farther than this from its anchor.
    pub reach: Option<Real>,
    /// Sampled once per body, at its centre of mass.
    pub at_centre: bool,
    /// Whether any leaf can give a force; otherwise the program only guards detection fields.
    pub has_force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// Push leaf number n.
    Leaf(u32),
    /// Combine the last n values.
    Apply(Operator, u32),
}

impl Program {
    /// Lowers the subtree at `root`, seen as the prototype of instances that come later; also
    /// returns the place of each leaf.
    pub(crate) fn lower(tree: &Tree, root: u32) -> (Self, Vec<u32>) {
        let mut program = Program {
            steps: Vec::new(),
            leaves: Vec::new(),
            places: Vec::new(),
            anchors: Vec::new(),
            centres: Vec::new(),
            reach: reach(tree, root, true),
            at_centre: tree.acts_at_centre(root),
            has_force: false,
        };
        program.push(tree, root, &Anchor::WORLD);
        program.has_force = program.leaves.iter().any(|leaf| !leaf.is_contact());
        let places = std::mem::take(&mut program.places);
        (program, places)
    }

    /// The depth of a tree is limited, so recursion is safe.
    fn push(&mut self, tree: &Tree, node: u32, instance: &Anchor) {
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
                    self.push(tree, *operand, instance);
                }
                self.steps
                    .push(Step::Apply(*operator, operands.len() as u32));
            }
            Node::Instances { prototype, anchors } => {
                for anchor in anchors.iter() {
                    self.push(tree, *prototype, &anchor.within(instance));
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
                _ => reaches.try_fold(0.0, |most: Real, reach| Some(most.max(reach?))),
            }
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
