//! The meaning of a tree: a slow, literal walk in 64-bit precision.
//!
//! Every faster evaluator must equal this one. It knows nothing of them: it walks the tree node
//! by node and applies the table at [`Operator`] line by line.

use crate::field::{
    Anchor, Field, Frame, Frames, LocalQuery, Neighbourhood, Node, Normal, Operator, Pieces, Query,
    Tree, TreeError,
};
use crate::math::DVec3;

/// The reference evaluator of a tree.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// use rapier3d_fields::{field::Query, math::DVec3, reference::Reference};
/// let inner = Field::uniform(Vector::Y).within(Region::ball(1.0));
/// let tree = Field::uniform(Vector::X).within(Region::ball(2.0)).difference(inner);
/// let world = PhysicsWorld::new();
/// let reference = Reference::new(&tree)?;
/// let at = |x| Query { world_point: DVec3::X * x, ..Query::default() };
/// let frames = (&world.bodies, &world.colliders);
/// assert_eq!(reference.force(&frames, &at(0.5)), None, "cut out: not defined, which is not zero");
/// assert_eq!(reference.force(&frames, &at(1.5)), Some(DVec3::X));
/// # Ok::<(), TreeError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    tree: &'a Tree,
}

/// A composite at a sample: the pieces of its neighbourhood it is defined on, and its vector.
#[derive(Clone, Copy)]
struct Value {
    defined: Pieces,
    vector: DVec3,
}

const UNDEFINED: Value = Value {
    defined: Pieces::NONE,
    vector: DVec3::ZERO,
};

impl<'a> Reference<'a> {
    /// The reference for a tree.
    ///
    /// # Errors
    /// The tree is empty, too deep, has a parameter out of range, or uses detection fields
    /// wrongly. User axes are not checked: a query that lacks one finds regions over it empty.
    pub fn new(tree: &'a Tree) -> Result<Self, TreeError> {
        let mut named: Vec<std::sync::Arc<str>> = Vec::new();
        for (_, field) in tree.leaves() {
            named.extend(field.axes().map(|axis| axis.name().into()));
        }
        tree.validate(&named)?;
        Ok(Reference { tree })
    }

    /// The force of the composite field on a probe, in world axes; nothing where the field is not
    /// defined.
    pub fn force(&self, frames: &impl Frames, query: &Query) -> Option<DVec3> {
        let walk = Walk {
            tree: self.tree,
            frames,
            query,
            here: self.neighbourhood(frames, query),
        };
        let value = walk.node(self.tree.root(), &Anchor::WORLD);
        value.defined.any().then_some(value.vector)
    }

    /// The pieces that the surfaces of all regions cut the neighbourhood of the sample into.
    fn neighbourhood(&self, frames: &impl Frames, query: &Query) -> Neighbourhood {
        let mut normals: Vec<Normal> = Vec::new();
        let mut open = vec![(self.tree.root(), Anchor::WORLD)];
        while let Some((node, instance)) = open.pop() {
            match &self.tree.nodes()[node as usize] {
                Node::Leaf(field) => {
                    if let Some(frame) = acting_frame(field, &instance, frames, query) {
                        let local = LocalQuery::new(query, &frame);
                        field.region.touched(&local, &mut normals);
                    }
                }
                Node::Operation { operands, .. } => {
                    open.extend(operands.iter().map(|operand| (*operand, instance)));
                }
                Node::Instances { prototype, anchors } => {
                    open.extend(anchors.iter().map(|a| (*prototype, a.within(&instance))));
                }
            }
        }
        Neighbourhood::of(&normals)
    }
}

/// The frame of a field, if the field is there and does not belong to the probe's own body.
fn acting_frame(
    field: &Field,
    instance: &Anchor,
    frames: &impl Frames,
    query: &Query,
) -> Option<Frame> {
    let frame = frames.frame(&field.anchor.within(instance))?;
    let own = frame.body.is_some() && frame.body == query.body;
    (!own).then_some(frame)
}

struct Walk<'a, F> {
    tree: &'a Tree,
    frames: &'a F,
    query: &'a Query,
    here: Neighbourhood,
}

impl<F: Frames> Walk<'_, F> {
    /// The depth of a tree is limited, so recursion is safe.
    fn node(&self, node: u32, instance: &Anchor) -> Value {
        match &self.tree.nodes()[node as usize] {
            Node::Leaf(field) => self.leaf(field, instance),
            Node::Operation { operator, operands } => {
                let mut values = operands.iter().map(|operand| self.node(*operand, instance));
                let first = values.next().unwrap_or(UNDEFINED);
                values.fold(first, |u, v| self.apply(*operator, u, v))
            }
            Node::Instances { prototype, anchors } => {
                let values = anchors
                    .iter()
                    .map(|a| self.node(*prototype, &a.within(instance)));
                values.fold(UNDEFINED, |u, v| self.apply(Operator::SumUnion, u, v))
            }
        }
    }

    fn leaf(&self, field: &Field, instance: &Anchor) -> Value {
        let Some(frame) = acting_frame(field, instance, self.frames, self.query) else {
            return UNDEFINED;
        };
        let local = LocalQuery::new(self.query, &frame);
        let defined = field.region.pieces(&local, &self.here);
        if !defined.any() {
            return UNDEFINED;
        }
        let vector = local.rotation * field.formula.vector(&local) * field.weight(&local);
        Value { defined, vector }
    }

    /// The table at [`Operator`], line by line, for U on E and V on G.
    fn apply(&self, operator: Operator, u: Value, v: Value) -> Value {
        let (e, g) = (u.defined, v.defined);
        let (on_e, on_g) = (e.any(), g.any());
        let defined = match operator {
            Operator::SumUnion | Operator::CrossUnion | Operator::ReplaceUnion => e | g,
            Operator::SumIntersection
            | Operator::CrossIntersection
            | Operator::ReplaceIntersection => e & g,
            Operator::Difference => e & self.here.complement(g),
        };
        let vector = match operator {
            _ if !on_g => u.vector,
            Operator::Difference => u.vector,
            _ if !on_e => v.vector,
            Operator::SumUnion | Operator::SumIntersection => u.vector + v.vector,
            Operator::CrossUnion | Operator::CrossIntersection => u.vector.cross(v.vector),
            Operator::ReplaceUnion | Operator::ReplaceIntersection => v.vector,
        };
        if defined.any() {
            Value { defined, vector }
        } else {
            UNDEFINED
        }
    }
}
