//! What a tree must be like to be compiled.

use std::sync::Arc;

use super::anchor::Anchor;
use super::axis::Axis;
use super::error::{TreeError, not_negative, rigid};
use super::modifier::Modifier;
use super::operator::Operator;
use super::tree::{DEPTH_LIMIT, Node, SIZE_LIMIT, Tree};
use crate::math::Pose;

impl Tree {
    /// Whether fields can be built from it, where these axes are declared; nothing is built.
    ///
    /// # Errors
    /// It cannot.
    pub fn check(&self, axes: &[&str]) -> Result<(), TreeError> {
        let declared: Vec<Arc<str>> = axes.iter().map(|name| Arc::from(*name)).collect();
        self.validate(&declared)
    }

    /// Checks the tree, and every field in it, against the declared user axes.
    pub(crate) fn validate(&self, declared: &[Arc<str>]) -> Result<(), TreeError> {
        if self.nodes().is_empty() {
            return Err(TreeError::Empty);
        }
        let depth = self.depth();
        if depth > DEPTH_LIMIT {
            let limit = DEPTH_LIMIT;
            return Err(TreeError::TooDeep { depth, limit });
        }
        let fields = self.expanded_count();
        if fields > SIZE_LIMIT {
            let limit = SIZE_LIMIT;
            return Err(TreeError::TooLarge { fields, limit });
        }
        for (place, field) in self.leaves() {
            let label = field.label(place);
            field.validate(&label)?;
            check_axes(field.axes(), &label, declared)?;
        }
        self.validate_modifiers(declared)?;
        self.validate_instances()?;
        self.validate_reactions()?;
        self.validate_detection()
    }

    fn validate_modifiers(&self, declared: &[Arc<str>]) -> Result<(), TreeError> {
        for (place, node) in self.nodes().iter().enumerate() {
            let Node::Modified { modifier, .. } = node else {
                continue;
            };
            let label = self.label(place as u32);
            match modifier {
                Modifier::Limit(length) => not_negative(&label, "the limit", *length)?,
                Modifier::Scale { scale, anchor } => {
                    rigid(&label, "the pose of the anchor", anchor.local_pose())?;
                    scale.validate(&label)?;
                    check_axes(scale.axes(), &label, declared)?;
                }
            }
        }
        Ok(())
    }

    /// Instances are to blame on the first field of their prototype.
    fn validate_instances(&self) -> Result<(), TreeError> {
        for node in self.nodes() {
            let Node::Instances { prototype, anchors } = node else {
                continue;
            };
            let leaves = self.leaves_below(*prototype).into_iter();
            let first = leaves.min().unwrap_or(*prototype);
            let label = self.field(first).map(|field| field.label(first as usize));
            let label = label.unwrap_or_default();
            for anchor in anchors.iter() {
                rigid(&label, "the pose of an instance", anchor.local_pose())?;
            }
        }
        Ok(())
    }

    /// What reacts must know on whom: one body or collider for each term, or each instance of it.
    fn validate_reactions(&self) -> Result<(), TreeError> {
        let reacts = |leaf: &u32| self.field(*leaf).is_some_and(|field| field.reacts);
        for term in self.terms() {
            let leaves = self.leaves_below(term);
            let Some(first) = leaves.iter().copied().filter(reacts).min() else {
                continue;
            };
            let one_carrier = match &self.nodes()[term as usize] {
                Node::Instances { prototype, anchors } => {
                    let mut instances = anchors.iter();
                    instances.all(|instance| self.carrier(*prototype, instance).is_some())
                }
                _ => self.carrier(term, &Anchor::WORLD).is_some(),
            };
            if !one_carrier || !leaves.iter().all(reacts) {
                let field = self.label(first);
                return Err(TreeError::Reaction { field });
            }
        }
        Ok(())
    }

    /// The anchor that all fields of a subtree hang on, if it is one body or collider.
    fn carrier(&self, root: u32, instance: &Anchor) -> Option<Anchor> {
        let mut carrier: Option<Anchor> = None;
        let mut open = vec![(root, *instance)];
        while let Some((node, instance)) = open.pop() {
            match &self.nodes()[node as usize] {
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

    /// A detection field's vector is no force, so operators that mix vectors cannot take it.
    fn validate_detection(&self) -> Result<(), TreeError> {
        for node in self.nodes() {
            use Operator::*;
            let operator = match node {
                // What compares or mixes vectors would see its zeros.
                Node::Operation { operator, .. } => match operator {
                    SumUnion | SumIntersection | ReplaceUnion | ReplaceIntersection
                    | Difference => {
                        continue;
                    }
                    _ => operator.symbol(),
                },
                Node::Modified { .. } => "a scale or limit",
                Node::Layers { .. } => "layers",
                Node::Leaf(_) | Node::Instances { .. } => continue,
            };
            let leaves = node.operands().iter().flat_map(|o| self.leaves_below(*o));
            for leaf in leaves {
                if let Some(field) = self.field(leaf).filter(|field| field.is_contact()) {
                    return Err(TreeError::DetectionOperand {
                        field: field.label(leaf as usize),
                        operator,
                    });
                }
            }
        }
        Ok(())
    }
}

fn check_axes<'a>(
    named: impl Iterator<Item = &'a Axis>,
    label: &str,
    declared: &[Arc<str>],
) -> Result<(), TreeError> {
    for axis in named {
        if let Axis::User(name) = axis
            && !declared.contains(name)
        {
            let names: Vec<&str> = declared.iter().map(|name| &**name).collect();
            return Err(TreeError::UnknownAxis {
                field: label.to_owned(),
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
