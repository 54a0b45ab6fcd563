//! Handles of the fields and trees in a set.

/// A field in a [`FieldSet`](crate::FieldSet). The handle of a removed field never finds another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct FieldHandle {
    pub(crate) index: u32,
    pub(super) generation: u32,
}

/// A tree that was inserted into a [`FieldSet`](crate::FieldSet). The handle of a removed tree never finds another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct TreeHandle {
    pub(super) index: u32,
    pub(super) generation: u32,
}
