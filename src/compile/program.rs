//! A term of the tree as a postfix program with instances.

use std::hash::{Hash, Hasher};
use std::sync::Arc;

use crate::field::{
    Anchor, Field, FieldSet, Fingerprint, Frame, Modifier, Node, Nodes, Operator, Override,
    SamplingRule,
};
use crate::math::{Real, to_f64};

use super::anchors::NO_ANCHOR;
use super::instances::Instances;

/// A prototype, lowered to postfix steps, and its instances.
#[derive(Debug)]
pub(crate) struct Program {
    pub steps: Vec<Instruction>,
    pub leaves: Vec<Field>,
    pub modes: Vec<Arc<[Override]>>,
    pub modifiers: Vec<Modifier>,
    pub instances: Instances,
    /// A hash: equal for programs that are alike, and rarely equal for others.
    pub dedup_key: u64,
    /// No instance acts farther than this from its centre; `None` if there is no such bound.
    pub reach: Option<Real>,
    pub sampling_rule: SamplingRule,
    /// True if the opposite force acts on the body that carries the fields.
    pub reacts: bool,
    /// True if any leaf can give a force; otherwise the program only masks detection fields.
    pub has_force: bool,
    /// True if it can be evaluated on several samples at once.
    pub in_lanes: bool,
    /// True if its forces depend on the velocity of the sample.
    pub reads_velocity: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Instruction {
    /// Push a value that is not defined anywhere.
    Nowhere,
    /// Push leaf number n.
    Leaf(u32),
    /// Combine the last two values.
    Apply(Operator),
    /// Combine the last value with leaf number n.
    Join(Operator, u32),
    /// Change the last value by modifier number n.
    Modify(u32),
    /// Combine the last n values, which are layers, by the modes of this number.
    Layers(u32, u32),
}

/// The places in the set of a program's leaves and modifiers.
#[derive(Default)]
struct SourceNodes {
    leaves: Vec<u32>,
    modifiers: Vec<u32>,
}

impl Program {
    /// Returns true if any force depends on the volume of the sampled part.
    pub(crate) fn displaces(&self) -> bool {
        let mut formulas = self.leaves.iter().map(|leaf| &leaf.formula);
        self.has_force && formulas.any(|formula| formula.reads_volume())
    }

    /// The strength of a leaf in an instance.
    pub(crate) fn strength(&self, instance: usize, leaf: usize) -> Real {
        let own = self.instances.strengths.get(instance);
        own.copied().unwrap_or(self.leaves[leaf].strength)
    }

    /// The frame of a leaf or modifier in an instance; `None` without an anchor, or if its carrier is gone.
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

    /// The number of anchors, and of places, of one instance.
    pub(crate) fn stride(&self) -> usize {
        self.leaves.len() + self.modifiers.len()
    }

    /// Lowers the subtree at `root` as a prototype, without instances. Also returns the places of its leaves
    /// and then of its modifiers.
    pub(crate) fn lower(nodes: Nodes<'_>, root: u32) -> (Self, Vec<u32>) {
        let mut program = Program {
            steps: Vec::new(),
            leaves: Vec::new(),
            modifiers: Vec::new(),
            modes: Vec::new(),
            instances: Instances::default(),
            dedup_key: 0,
            reach: None,
            sampling_rule: nodes.sampling_rule(root),
            has_force: false,
            reacts: false,
            in_lanes: false,
            reads_velocity: false,
        };
        let mut places = SourceNodes::default();
        program.push(nodes, root, &Anchor::WORLD, &mut places);
        program.reacts = program.leaves.iter().any(|leaf| leaf.reacts);
        program.has_force = program
            .leaves
            .iter()
            .any(|leaf| leaf.enabled && !leaf.is_contact());
        program.in_lanes = program.leaves.iter().all(Field::knows_several)
            && program.modifiers.iter().all(Modifier::knows_several);
        program.reads_velocity = program.leaves.iter().any(Field::reads_velocity)
            || program.modifiers.iter().any(Modifier::reads_velocity);
        places.leaves.extend(places.modifiers);
        (program, places.leaves)
    }

    /// Sets its reach and its deduplication key. The reach is measured from `centre`, or else from the anchor of the first
    /// field.
    pub(crate) fn about(mut self, centre: Option<Anchor>, nodes: Nodes<'_>, root: u32) -> Self {
        let first = self.leaves.first().map(|leaf| leaf.anchor);
        let centre = centre.or(first).unwrap_or_default();
        self.reach = reach(nodes, root, &centre).map(rounded_up);
        self.dedup_key = self.print();
        self
    }

    /// Returns true if the program is one field that no operator or modifier changes.
    pub(super) fn is_one_field(&self) -> bool {
        matches!(self.steps[..], [Instruction::Leaf(_)])
    }

    /// Returns true if instances of one program could be instances of the other: they differ at most in names,
    /// anchors, and the strength of a single field.
    pub(super) fn is_like(&self, other: &Program) -> bool {
        let alone = self.is_one_field();
        let like = |(a, b)| are_alike(a, b, alone);
        let changes = |(a, b): (&Modifier, &Modifier)| a.is_like(b);
        self.steps == other.steps
            && self.leaves.len() == other.leaves.len()
            && self.modifiers.len() == other.modifiers.len()
            && self.sampling_rule == other.sampling_rule
            && self.reach == other.reach
            && self.modes == other.modes
            && self.leaves.iter().zip(&other.leaves).all(like)
            && self.modifiers.iter().zip(&other.modifiers).all(changes)
    }

    /// Replaces each leaf by the field of the first instance if the two are alike: they may still differ in the sign of
    /// a zero. A field that was edited, and whose term is not compiled again yet, is not alike.
    pub(super) fn follow_first(&mut self, set: &FieldSet) {
        let alone = self.is_one_field();
        for (leaf, place) in self.leaves.iter_mut().zip(&self.instances.places) {
            if let Some(field) = set.field(*place).filter(|it| are_alike(it, leaf, alone)) {
                let anchor = leaf.anchor;
                *leaf = field.clone();
                leaf.anchor = anchor;
            }
        }
    }

    fn print(&self) -> u64 {
        let mut print = Fingerprint::default();
        let alone = self.is_one_field();
        self.steps.hash(&mut print);
        for leaf in &self.leaves {
            print.write_u64(leaf.dedup_key());
            if !alone {
                print.write_u64(to_f64(leaf.strength + 0.0).to_bits());
            }
        }
        print.write_u64(to_f64(self.reach.unwrap_or(-1.0)).to_bits());
        print.finish()
    }

    /// Appends the steps of a subtree. Recursion is safe, since the depth of a tree is limited.
    fn push(&mut self, nodes: Nodes<'_>, node: u32, instance: &Anchor, places: &mut SourceNodes) {
        match nodes.get(node) {
            Node::Leaf(field) => {
                let mut field = (**field).clone();
                field.anchor = field.anchor.within(instance);
                self.steps.push(Instruction::Leaf(self.leaves.len() as u32));
                self.leaves.push(field);
                places.leaves.push(node);
            }
            Node::Vacant => self.steps.push(Instruction::Nowhere),
            Node::Operation { operator, operands } => {
                for (number, operand) in operands.iter().enumerate() {
                    self.push(nodes, *operand, instance, places);
                    self.combine(number, *operator);
                }
            }
            Node::Modified { operand, modifier } => {
                self.push(nodes, *operand, instance, places);
                self.steps
                    .push(Instruction::Modify(self.modifiers.len() as u32));
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
                self.steps.push(Instruction::Layers(
                    operands.len() as u32,
                    self.modes.len() as u32,
                ));
                self.modes.push(modes.clone());
            }
            Node::Instances { prototype, anchors } => {
                for (number, anchor) in anchors.iter().enumerate() {
                    self.push(nodes, *prototype, &anchor.within(instance), places);
                    self.combine(number, Operator::SumUnion);
                }
            }
        }
    }

    /// Appends the step that combines the operand of this number with those before it.
    fn combine(&mut self, number: usize, operator: Operator) {
        if number == 0 {
            return;
        }
        let step = match self
            .steps
            .pop_if(|last| matches!(last, Instruction::Leaf(_)))
        {
            Some(Instruction::Leaf(leaf)) => Instruction::Join(operator, leaf),
            _ => Instruction::Apply(operator),
        };
        self.steps.push(step);
    }
}

/// Rounds a reach up a little, so that reaches that differ by rounding errors become equal.
fn rounded_up(reach: Real) -> Real {
    const DIGITS: Real = 1024.0;
    let more = reach * (1.0 + 0.5 / DIGITS);
    let step = more.log2().floor().exp2() / DIGITS;
    let rounded = (more / step).ceil() * step;
    if rounded >= reach { rounded } else { reach }
}

/// A bound of the distance from the centre at which the subtree can act; `None` if there is none.
///
/// Fields that are anchored to another body or collider than the centre make the reach unbounded.
fn reach(nodes: Nodes<'_>, node: u32, centre: &Anchor) -> Option<Real> {
    match nodes.get(node) {
        Node::Leaf(field) => {
            let distance = centre.distance_to(&field.anchor)?;
            Some(distance + field.region.bounding_radius()?)
        }
        Node::Vacant => Some(0.0),
        Node::Operation { operator, operands } => {
            let mut reaches = operands.iter().map(|o| reach(nodes, *o, centre));
            match operator {
                Operator::Difference => reaches.next().flatten(),
                _ if operator.is_intersection() => reaches.flatten().reduce(Real::min),
                _ => most(reaches),
            }
        }
        Node::Modified { .. } | Node::Layers { .. } => {
            let operands = nodes.get(node).operands();
            most(operands.iter().map(|o| reach(nodes, *o, centre)))
        }
        Node::Instances { prototype, anchors } => {
            let below = reach(nodes, *prototype, &Anchor::WORLD)?;
            most(
                anchors
                    .iter()
                    .map(|anchor| Some(centre.distance_to(anchor)? + below)),
            )
        }
    }
}

/// The largest reach, if all are bounded.
fn most(mut reaches: impl Iterator<Item = Option<Real>>) -> Option<Real> {
    reaches.try_fold(0.0, |most: Real, reach| Some(most.max(reach?)))
}

/// Returns true if fields may be leaves of instances of one program; `alone` is true if the program is one field,
/// whose strength may differ between instances.
fn are_alike(a: &Field, b: &Field, alone: bool) -> bool {
    a.enabled == b.enabled && (alone || a.strength == b.strength) && a.is_like(b)
}
