//! The reference evaluator: it defines the meaning of a tree by a slow, literal walk in 64-bit precision.
//!
//! The faster evaluators are tested against this one. It shares formulas and regions with them, but no traversal:
//! it visits the tree node by node and applies the table at [`Operator`](crate::Operator) line by line.

mod trace;
mod walk;

pub use trace::{Contribution, Fate, Trace};

use crate::field::{Anchor, BuildError, FieldSet, Frames, Linearised, Motion, Nodes, Query, Tree};
use crate::math::DVec3;
use crate::number::real;
use walk::TreeWalk;

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
/// let frames = WorldRef::from(&world);
/// assert_eq!(reference.force(&frames, &at(0.5)), None, "cut out: not defined, which is not zero");
/// assert_eq!(reference.force(&frames, &at(1.5)), Some(DVec3::X));
/// # Ok::<(), BuildError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    nodes: Nodes<'a>,
    pub(crate) root: u32,
    pub(crate) instance: Anchor,
}

impl<'a> Reference<'a> {
    /// The reference for a tree.
    ///
    /// # Errors
    /// The tree is empty, too deep, has a parameter out of range, or uses detection fields
    /// wrongly. User axes are not checked: a region over an axis that a query lacks is empty for this query.
    pub fn new(tree: &'a Tree) -> Result<Self, BuildError> {
        let nodes = tree.nodes();
        let axes = (0..nodes.0.len() as u32).flat_map(|node| nodes.axes_at(node));
        let named: Vec<std::sync::Arc<str>> = axes.map(|axis| axis.name().into()).collect();
        tree.validate(&named)?;
        Ok(Reference {
            nodes,
            root: tree.root(),
            instance: Anchor::WORLD,
        })
    }

    /// The reference for a term of a set that has already been validated.
    pub(crate) fn of_term(set: &'a FieldSet, root: u32) -> Self {
        Self::of_instance(set, root, Anchor::WORLD)
    }

    /// The same for an instance of a subtree.
    pub(crate) fn of_instance(set: &'a FieldSet, root: u32, instance: Anchor) -> Self {
        let nodes = set.nodes();
        Reference {
            nodes,
            root,
            instance,
        }
    }

    /// The force of the composite field on a sample, in world axes; `None` where the field is not
    /// defined.
    pub fn force(&self, frames: &impl Frames, query: &Query) -> Option<DVec3> {
        let mut walk = TreeWalk::new(self.nodes, frames, query, Motion::of(query));
        let value = walk.subtree(self.root, &self.instance);
        value.defined.any().then(|| real(value.vector))
    }

    /// The force with its derivatives with respect to the point and the velocity of the sample; `None` where
    /// the field is not defined.
    ///
    /// Exact but for shapes and closures, which are differentiated numerically, and the random part of a
    /// [`LinearKernel`](crate::field::LinearKernel), which is not differentiated. The jump at the border of a
    /// region is not part of the derivatives.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// use rapier3d_fields::{field::Query, math::{DMat3, DVec3}, reference::Reference};
    /// let tree = Tree::from(Field::spring_damper(4.0, 0.5, 0.0));
    /// let world = PhysicsWorld::new();
    /// let query = Query { world_point: DVec3::X, ..Query::default() };
    /// let linearised = Reference::new(&tree)?
    ///     .linearised(&WorldRef::from(&world), &query)
    ///     .unwrap();
    /// assert_eq!(linearised.by_position, DMat3::from_diagonal(DVec3::splat(-4.0)));
    /// assert_eq!(linearised.by_velocity, DMat3::from_diagonal(DVec3::splat(-0.5)));
    /// # Ok::<(), BuildError>(())
    /// ```
    pub fn linearised(&self, frames: &impl Frames, query: &Query) -> Option<Linearised> {
        let motion = Motion::seeded(query);
        let mut walk = TreeWalk::new(self.nodes, frames, query, motion);
        let value = walk.subtree(self.root, &self.instance);
        let defined = value.defined.any();
        defined.then(|| Linearised::new(value.vector))
    }

    /// The force of each single field at a sample, and whether it is part of the composite's force.
    pub fn trace(&self, frames: &impl Frames, query: &Query) -> Trace {
        let mut walk = TreeWalk::new(self.nodes, frames, query, Motion::of(query));
        walk.log = Some(Default::default());
        let value = walk.subtree(self.root, &self.instance);
        Trace {
            force: value.defined.any().then(|| real(value.vector)),
            contributions: walk
                .log
                .map_or_else(Vec::new, std::cell::RefCell::into_inner),
        }
    }
}
