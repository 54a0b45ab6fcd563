//! What an evaluation gives beside wrenches.

/// The potential energy of bodies in fields.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PotentialEnergy {
    /// The sum over all fields that have a potential. A field anchored to a body counts half,
    /// because the field of the body it acts on acts back; so it is exact where fields of bodies
    /// come in such pairs.
    pub total: f64,
    /// How many batches or terms act without a known potential, in part at least: drag, closures,
    /// bounded forces, what is scaled or limited, and operators other than the sum of union.
    pub without: usize,
}

/// What is summed over sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Force,
    /// The potential, in x; half of it where the source belongs to a body, because the body it
    /// acts on has a field that acts back.
    Potential,
}

/// Which terms are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Terms {
    All,
    ThatReadVelocities,
    /// Those without drag and wind that have [`BodySlowings`](super::BodySlowings).
    ThatReadVelocitiesOtherwise,
}
