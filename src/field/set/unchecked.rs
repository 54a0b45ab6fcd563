//! The parts of a set that still have to be checked.

/// The parts of a set that have changed since they were checked.
#[derive(Clone, Debug, Default)]
pub(super) struct Unchecked {
    /// The serials of terms.
    pub terms: Vec<u64>,
    pub leaves: Vec<u32>,
    /// The leaf that was last borrowed mutably.
    pub open: Option<u32>,
}

impl Unchecked {
    /// Notes a leaf to be checked.
    pub(super) fn leaf(&mut self, place: u32) {
        if self.leaves.last() != Some(&place) {
            self.leaves.push(place);
        }
    }
}
