//! A set of bodies with a fast membership test.

use crate::math::RigidBodyHandle;

/// The generation of each body, by the index of its handle; [`ABSENT`] where there is no body.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodySet(Vec<u32>);

const ABSENT: u32 = u32::MAX;

impl BodySet {
    /// The empty set.
    pub(crate) const fn new() -> Self {
        BodySet(Vec::new())
    }

    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    pub(crate) fn insert(&mut self, body: RigidBodyHandle) {
        let (index, generation) = body.into_raw_parts();
        let index = index as usize;
        if self.0.len() <= index {
            self.0.resize(index + 1, ABSENT);
        }
        self.0[index] = generation;
    }

    #[inline]
    pub(crate) fn contains(&self, body: RigidBodyHandle) -> bool {
        let (index, generation) = body.into_raw_parts();
        let found = self.0.get(index as usize);
        generation != ABSENT && found == Some(&generation)
    }
}
