//! What layers do to those of other priority.

/// What a layer does to the others where it is defined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub struct Override {
    /// Drops what layers of higher priority gave.
    pub replaces: bool,
    /// Leaves layers of lower priority out.
    pub stops: bool,
}
