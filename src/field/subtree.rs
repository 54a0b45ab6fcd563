//! Copies a part of a tree as a tree of its own.

use std::collections::HashMap;

use super::nodes::{Node, Nodes};
use super::operator::Operator;
use super::tree::Tree;

impl Nodes<'_> {
    /// The nodes at and below a node as a tree of its own. Fields that were removed count as empty sets.
    pub(super) fn subtree(self, root: u32) -> Tree {
        let mut nodes: Vec<Node> = Vec::new();
        let mut place_of: HashMap<u32, Option<u32>> = HashMap::new();
        for place in self.postorder(root) {
            let kept = match self.get(place) {
                Node::Vacant => None,
                node => with_operands(node, |operand| place_of[&operand], &mut nodes),
            };
            place_of.insert(place, kept);
        }
        // Operands of operations that became empty may be left over, before the root or behind it.
        match place_of[&root] {
            Some(root) if Nodes(&nodes).postorder(root).len() == nodes.len() => Tree { nodes },
            Some(root) => Nodes(&nodes).subtree(root),
            None => Tree::empty(),
        }
    }
}

/// Adds a node whose operands have moved or were removed. Returns its place; `None` if it is defined nowhere.
fn with_operands(
    node: &Node,
    place_of: impl Fn(u32) -> Option<u32>,
    nodes: &mut Vec<Node>,
) -> Option<u32> {
    let mut node = node.clone();
    let found: Vec<Option<u32>> = node.operands().iter().map(|o| place_of(*o)).collect();
    let there: Vec<u32> = found.iter().flatten().copied().collect();
    match &mut node {
        Node::Leaf(_) => {}
        Node::Operation { operator, operands } => {
            let first_is_gone = found.first().is_none_or(Option::is_none);
            let none_left = match operator {
                Operator::Difference => first_is_gone,
                operator if operator.is_intersection() => there.len() < found.len(),
                _ => there.is_empty(),
            };
            if none_left {
                return None;
            }
            if let [only] = there[..] {
                return Some(only);
            }
            *operands = there;
        }
        Node::Layers { operands, modes } => {
            let kept = modes
                .iter()
                .zip(&found)
                .filter(|(_, found)| found.is_some());
            *modes = kept.map(|(mode, _)| *mode).collect();
            if there.is_empty() {
                return None;
            }
            *operands = there;
        }
        Node::Modified { operand, .. }
        | Node::Instances {
            prototype: operand, ..
        } => *operand = *there.first()?,
        Node::Vacant => return None,
    }
    nodes.push(node);
    Some(nodes.len() as u32 - 1)
}

#[cfg(test)]
mod tests {
    use crate::field::{Field, FieldSet};
    use crate::math::Vector;

    #[test]
    fn an_operand_of_an_operation_that_became_empty_leaves_the_tree() {
        let named = |name| Field::uniform(Vector::X).named(name);
        let empty = named("b").sum_intersection(named("removed"));
        let mut set = FieldSet::new();
        let handle = set.insert(named("a").replace_union(empty).replace_union(named("c")));
        let removed = set.handle("removed").expect("a field of this name");
        assert!(set.remove_field(removed).is_some());
        for tree in [set.tree(), set.remove(handle).expect("the tree")] {
            assert_eq!(tree.field_count(), 2, "{tree:?}");
            assert_eq!(tree.depth(), 1);
            let mut again = FieldSet::new();
            again.insert(tree);
            assert!(again.handle("b").is_none());
            assert_eq!(again.len(), 2);
        }
    }
}
