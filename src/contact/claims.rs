//! The pairs that are claimed from Rapier, and the colliders that listen for them.

use super::laws::LawTable;
use super::rules::{Pairs, in_order};
use super::starts::Starts;
use super::{Responder, Rules};
use crate::compile::Compiled;
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, Real, RigidBodyHandle};
use crate::rapier::dynamics::RigidBody;
use crate::rapier::geometry::Collider;
use crate::rapier::pipeline::ActiveHooks;

/// Which contacts Rapier is to leave to the fields.
#[derive(Clone, Debug, Default)]
pub(crate) struct Claims {
    rules: Rules,
    laws: LawTable,
    /// Whether there is any field that answers.
    any: bool,
    /// Whether anything may rebound without loss.
    lossless: bool,
    /// Whether fast bodies are followed through the step, so that nothing needs to stop them.
    pub(super) swept: bool,
}

/// A collider that was given hook bits.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
struct Told {
    collider: ColliderHandle,
    /// The bits that were its own.
    own: ActiveHooks,
    /// Whether it needs no hook any more. It keeps the bits for one more step: Rapier would go
    /// on with contacts that were lifted last.
    leaving: bool,
}

/// Colliders that were given hook bits, in the order of their handles.
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) struct Listening(Vec<Told>);

impl Listening {
    fn place(&self, collider: ColliderHandle) -> Result<usize, usize> {
        let key = collider.into_raw_parts();
        let of = |told: &Told| told.collider.into_raw_parts();
        // Mostly all colliders are among them, or all of some last ones.
        let first = self.0.first().map_or(0, |told| of(told).0);
        let guess = key.0.wrapping_sub(first) as usize;
        if self.0.get(guess).map(of) == Some(key) {
            return Ok(guess);
        }
        self.0.binary_search_by_key(&key, of)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn own(&self, collider: ColliderHandle) -> Option<ActiveHooks> {
        Some(self.0[self.place(collider).ok()?].own)
    }

    /// Notes that a collider has been given bits, beside those of its own.
    pub(crate) fn add(&mut self, collider: ColliderHandle, own: ActiveHooks) {
        let told = Told {
            collider,
            own,
            leaving: false,
        };
        match self.place(collider) {
            // Its own are those of before, unless the user has set them anew.
            Ok(place) => self.0[place].leaving = false,
            Err(place) => self.0.insert(place, told),
        }
    }

    /// Has them all asked about for one more step, since the last was none.
    pub(crate) fn stay(&mut self) {
        self.0.iter_mut().for_each(|told| told.leaving = false);
    }

    /// Colliders that need no hook any more, each once they have been so for a step, with the
    /// bits to be given back.
    pub(crate) fn release(
        &mut self,
        wanted: impl Fn(ColliderHandle) -> ActiveHooks,
    ) -> Vec<(ColliderHandle, ActiveHooks)> {
        let mut free = Vec::new();
        self.0.retain_mut(|told| {
            let left = std::mem::replace(&mut told.leaving, wanted(told.collider).is_empty());
            let go = left && told.leaving;
            if go {
                free.push((told.collider, told.own));
            }
            !go
        });
        free
    }

    /// Whether [`Self::release`] has anything to do.
    pub(crate) fn any_free(&self, wanted: impl Fn(ColliderHandle) -> ActiveHooks) -> bool {
        let free = |told: &Told| told.leaving || wanted(told.collider).is_empty();
        self.0.iter().any(free)
    }
}

impl Claims {
    pub(crate) fn new(rules: &Rules, compiled: &Compiled, swept: bool) -> Self {
        let mut detectors = compiled.detectors.iter();
        Claims {
            rules: rules.clone(),
            laws: LawTable::new(compiled),
            lossless: detectors.clone().any(|it| it.law.keeps_speed()),
            any: rules.claim_any() && detectors.any(|it| it.law != ContactLaw::Observe),
            swept,
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        !self.any
    }

    /// The law by which fields answer a pair in Rapier's place.
    pub(crate) fn law(&self, pair: [ColliderHandle; 2]) -> Option<ContactLaw> {
        if self.is_empty() || self.rules.of(pair) != Responder::Fields {
            return None;
        }
        let law = self.laws.of_pair(pair);
        law.filter(|law| *law != ContactLaw::Observe)
    }

    /// The same in a step, in which some pairs are `released`: on them no field acts where they are.
    pub(super) fn law_now(
        &self,
        pair: [ColliderHandle; 2],
        bodies: [Option<&RigidBody>; 2],
        released: &Pairs,
    ) -> Option<ContactLaw> {
        let law = self.law(pair);
        let free = || released.is_empty() || !released.contains(&in_order(pair));
        law.filter(|_| free() && !is_dominated(bodies))
    }

    /// The law of a collider that has a detection field.
    pub(super) fn law_of(&self, collider: ColliderHandle) -> Option<ContactLaw> {
        self.laws.of(collider)
    }

    /// A contact that approaches a body below this speed is no impact, whatever else presses the body.
    pub(super) fn slow(&self, starts: &Starts, body: RigidBodyHandle) -> Real {
        let restitution = if self.lossless { 1.0 } else { 0.0 };
        starts.slow(ContactLaw::restitution(restitution), [Some(body), None])
    }

    /// Whether Rapier asks about the contacts of a collider that is claimed.
    pub(super) fn listens(&self, handle: ColliderHandle, collider: &Collider) -> bool {
        let modify = ActiveHooks::MODIFY_SOLVER_CONTACTS;
        collider.active_hooks().contains(modify) && !self.bits(handle).is_empty()
    }

    /// The hook bits without which Rapier does not ask about a collider.
    pub(crate) fn bits(&self, collider: ColliderHandle) -> ActiveHooks {
        let law = self.laws.of(collider);
        if self.is_empty() || law.is_none_or(|law| law == ContactLaw::Observe) {
            ActiveHooks::empty()
        } else if self.swept {
            ActiveHooks::MODIFY_SOLVER_CONTACTS | ActiveHooks::FILTER_CONTACT_PAIRS
        } else {
            ActiveHooks::MODIFY_SOLVER_CONTACTS
        }
    }
}

/// Whether one of two dynamic bodies dominates the other: it yields to none of its contacts, which
/// Rapier's solver knows to do and the laws do not. Such pairs are Rapier's.
pub(crate) fn is_dominated(bodies: [Option<&RigidBody>; 2]) -> bool {
    let [Some(one), Some(two)] = bodies else {
        return false;
    };
    one.is_dynamic() && two.is_dynamic() && one.dominance_group() != two.dominance_group()
}
