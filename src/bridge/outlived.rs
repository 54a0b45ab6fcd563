//! Contacts that outlive the shape on which they were found.
//!
//! A pair in which a shape has several parts may have several manifolds. If `set_shape` then gives that collider a
//! shape of one part, Rapier 0.36 updates the first manifold of the pair, and keeps the others as they are. With
//! `contact_clustering`, the contact graph of its solver keeps references to manifolds that no longer exist, and the
//! solver reads beyond the points of others. Rapier rebuilds the graph in a step before which a body was written to.

use super::world::WorldMut;
use crate::math::{ColliderHandle, ColliderSet};
use crate::rapier::geometry::{Collider, ContactPair, NarrowPhase, ShapeType};

/// The number of steps between two searches for colliders of several parts.
const LOOKS_EVERY: u32 = 64;

/// The colliders whose contacts may outlive their shape.
#[derive(Debug, Default)]
pub(crate) struct Outlived {
    /// Colliders of several parts.
    several: Vec<ColliderHandle>,
    /// Colliders that had several parts, and have contacts from that time.
    former: Vec<ColliderHandle>,
    /// The steps until the next search; `None` before the first one.
    looks_in: Option<u32>,
}

impl Outlived {
    /// Finds the pairs with contacts of a former shape, and makes Rapier's next step safe by marking a body as written
    /// to. `anew` is true if colliders may have been added since the last call.
    pub(crate) fn find(
        &mut self,
        world: &mut WorldMut<'_>,
        anew: bool,
    ) -> Vec<[ColliderHandle; 2]> {
        let (colliders, former) = (&*world.colliders, &mut self.former);
        self.several.retain(|handle| {
            let collider = colliders.get(*handle);
            let still = collider.is_some_and(has_parts);
            if !still && collider.is_some() {
                former.push(*handle);
            }
            still
        });
        self.look(world.colliders, world.narrow_phase, anew);
        let mut found = Vec::new();
        let pairs = world.narrow_phase;
        self.former.retain(|handle| {
            let count = found.len();
            let stale = pairs.contact_pairs_with(*handle);
            let stale = stale.filter(|pair| is_outlived(pair, colliders));
            found.extend(stale.map(|pair| [pair.collider1, pair.collider2]));
            found.len() > count
        });
        found.sort_unstable_by_key(|pair| pair.map(ColliderHandle::into_raw_parts));
        found.dedup();
        let parent = |handle: &ColliderHandle| colliders.get(*handle)?.parent();
        let body = found.iter().flatten().find_map(parent);
        if let Some(body) = body {
            world.bodies.get_mut(body);
        }
        found
    }

    fn look(&mut self, colliders: &ColliderSet, pairs: &NarrowPhase, anew: bool) {
        let due = self.looks_in.is_none_or(|steps| steps == 0);
        if !due && !anew {
            self.looks_in = self.looks_in.map(|steps| steps - 1);
            return;
        }
        if self.looks_in.is_none() {
            let outlived = pairs
                .contact_pairs()
                .filter(|it| is_outlived(it, colliders));
            self.former.extend(outlived.map(|pair| pair.collider1));
        }
        self.looks_in = Some(LOOKS_EVERY);
        let several = colliders.iter().filter(|(_, collider)| has_parts(collider));
        self.several.clear();
        self.several.extend(several.map(|(handle, _)| handle));
    }
}

/// Returns true if Rapier has contacts of a pair that its shapes cannot have.
fn is_outlived(pair: &ContactPair, colliders: &ColliderSet) -> bool {
    let single = |handle| colliders.get(handle).is_some_and(|it| !has_parts(it));
    pair.manifolds().len() > 1 && single(pair.collider1) && single(pair.collider2)
}

/// Returns true if contacts with a collider may have several manifolds.
fn has_parts(collider: &Collider) -> bool {
    matches!(
        collider.shape().shape_type(),
        ShapeType::Compound
            | ShapeType::TriMesh
            | ShapeType::Polyline
            | ShapeType::HeightField
            | ShapeType::Voxels
            | ShapeType::Custom
    )
}
