//! What every formula says of itself.

use crate::field::axis::Axis;
use crate::field::error::BuildError;
use crate::field::number::{Number, Vec3};
use crate::field::query::LocalQuery;

/// One kind of formula.
pub(crate) trait Law {
    /// Its name, for messages and plans.
    fn kind(&self) -> &'static str;

    /// The vector at a sample, in the field's frame.
    fn vector<T: Number>(&self, local: &LocalQuery<'_, T>) -> Vec3<T>;

    /// The potential U with F = −∇U at a sample, where there is one.
    fn potential<T: Number>(&self, _local: &LocalQuery<'_, T>) -> Option<T> {
        None
    }

    /// Whether the vector depends on the velocity of the sample.
    fn reads_velocity(&self) -> bool {
        false
    }

    /// The axes it names beyond those every formula may read.
    fn axes(&self) -> &[Axis] {
        &[]
    }

    fn validate(&self, field: &str) -> Result<(), BuildError>;
}
