//! Checks that trees and terms can be compiled.

use std::collections::HashMap;
use std::sync::Arc;

use super::anchor::Anchor;
use super::axis::Axis;
use super::error::{BuildError, not_negative, rigid};
use super::leaf::Field;
use super::modifier::Modifier;
use super::nodes::{Node, Nodes};
use super::operator::Operator;
use super::tree::{DEPTH_LIMIT, SIZE_LIMIT, Tree};
use crate::math::Pose;

/// An error, and the place of the node that it is about.
pub(super) type Misplaced = (BuildError, u32);

impl Tree {
    /// Checks whether fields can be built from the tree if these axes are declared.
    ///
    /// # Errors
    /// The tree is not valid; see [`BuildError`].
    pub fn check(&self, axes: &[&str]) -> Result<(), BuildError> {
        let declared: Vec<Arc<str>> = axes.iter().map(|name| Arc::from(*name)).collect();
        self.validate(&declared)
    }

    /// Checks the tree, and every field in it, against the declared user axes.
    pub(crate) fn validate(&self, declared: &[Arc<str>]) -> Result<(), BuildError> {
        if self.nodes().0.is_empty() {
            return Err(BuildError::Empty);
        }
        self.nodes().extent(&self.downwards()).check()?;
        for term in self.terms() {
            let checked = self.nodes().validate_term(term, declared);
            checked.map_err(|(error, _)| error)?;
        }
        Ok(())
    }
}

/// The size of a subtree.
#[derive(Clone, Copy, Default)]
pub(super) struct TreeExtent {
    /// The number of levels of operators above the deepest field.
    pub depth: usize,
    /// The number of fields that are evaluated: those of a prototype count once for each instance.
    fields: usize,
}

impl TreeExtent {
    fn check(self) -> Result<(), BuildError> {
        let TreeExtent { depth, fields } = self;
        if depth > DEPTH_LIMIT {
            let limit = DEPTH_LIMIT;
            return Err(BuildError::TooDeep { depth, limit });
        }
        if fields > SIZE_LIMIT {
            let limit = SIZE_LIMIT;
            return Err(BuildError::TooLarge { fields, limit });
        }
        Ok(())
    }
}

impl Nodes<'_> {
    /// Checks a term and every field in it.
    pub(super) fn validate_term(self, term: u32, declared: &[Arc<str>]) -> Result<(), Misplaced> {
        let below = match self.get(term) {
            Node::Leaf(_) => vec![term],
            _ => self.below(term),
        };
        if below.len() > 1 {
            let extent = self.extent(&below).check();
            extent.map_err(|error| (error, term))?;
        }
        for place in &below {
            let checked = match self.get(*place) {
                Node::Leaf(field) => self.validate_field(*place, field, declared),
                Node::Modified { modifier, .. } => {
                    self.validate_modifier(*place, modifier, declared)
                }
                Node::Instances { prototype, anchors } => {
                    self.validate_instances(*prototype, anchors)
                }
                _ => Ok(()),
            };
            checked.map_err(|error| (error, *place))?;
        }
        self.validate_reactions(term)?;
        let is_contact = |place: &u32| self.field(*place).is_some_and(Field::is_contact);
        if !below.iter().any(is_contact) {
            return Ok(());
        }
        self.validate_detection_anchors(term)?;
        below
            .iter()
            .try_for_each(|place| self.validate_detection(*place))
    }

    /// Checks a field that was changed, and the parts of its term that depend on it.
    pub(super) fn validate_leaf(
        self,
        place: u32,
        term: u32,
        declared: &[Arc<str>],
    ) -> Result<(), Misplaced> {
        let Some(field) = self.field(place) else {
            return Ok(());
        };
        let checked = self.validate_field(place, field, declared);
        checked.map_err(|error| (error, place))?;
        if place != term || field.reacts {
            self.validate_reactions(term)?;
        }
        if !field.is_contact() {
            return Ok(());
        }
        self.validate_detection_anchors(term)?;
        let mut below = self.below(term).into_iter();
        below.try_for_each(|node| self.validate_detection(node))
    }

    /// The size of the subtree of the first of these nodes. Operands are listed after their users.
    pub(super) fn extent(self, below: &[u32]) -> TreeExtent {
        let mut known: HashMap<u32, TreeExtent> = HashMap::with_capacity(below.len());
        let mut last = TreeExtent::default();
        for place in below.iter().rev() {
            let node = self.get(*place);
            let operands = node.operands().iter().map(|operand| known[operand]);
            let depth = operands.clone().map(|operand| operand.depth + 1).max();
            let sum = operands.fold(0, |sum: usize, operand| sum.saturating_add(operand.fields));
            let fields = match node {
                Node::Leaf(_) => 1,
                Node::Instances { anchors, .. } => sum.saturating_mul(anchors.len()),
                _ => sum,
            };
            last = TreeExtent {
                depth: depth.unwrap_or(0),
                fields,
            };
            known.insert(*place, last);
        }
        last
    }

    fn validate_field(
        self,
        place: u32,
        field: &Field,
        declared: &[Arc<str>],
    ) -> Result<(), BuildError> {
        let label = field.label(place as usize);
        field.validate(&label)?;
        check_axes(field.axes(), &label, declared)
    }

    fn validate_modifier(
        self,
        place: u32,
        modifier: &Modifier,
        declared: &[Arc<str>],
    ) -> Result<(), BuildError> {
        let label = self.label(place);
        match modifier {
            Modifier::Limit(length) => not_negative(&label, "the limit", *length),
            Modifier::Scale { scale, anchor } => {
                rigid(&label, "the pose of the anchor", anchor.local_pose())?;
                scale.validate(&label)?;
                check_axes(scale.axes(), &label, declared)
            }
        }
    }

    /// Errors of instances name the first field of their prototype.
    fn validate_instances(self, prototype: u32, anchors: &[Anchor]) -> Result<(), BuildError> {
        let leaves = self.leaves_below(prototype).into_iter();
        let first = leaves.min().unwrap_or(prototype);
        let label = self.field(first).map(|field| field.label(first as usize));
        let label = label.unwrap_or_default();
        let mut anchors = anchors.iter();
        anchors.try_for_each(|a| rigid(&label, "the pose of an instance", a.local_pose()))
    }

    /// Fields that react need one carrier: one body or collider for each term, or for each instance of it.
    fn validate_reactions(self, term: u32) -> Result<(), Misplaced> {
        let reacts = |leaf: &u32| self.field(*leaf).is_some_and(|field| field.reacts);
        let leaves = self.leaves_below(term);
        let Some(first) = leaves.iter().copied().filter(reacts).min() else {
            return Ok(());
        };
        let one_carrier = match self.get(term) {
            Node::Instances { prototype, anchors } => {
                let mut instances = anchors.iter();
                instances.all(|instance| self.carrier(*prototype, instance).is_some())
            }
            _ => self.carrier(term, &Anchor::WORLD).is_some(),
        };
        if one_carrier && leaves.iter().all(reacts) {
            return Ok(());
        }
        let field = self.label(first).into();
        Err((BuildError::Reaction { field }, first))
    }

    /// The body or collider that all fields of a subtree are anchored to, if there is one.
    fn carrier(self, root: u32, instance: &Anchor) -> Option<Anchor> {
        let mut carrier: Option<Anchor> = None;
        let mut open = vec![(root, *instance)];
        while let Some((node, instance)) = open.pop() {
            match self.get(node) {
                Node::Leaf(field) => {
                    let anchor = field
                        .anchor
                        .within(&instance)
                        .with_local_pose(Pose::IDENTITY);
                    let other = carrier.is_some_and(|known| known != anchor);
                    if other || matches!(anchor, Anchor::World { .. }) {
                        return None;
                    }
                    carrier = Some(anchor);
                }
                Node::Instances { prototype, anchors } => {
                    open.extend(anchors.iter().map(|a| (*prototype, a.within(&instance))));
                }
                inner => open.extend(inner.operands().iter().map(|o| (*o, instance))),
            }
        }
        carrier
    }

    /// Checks that detection fields have a collider: that of their anchor, or in a prototype that of each instance.
    fn validate_detection_anchors(self, term: u32) -> Result<(), Misplaced> {
        let mut open = vec![(term, false)];
        while let Some((node, instances_have)) = open.pop() {
            let has_collider = |anchor: &Anchor| match anchor {
                Anchor::World { .. } => instances_have,
                Anchor::Body { .. } => false,
                Anchor::Collider { .. } => true,
            };
            let all_have = match self.get(node) {
                Node::Leaf(field) if field.is_contact() && !has_collider(&field.anchor) => {
                    let field = field.label(node as usize).into();
                    return Err((BuildError::DetectionAnchor { field }, node));
                }
                Node::Instances { anchors, .. } => anchors.iter().all(has_collider),
                _ => instances_have,
            };
            let operands = self.get(node).operands();
            open.extend(operands.iter().map(|operand| (*operand, all_have)));
        }
        Ok(())
    }

    /// Checks that laws that act on both parts at once are not operands of operators that change or mix vectors, since
    /// they have none. The paper's laws have vectors.
    fn validate_detection(self, place: u32) -> Result<(), Misplaced> {
        use Operator::*;
        let node = self.get(place);
        let operator = match node {
            // The other operators would use the zero vectors of such laws.
            Node::Operation { operator, .. } => match operator {
                SumUnion | SumIntersection | ReplaceUnion | ReplaceIntersection | Difference => {
                    return Ok(());
                }
                _ => operator.symbol(),
            },
            Node::Modified { .. } => "a scale or limit",
            Node::Leaf(field) if field.changes_its_vector() => "a strength, scale or limit",
            _ => return Ok(()),
        };
        for leaf in self.leaves_below(place) {
            if let Some(field) = self.field(leaf).filter(|field| field.answers_pairs()) {
                let error = BuildError::DetectionOperand {
                    field: field.label(leaf as usize).into(),
                    operator,
                };
                return Err((error, leaf));
            }
        }
        Ok(())
    }
}

fn check_axes<'a>(
    named: impl Iterator<Item = &'a Axis>,
    label: &str,
    declared: &[Arc<str>],
) -> Result<(), BuildError> {
    for axis in named {
        if let Axis::User(name) = axis
            && !declared.contains(name)
        {
            let names: Vec<&str> = declared.iter().map(|name| &**name).collect();
            return Err(BuildError::UnknownAxis {
                field: label.into(),
                axis: name.to_string(),
                declared: if names.is_empty() {
                    "none".to_owned()
                } else {
                    names.join(", ")
                },
            });
        }
    }
    Ok(())
}
