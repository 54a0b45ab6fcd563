//! The quantities that can be evaluated, and the terms of which they are asked for.

/// The potential energy of bodies in fields.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PotentialEnergy {
    /// The sum over all fields that have a potential (J). A field anchored to a body counts half, because the
    /// field of the body it acts on acts back; so the sum is exact where fields of bodies come in such pairs.
    pub total: f64,
    /// Number of batches or terms that act, in part at least, without a known potential: drag, closures, bounded
    /// forces, scaled or limited composites, and operators other than the sum of union.
    pub without: usize,
}

/// The quantity that is summed over sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Force,
    /// The potential, in x. It counts half if the source belongs to a body, because the body it acts on has a
    /// field that acts back.
    Potential,
}

/// The terms whose derivatives are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Terms {
    All,
    ThatReadVelocities,
    /// Without drag and wind that are in [`BodySlowings`](super::BodySlowings).
    ThatReadVelocitiesOtherwise,
}
