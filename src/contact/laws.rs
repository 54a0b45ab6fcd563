//! The contact law of each collider, looked up by its handle.

use std::collections::HashMap;

use crate::compile::Compiled;
use crate::field::ContactLaw;
use crate::math::ColliderHandle;

/// Up to this index, the laws of colliders are kept in a table; beyond it in a map, because a handle that did not come
/// from the world may have any index.
const TABLED: usize = 1 << 20;

/// The law of each collider that has a detection field; of several fields on one collider, the stronger law.
#[derive(Clone, Debug, Default)]
pub(crate) struct LawTable {
    /// By the index of a collider: its handle and law.
    table: Vec<Option<(ColliderHandle, ContactLaw)>>,
    beyond: HashMap<ColliderHandle, ContactLaw>,
}

impl LawTable {
    pub(crate) fn new(compiled: &Compiled) -> Self {
        let mut laws = LawTable::default();
        for detector in &compiled.detectors {
            laws.add(detector.collider, detector.law);
        }
        laws
    }

    fn add(&mut self, collider: ColliderHandle, law: ContactLaw) {
        let law = self.of(collider).map_or(law, |known| known.stronger(law));
        let index = collider.into_raw_parts().0 as usize;
        if index < TABLED {
            self.table.resize(self.table.len().max(index + 1), None);
            self.table[index] = Some((collider, law));
        } else {
            self.beyond.insert(collider, law);
        }
    }

    pub(crate) fn of(&self, collider: ColliderHandle) -> Option<ContactLaw> {
        let index = collider.into_raw_parts().0 as usize;
        if index >= TABLED {
            return self.beyond.get(&collider).copied();
        }
        let (handle, law) = (*self.table.get(index)?)?;
        (handle == collider).then_some(law)
    }

    /// The law of a pair; `None` if neither has a detection field.
    pub(crate) fn of_pair(&self, pair: [ColliderHandle; 2]) -> Option<ContactLaw> {
        combined(pair.map(|collider| self.of(collider)))
    }
}

/// The law of a pair from those of its two sides: the stronger one.
pub(super) fn combined([first, second]: [Option<ContactLaw>; 2]) -> Option<ContactLaw> {
    match (first, second) {
        (Some(a), Some(b)) => Some(a.stronger(b)),
        (law, None) | (None, law) => law,
    }
}
