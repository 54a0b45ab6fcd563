//! Handles of the fields and trees in a set.

/// A field in a [`FieldSet`](crate::FieldSet). Once the field is removed, its handle finds no other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct FieldHandle {
    pub(crate) index: u32,
    pub(super) generation: u32,
}

/// A tree that was inserted into a [`FieldSet`](crate::FieldSet). Once the tree is removed, its handle finds no
/// other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct TreeHandle {
    pub(super) index: u32,
    pub(super) generation: u32,
}
