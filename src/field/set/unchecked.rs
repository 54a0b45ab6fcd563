//! What is still to be checked.

/// What has not been looked at since it changed.
#[derive(Clone, Debug, Default)]
pub(super) struct Unchecked {
    /// Terms, by serial.
    pub terms: Vec<u64>,
    pub leaves: Vec<u32>,
    /// The leaf that was last given out to be changed.
    pub open: Option<u32>,
}

impl Unchecked {
    /// Notes a leaf.
    pub(super) fn leaf(&mut self, place: u32) {
        if self.leaves.last() != Some(&place) {
            self.leaves.push(place);
        }
    }
}
