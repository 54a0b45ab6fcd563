//! The fields of a set with their places in the world.

use crate::bridge::WorldRef;
use crate::field::{Anchor, Field, FieldHandle, FieldSet, Frame, Frames, Node, Span};

/// A field that acts now, with its present frame. A field of a prototype has one for each instance.
pub(super) struct PlacedField<'a> {
    pub handle: FieldHandle,
    pub field: &'a Field,
    pub frame: Frame,
}

/// The fields that act at a time and whose anchors are in the world, in the order of the trees.
pub(super) fn placed_fields<'a>(
    set: &'a FieldSet,
    world: WorldRef<'a>,
    time: f64,
) -> impl Iterator<Item = PlacedField<'a>> {
    let terms = set.terms().iter();
    let leaves = terms.flat_map(|term| leaves(set, term.root));
    leaves.filter_map(move |leaf| {
        let field = set.field(leaf.node)?;
        let frame = world.frame(&field.anchor.within(&leaf.instance))?;
        let handle = set.handle_at(leaf.node)?;
        let placed = PlacedField {
            handle,
            field,
            frame,
        };
        field.is_on(Span::at(time)).then_some(placed)
    })
}

/// A node, and the anchor that takes the place of the world in it.
struct PlacedNode {
    node: u32,
    instance: Anchor,
}

/// The fields at and below a node, one after another, because the instances can be very many.
fn leaves(set: &FieldSet, root: u32) -> impl Iterator<Item = PlacedNode> {
    let instance = Anchor::WORLD;
    let mut open = vec![PlacedNode {
        node: root,
        instance,
    }];
    std::iter::from_fn(move || {
        while let Some(PlacedNode { node, instance }) = open.pop() {
            match set.nodes().get(node) {
                Node::Leaf(_) => return Some(PlacedNode { node, instance }),
                Node::Instances { prototype, anchors } => {
                    let instances = anchors.iter().rev().map(|anchor| PlacedNode {
                        node: *prototype,
                        instance: anchor.within(&instance),
                    });
                    open.extend(instances);
                }
                other => {
                    let operands = other.operands().iter().rev();
                    open.extend(operands.map(|node| PlacedNode {
                        node: *node,
                        instance,
                    }));
                }
            }
        }
        None
    })
}
