//! The parts of a set that still have to be checked.

/// The parts of a set that were not checked since they changed.
#[derive(Clone, Debug, Default)]
pub(super) struct Unchecked {
    /// The serials of terms.
    pub terms: Vec<u64>,
    pub leaves: Vec<u32>,
    /// The leaf that was last given out to be changed.
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
