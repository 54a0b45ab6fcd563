//! Trees with fields as leaves and operators as nodes: composite fields (§3.4, Figure 4).

use std::sync::Arc;

use super::anchor::Anchor;
use super::leaf::Field;
use super::modifier::Modifier;
use super::nodes::{Node, Nodes};
use super::operator::Operator;
use super::scalar::Scalar;
use crate::math::Real;

/// The deepest nesting of operators that is accepted.
pub(crate) const DEPTH_LIMIT: usize = 512;

/// The largest number of fields that is accepted, those of each instance counted.
pub(crate) const SIZE_LIMIT: usize = 10_000_000;

/// A composite field.
///
/// Made from [`Field`]s by the seven operators of the paper's Figure 1 and four more (the tables are
/// at [`Operator`]). Operands may be fields or trees. A tree of one field is that field; the tree
/// of none, [`Tree::empty`], is defined nowhere, and every operator treats it as such.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// // The paper's Figure 3: an attraction outside, a repulsion in its place inside.
/// let pull = Field::radial(-1.0, 0.0).within(Region::ball(5.0));
/// let push = Field::radial(10.0, 0.0).within(Region::ball(1.0));
/// let atom = pull.replace_union(push);
/// ```
#[derive(Clone, Debug, Default)]
#[must_use = "setters and operators take the value and return the changed one"]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(try_from = "super::saved::SavedNodes")
)]
pub struct Tree {
    /// Operands are before the operators that use them; the root is the last node. A flat list, so that neither
    /// deep nesting nor its drop can overflow the call stack.
    pub(super) nodes: Vec<Node>,
}

impl From<Field> for Tree {
    fn from(field: Field) -> Self {
        Tree {
            nodes: vec![Node::Leaf(Box::new(field))],
        }
    }
}

/// Methods of both trees and fields.
macro_rules! operators {
    () => {
        /// U on E−G, V on G−E, U+V on E∩G.
        pub fn sum_union(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::SumUnion, other.into())
        }

        /// U+V, on E∩G.
        pub fn sum_intersection(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::SumIntersection, other.into())
        }

        /// U on E−G, V on G−E, U×V on E∩G.
        pub fn cross_union(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::CrossUnion, other.into())
        }

        /// U×V, on E∩G.
        pub fn cross_intersection(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::CrossIntersection, other.into())
        }

        /// U on E−G, V on G.
        pub fn replace_union(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::ReplaceUnion, other.into())
        }

        /// V, on E∩G.
        pub fn replace_intersection(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::ReplaceIntersection, other.into())
        }

        /// U, on E−G.
        pub fn difference(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::Difference, other.into())
        }

        /// U on E−G, V on G−E, the longer of the two on E∩G.
        pub fn strongest(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::Strongest, other.into())
        }

        /// U on E−G, V on G−E, the shorter of the two on E∩G.
        pub fn weakest(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::Weakest, other.into())
        }

        /// U on E−G, V on G−E, the lesser of each component on E∩G.
        pub fn minimum(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::Minimum, other.into())
        }

        /// U on E−G, V on G−E, the greater of each component on E∩G.
        pub fn maximum(self, other: impl Into<Tree>) -> Tree {
            Tree::combine(self.into(), Operator::Maximum, other.into())
        }

        /// U, on E∩G: the other operand is a mask, whose vector is ignored.
        pub fn masked_by(self, mask: impl Into<Tree>) -> Tree {
            Tree::combine(mask.into(), Operator::ReplaceIntersection, self.into())
        }
    };
}

/// The operators, U being this field on its region E, and V the other operand on its set G.
impl Field {
    operators!();
}

/// The operators, U being this tree on its set E, and V the other operand on its set G.
impl Tree {
    operators!();

    /// The tree that is defined nowhere.
    pub fn empty() -> Self {
        Tree::default()
    }

    /// The operator applied to any number of operands, from left to right. No operand gives the
    /// [empty](Tree::empty) tree, one operand itself.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let lamps = (0..10).map(|i| Field::point_gravity(1.0).at(Vector::X * i as Real));
    /// let tree = Tree::fold(Operator::SumUnion, lamps);
    /// ```
    pub fn fold<T: Into<Tree>>(operator: Operator, operands: impl IntoIterator<Item = T>) -> Self {
        let combined = operands
            .into_iter()
            .map(Into::into)
            .reduce(|left, right| Tree::combine(left, operator, right));
        combined.unwrap_or_default()
    }

    /// The sum of union of one prototype at many anchors.
    ///
    /// In the prototype, the world's frame stands for the frame of the instance, and a [contact](Field::contact)
    /// field touches with the collider of the instance. A thousand instances cost one prototype and a thousand
    /// poses.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// # let world = PhysicsWorld::new();
    /// let atom = Field::radial(-1.0, 0.0)
    ///     .within(Region::ball(5.0))
    ///     .replace_union(Field::radial(10.0, 0.0).within(Region::ball(1.0)));
    /// let atoms = Tree::instances(atom, world.bodies.iter().map(|(handle, _)| handle));
    /// ```
    pub fn instances<A: Into<Anchor>>(
        prototype: impl Into<Tree>,
        anchors: impl IntoIterator<Item = A>,
    ) -> Self {
        let mut tree: Tree = prototype.into();
        let anchors: Arc<[Anchor]> = anchors.into_iter().map(Into::into).collect();
        if tree.nodes.is_empty() || anchors.is_empty() {
            return Tree::empty();
        }
        let prototype = tree.root();
        tree.nodes.push(Node::Instances { prototype, anchors });
        tree
    }

    /// Multiplies the composite force by a number that depends on the sample, in the world's frame or, in the
    /// prototype of [instances](Self::instances), in that of the instance.
    pub fn scaled_by(self, scale: impl Into<Scalar>) -> Self {
        self.scaled_at(scale, Anchor::WORLD)
    }

    /// Like [`scaled_by`](Self::scaled_by), with the sample in another frame.
    pub fn scaled_at(self, scale: impl Into<Scalar>, anchor: impl Into<Anchor>) -> Self {
        self.modified(Modifier::Scale {
            scale: Arc::new(scale.into()),
            anchor: anchor.into(),
        })
    }

    /// Shortens the composite force on a sample to this length where it is longer.
    pub fn limited_to(self, length: Real) -> Self {
        self.modified(Modifier::Limit(length))
    }

    fn modified(mut self, modifier: Modifier) -> Self {
        if !self.nodes.is_empty() {
            let operand = self.root();
            self.nodes.push(Node::Modified { operand, modifier });
        }
        self
    }

    pub(crate) fn combine(mut left: Tree, operator: Operator, mut right: Tree) -> Tree {
        match (left.nodes.is_empty(), right.nodes.is_empty()) {
            (false, false) => {}
            // E ∩ ∅ = ∅ and ∅ − G = ∅; otherwise the operand that is not empty remains.
            (true, _) if operator == Operator::Difference => return left,
            (_, true) if operator == Operator::Difference => return left,
            _ if operator.is_intersection() => return Tree::empty(),
            (true, _) => return right,
            (_, true) => return left,
        }
        let mut operands = left.take_operands(operator);
        let mut others = right.take_operands(operator);
        // Append the shorter list to the longer one, so that long chains stay linear.
        if left.nodes.len() >= right.nodes.len() {
            let offset = left.append(right);
            others.iter_mut().for_each(|operand| *operand += offset);
        } else {
            let offset = right.append(left);
            operands.iter_mut().for_each(|operand| *operand += offset);
            left = right;
        }
        operands.extend(others);
        left.nodes.push(Node::Operation { operator, operands });
        left
    }

    /// The operands that this tree brings into an operation: its own, if it is the same associative operation
    /// already, otherwise itself.
    fn take_operands(&mut self, operator: Operator) -> Vec<u32> {
        if let Some(Node::Operation {
            operator: own,
            operands,
        }) = self.nodes.last_mut()
            && *own == operator
            && operator.is_associative()
        {
            let operands = std::mem::take(operands);
            self.nodes.pop();
            return operands;
        }
        vec![self.root()]
    }

    /// Appends another list of nodes. Returns the number that was added to its numbers.
    pub(super) fn append(&mut self, other: Tree) -> u32 {
        let offset = self.nodes.len() as u32;
        self.nodes.extend(other.nodes.into_iter().map(|mut node| {
            let operands = node.operands_mut().iter_mut();
            operands.for_each(|operand| *operand += offset);
            node
        }));
        offset
    }

    /// The number of fields in the tree; a prototype's count once.
    pub fn field_count(&self) -> usize {
        self.nodes().leaves().count()
    }

    /// The number of levels of operators above the deepest field. Chains of one associative operator count as
    /// one level.
    pub fn depth(&self) -> usize {
        self.nodes().extent(&self.downwards()).depth
    }

    /// All nodes, each before its operands.
    pub(super) fn downwards(&self) -> Vec<u32> {
        (0..self.nodes.len() as u32).rev().collect()
    }

    pub(crate) fn nodes(&self) -> Nodes<'_> {
        Nodes(&self.nodes)
    }

    pub(crate) fn root(&self) -> u32 {
        self.nodes.len() as u32 - 1
    }

    /// The operands of the outermost sum of union: the terms, whose forces add up.
    pub(crate) fn terms(&self) -> Vec<u32> {
        match self.nodes.last() {
            Some(Node::Operation {
                operator: Operator::SumUnion,
                operands,
            }) => operands.clone(),
            Some(_) => vec![self.root()],
            None => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::BuildError;
    use crate::math::Vector;

    fn leaf() -> Field {
        Field::uniform(Vector::X)
    }

    #[test]
    fn chains_of_an_associative_operator_are_one_level() {
        let left = Tree::fold(Operator::SumUnion, (0..100_000).map(|_| leaf()));
        assert_eq!((left.depth(), left.field_count()), (1, 100_000));
        let right = (0..1000).fold(Tree::empty(), |tree, _| leaf().sum_union(tree));
        assert_eq!((right.depth(), right.field_count()), (1, 1000));
    }

    #[test]
    fn a_tree_that_is_too_deep_is_refused() {
        let deep = (0..100_000).fold(Tree::from(leaf()), |tree, _| tree.difference(leaf()));
        assert_eq!(deep.depth(), 100_000);
        assert_eq!(
            deep.validate(&[]),
            Err(BuildError::TooDeep {
                depth: 100_000,
                limit: DEPTH_LIMIT
            })
        );
    }

    #[test]
    fn instances_within_instances_are_counted_before_they_are_made() {
        let two = [Vector::X, Vector::Y];
        let nested = (0..100).fold(Tree::from(leaf()), |tree, _| Tree::instances(tree, two));
        let error = nested.validate(&[]).unwrap_err();
        assert!(matches!(error, BuildError::TooLarge { .. }), "{error}");
    }

    #[test]
    fn setters_that_do_not_fit_are_refused() {
        for field in [leaf().softened(1.0), leaf().shifted_to_zero_at(1.0)] {
            let error = Tree::from(field).validate(&[]).unwrap_err();
            assert!(matches!(error, BuildError::Misfit { .. }), "{error}");
        }
    }

    #[test]
    fn the_empty_tree_is_the_empty_set() {
        for operator in Operator::ALL {
            let with_nothing = |tree: Tree| tree.field_count();
            let right = Tree::combine(leaf().into(), operator, Tree::empty());
            let left = Tree::combine(Tree::empty(), operator, leaf().into());
            let keeps_left = !operator.is_intersection();
            let keeps_right = keeps_left && operator != Operator::Difference;
            assert_eq!(with_nothing(right), usize::from(keeps_left), "{operator}");
            assert_eq!(with_nothing(left), usize::from(keeps_right), "{operator}");
        }
        assert_eq!(Tree::empty().validate(&[]), Err(BuildError::Empty));
    }

    #[test]
    fn operands_keep_their_order_whichever_list_is_longer() {
        let named = |name: &str| leaf().named(name);
        let short = named("a").replace_union(named("b"));
        let long = Tree::fold(Operator::ReplaceUnion, ["c", "d", "e", "f"].map(named));
        let tree = short.replace_union(long);
        let Some(Node::Operation { operands, .. }) = tree.nodes().0.last() else {
            panic!("an operation")
        };
        let names: Vec<&str> = operands
            .iter()
            .map(|o| {
                tree.nodes()
                    .field(*o)
                    .and_then(|f| f.name.as_deref())
                    .unwrap()
            })
            .collect();
        assert_eq!(names, ["a", "b", "c", "d", "e", "f"]);
    }
}
