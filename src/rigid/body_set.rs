//! A set of bodies with a fast membership test.

use crate::math::RigidBodyHandle;

/// One bit a body, by the index of its handle. Generations are not compared, so it must be asked about bodies
/// that exist only.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodySet(Vec<u64>);

const BITS: usize = u64::BITS as usize;

impl BodySet {
    /// The empty set.
    pub(crate) const fn new() -> Self {
        BodySet(Vec::new())
    }

    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    pub(crate) fn insert(&mut self, body: RigidBodyHandle) {
        let index = index(body);
        let word = index / BITS;
        if self.0.len() <= word {
            self.0.resize(word + 1, 0);
        }
        self.0[word] |= 1 << (index % BITS);
    }

    #[inline]
    pub(crate) fn contains(&self, body: RigidBodyHandle) -> bool {
        let index = index(body);
        let word = self.0.get(index / BITS);
        word.is_some_and(|word| word >> (index % BITS) & 1 == 1)
    }
}

fn index(body: RigidBodyHandle) -> usize {
    body.into_raw_parts().0 as usize
}
