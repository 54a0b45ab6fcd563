//! `ForceField`: a tree of fields on an entity.

use std::ops::{Index, IndexMut};
use std::sync::atomic::{AtomicU64, Ordering};

use bevy::prelude::*;
use rapier3d_fields::{Field, FieldSet, Tree, TreeHandle};

/// A field, or a tree of fields, in the frame of its entity. The forces of all entities add up.
///
/// The frame is that of the entity: with a `Collider`, the collider's; within a `RigidBody` (its own, or that of an
/// ancestor), the body's; else that of the `GlobalTransform`. Scale counts for places, but not for the lengths of fields.
/// As for any field, one on a body does not act on that body, and [contact](Field::contact) fields need a `Collider`.
/// Fields that are [placed](Field::at) at a body or a collider of Rapier's stay there, and so do the anchors of
/// [instances](Tree::instances) and of [scales](Tree::scaled_at).
///
/// Changes count from the next step on. A change of a field in place keeps who is inside of it and what touches it; a
/// new component in place of the old one does not. Fields that are not valid are refused: an error is logged that names
/// the entity, and the fields that it had before stay. An entity that is despawned, or loses the component, loses its
/// fields before the next step.
///
/// ```
/// use bevy_rapier3d_fields::prelude::*;
/// use bevy_rapier3d::prelude::Vect;
/// let wind = Field::uniform(Vect::X).named("wind");
/// let lee = Field::uniform(Vect::ZERO).within(Region::ball(2.0));
/// let mut field = ForceField::new(wind.replace_union(lee));
/// field["wind"].strength = 3.0;
/// ```
#[derive(Component, Clone, Debug, Reflect)]
#[reflect(opaque, Component, Clone)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "Tree", into = "Tree"),
    reflect(Serialize, Deserialize)
)]
#[require(Transform)]
pub struct ForceField {
    set: FieldSet,
    /// The whole of the set.
    tree: TreeHandle,
    /// The same for all copies of a component, in which only fields can have changed.
    structure: u64,
}

impl ForceField {
    /// A field or a tree in the frame of its entity.
    pub fn new(tree: impl Into<Tree>) -> Self {
        static STRUCTURES: AtomicU64 = AtomicU64::new(0);
        let mut set = FieldSet::new();
        ForceField {
            tree: set.insert(tree),
            set,
            structure: STRUCTURES.fetch_add(1, Ordering::Relaxed),
        }
    }

    /// The tree, as it is now.
    pub fn tree(&self) -> Tree {
        self.set.tree()
    }

    /// A field of the tree by its name; `None` if there is none.
    pub fn get(&self, name: &str) -> Option<&Field> {
        self.set.get(name)
    }

    /// A field of the tree by its name, to be changed.
    pub fn get_mut(&mut self, name: &str) -> Option<&mut Field> {
        self.set.get_mut(name)
    }

    /// All fields of the tree, in the order of a walk.
    pub fn iter(&self) -> impl Iterator<Item = &Field> {
        let handles = self.set.fields_of(self.tree);
        handles
            .into_iter()
            .filter_map(|handle| self.set.get(handle))
    }

    /// Changes each field of the tree.
    pub fn for_each(&mut self, mut change: impl FnMut(&mut Field)) {
        for handle in self.set.fields_of(self.tree) {
            if let Some(field) = self.set.get_mut(handle) {
                change(field);
            }
        }
    }

    /// Turns all fields of the tree on or off.
    pub fn set_enabled(&mut self, enabled: bool) {
        self.for_each(|field| field.enabled = enabled);
    }

    /// A copy with each field in its place in the world. Prototypes of instances stay as they are.
    pub(crate) fn placed(&self, place: impl Fn(&Field) -> Field) -> Self {
        let mut copy = self.clone();
        for (handle, field) in self.set.fields_in_place() {
            copy.set[handle] = place(field);
        }
        copy
    }

    /// Returns true if only fields differ from another component.
    pub(crate) fn has_structure(&self, structure: u64) -> bool {
        self.structure == structure
    }

    pub(crate) fn structure(&self) -> u64 {
        self.structure
    }
}

impl From<Tree> for ForceField {
    fn from(tree: Tree) -> Self {
        Self::new(tree)
    }
}

impl From<Field> for ForceField {
    fn from(field: Field) -> Self {
        Self::new(field)
    }
}

impl From<ForceField> for Tree {
    fn from(field: ForceField) -> Self {
        field.tree()
    }
}

/// A field of the tree, by its name.
///
/// # Panics
/// If there is none of that name, like an index into a map.
impl Index<&str> for ForceField {
    type Output = Field;

    fn index(&self, name: &str) -> &Field {
        &self.set[name]
    }
}

/// # Panics
/// If there is none of that name, like an index into a map.
impl IndexMut<&str> for ForceField {
    fn index_mut(&mut self, name: &str) -> &mut Field {
        &mut self.set[name]
    }
}
