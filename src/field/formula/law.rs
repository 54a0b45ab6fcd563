//! The trait that all formulas implement.

use crate::field::axis::Axis;
use crate::field::error::BuildError;
use crate::field::query::{LocalQuery, QueryNumber, Single};
use crate::number::Vec3;

/// Implements [`Law::vector`] for a law that is evaluated at one sample at a time.
macro_rules! alone {
    () => {
        fn vector<T: $crate::field::QueryNumber>(
            &self,
            local: &$crate::field::LocalQuery<'_, T>,
        ) -> $crate::number::Vec3<T> {
            T::alone(self, local)
        }

        fn knows_several(&self) -> bool {
            false
        }
    };
}
pub(crate) use alone;

/// One kind of formula.
pub(crate) trait Law {
    /// Its name, for messages and plans.
    fn kind(&self) -> &'static str;

    /// The vector at a sample, or at several, in the field's frame. A law that must branch writes `alone!()` in
    /// place of this, and implements [`Alone`](crate::field::query::Alone).
    fn vector<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T>;

    /// The vector times a strength, before a bound is applied.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn times<T: QueryNumber>(&self, strength: f64, local: &LocalQuery<'_, T>) -> Vec3<T> {
        self.vector(local) * T::from(strength)
    }

    /// Returns true if it can be evaluated at several samples at once.
    fn knows_several(&self) -> bool {
        true
    }

    /// The potential U with F = −∇U at a sample; `None` if the law has none.
    fn potential<T: Single>(&self, _local: &LocalQuery<'_, T>) -> Option<T> {
        None
    }

    /// Returns true if the vector depends on the velocity of the sample.
    fn reads_velocity(&self) -> bool {
        false
    }

    /// The axes that it names, as closures and expressions do.
    fn axes(&self) -> &[Axis] {
        &[]
    }

    fn validate(&self, field: &str) -> Result<(), BuildError>;
}
