//! The rules that decide for each contact whether fields or Rapier answer it.

use std::collections::HashSet;
use std::hash::BuildHasherDefault;

use super::Responder;
use crate::field::Fingerprint;
use crate::math::ColliderHandle;

/// Pairs of colliders, each in the order of its handles.
pub(crate) type Pairs = HashSet<[ColliderHandle; 2], BuildHasherDefault<Fingerprint>>;

/// A pair in the order of its handles.
pub(crate) fn in_order(mut pair: [ColliderHandle; 2]) -> [ColliderHandle; 2] {
    pair.sort_unstable_by_key(|collider| collider.into_raw_parts());
    pair
}

/// The responder of all contacts, and exceptions for sets of colliders.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct ResponderRules {
    pub everywhere: Responder,
    /// Responders of contacts of which both colliders are in a set; the last set that fits counts.
    pub among: Vec<(HashSet<ColliderHandle>, Responder)>,
}

impl ResponderRules {
    pub(crate) fn of(&self, colliders: [ColliderHandle; 2]) -> Responder {
        let fits = |set: &HashSet<ColliderHandle>| colliders.iter().all(|c| set.contains(c));
        let rule = self.among.iter().rev().find(|(set, _)| fits(set));
        rule.map_or(self.everywhere, |(_, responder)| *responder)
    }

    /// Returns true if fields answer any contact.
    pub(crate) fn answer_any(&self) -> bool {
        let mut all = self.among.iter().map(|(_, responder)| responder);
        self.everywhere != Responder::Rapier || all.any(|r| *r != Responder::Rapier)
    }

    /// Returns true if any contact is answered by the fields instead of Rapier.
    pub(crate) fn fields_own_any(&self) -> bool {
        let mut all = self.among.iter().map(|(_, responder)| responder);
        self.everywhere == Responder::Fields || all.any(|r| *r == Responder::Fields)
    }
}
