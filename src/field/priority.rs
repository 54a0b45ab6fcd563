//! The effect of a layer on layers of other priority.

/// The effect of a layer on the others, where it is defined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct Override {
    /// Drops the forces of layers of higher priority.
    pub replaces: bool,
    /// Leaves out layers of lower priority.
    pub stops: bool,
}
