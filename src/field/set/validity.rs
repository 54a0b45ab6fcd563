//! Checks of the parts of a set that have changed.

use std::sync::Arc;

use super::FieldSet;
use crate::field::BuildError;

impl FieldSet {
    /// Checks everything that was inserted or changed since the last successful check. The cost grows with the
    /// number of these changes. Each step does this first.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut set = FieldSet::from(Field::spring(4.0).named("spring"));
    /// assert!(set.validate_changes().is_ok());
    /// set["spring"].strength = Real::NAN;
    /// let error = set.validate_changes().unwrap_err();
    /// assert!(error.to_string().starts_with("field `spring`: the strength must be finite"));
    /// ```
    ///
    /// # Errors
    /// See [`BuildError`]. The set stays as it is, and is refused until it is corrected.
    pub fn validate_changes(&mut self) -> Result<(), BuildError> {
        if let Some(last) = self.unchecked.open.take() {
            self.settle(last);
        }
        let axes = self.data.axes().iter();
        let declared: Vec<Arc<str>> = axes.map(|(name, _)| name.clone()).collect();
        for serial in &self.unchecked.terms {
            if let Some(term) = self.term(*serial) {
                let checked = self.nodes().validate_term(term.root, &declared);
                checked.map_err(|(error, place)| error.of(self.handle_at(place)))?;
            }
        }
        for place in &self.unchecked.leaves {
            if let Some(term) = self
                .term_of(*place)
                .filter(|_| self.field(*place).is_some())
            {
                let checked = self.nodes().validate_leaf(*place, term.root, &declared);
                checked.map_err(|(error, place)| error.of(self.handle_at(place)))?;
            }
        }
        self.unchecked.terms.clear();
        self.unchecked.leaves.clear();
        Ok(())
    }

    /// Returns true if all changes have been checked.
    pub(crate) fn is_checked(&self) -> bool {
        self.unchecked.terms.is_empty() && self.unchecked.leaves.is_empty()
    }
}
