//! `ForceField`: a tree of fields on an entity.

use std::ops::{Index, IndexMut};
use std::sync::atomic::{AtomicU64, Ordering};

use bevy::prelude::*;
use rapier3d_fields::{Field, FieldSet, Tree, TreeHandle};

/// A field, or a tree of fields, in the frame of its entity. The forces of all entities add up.
///
/// The frame is that of the entity's `Collider` if it has one, else that of the nearest `RigidBody` among the entity
/// and its ancestors, else that of its `GlobalTransform`. Scale affects places, but not the lengths within fields. As
/// for any field, one on a body does not act on that body, and [contact](Field::contact) fields need a `Collider`.
/// Fields that are [placed](Field::at) at a body or a collider of Rapier keep this anchor; the anchors of
/// [instances](Tree::instances) and of [scales](Tree::scaled_at) stay as they are, too.
///
/// Changes take effect in the next step. A field that is edited in place keeps its record of the bodies inside of it
/// and of its contacts; a component that replaces another one does not. Fields that are not valid are refused: an error
/// that names the entity is logged, and the previous fields stay. If the entity is despawned, or loses the component,
/// its fields are removed before the next step.
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
    /// The handle of the tree that is all of the set.
    tree: TreeHandle,
    /// A number that a component shares with its clones, which can differ from it in their fields only.
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

    /// The tree with its current fields.
    pub fn tree(&self) -> Tree {
        self.set.tree()
    }

    /// A field of the tree by its name; `None` if there is none.
    pub fn get(&self, name: &str) -> Option<&Field> {
        self.set.get(name)
    }

    /// A field of the tree by its name, to be changed; `None` if there is none.
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

    /// A copy in which `place` is applied to each field. Prototypes of instances stay as they are.
    pub(crate) fn placed(&self, place: impl Fn(&Field) -> Field) -> Self {
        let mut copy = self.clone();
        for (handle, field) in self.set.fields_in_place() {
            copy.set[handle] = place(field);
        }
        copy
    }

    /// Returns true if this component differs from one of that structure in its fields only.
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
/// If there is no field of that name, like an index into a map.
impl Index<&str> for ForceField {
    type Output = Field;

    fn index(&self, name: &str) -> &Field {
        &self.set[name]
    }
}

/// # Panics
/// If there is no field of that name, like an index into a map.
impl IndexMut<&str> for ForceField {
    fn index_mut(&mut self, name: &str) -> &mut Field {
        &mut self.set[name]
    }
}
