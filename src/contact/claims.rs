//! The contacts that fields claim from Rapier, and the colliders that have hook bits for that.

use super::laws::LawTable;
use super::rules::{Pairs, in_order};
use super::starts::Starts;
use super::{Responder, ResponderRules};
use crate::compile::Compiled;
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, Real, RigidBodyHandle};
use crate::rapier::dynamics::RigidBody;
use crate::rapier::geometry::Collider;
use crate::rapier::pipeline::ActiveHooks;
use crate::rigid::{BodySet, Lookup};

/// The rules and laws that decide which contacts Rapier leaves to the fields.
#[derive(Clone, Debug, Default)]
pub(crate) struct Claims {
    rules: ResponderRules,
    pub(super) laws: LawTable,
    /// True if some rule gives contacts to the fields and some detection field has a law other than `Observe`.
    any: bool,
    /// True if some law loses no speed, so that its contacts may rebound as fast as they came.
    lossless: bool,
    /// True with swept detection, which follows fast bodies through the step, so nothing needs to stop them.
    pub(super) swept: bool,
    jointed: JointedBodies,
}

/// The dynamic bodies with joints.
#[derive(Clone, Debug, Default)]
struct JointedBodies {
    /// Links of multibodies.
    links: BodySet,
    /// Bodies with an enabled impulse joint.
    others: BodySet,
}

/// A collider that was given hook bits.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
struct HookedCollider {
    collider: ColliderHandle,
    /// The hook bits that the user had set on it.
    own: ActiveHooks,
    /// True if it needs no hook any more. It keeps the bits for one more step, because Rapier would otherwise reuse
    /// contacts that were lifted off in the last one.
    leaving: bool,
}

/// The colliders that were given hook bits, in the order of their handles.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Listening(Vec<HookedCollider>);

impl Listening {
    fn place(&self, collider: ColliderHandle) -> Result<usize, usize> {
        let key = collider.into_raw_parts();
        let of = |hooked: &HookedCollider| hooked.collider.into_raw_parts();
        // The entries are usually consecutive indices, so the place is guessed before it is searched.
        let first = self.0.first().map_or(0, |hooked| of(hooked).0);
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

    /// Records that a collider was given hook bits, and the bits it had before.
    pub(crate) fn add(&mut self, collider: ColliderHandle, own: ActiveHooks) {
        let hooked = HookedCollider {
            collider,
            own,
            leaving: false,
        };
        match self.place(collider) {
            // The recorded bits stay those from before the fields were added, unless the user has set them anew.
            Ok(place) => self.0[place].leaving = false,
            Err(place) => self.0.insert(place, hooked),
        }
    }

    /// Keeps the bits of all colliders for one more step, because Rapier made no step since they were marked as
    /// leaving.
    pub(crate) fn stay(&mut self) {
        self.0.iter_mut().for_each(|hooked| hooked.leaving = false);
    }

    /// Removes the colliders that have needed no hook for two calls in a row, and returns them with the bits to
    /// restore.
    pub(crate) fn release(
        &mut self,
        wanted: impl Fn(ColliderHandle) -> ActiveHooks,
    ) -> Vec<(ColliderHandle, ActiveHooks)> {
        let mut free = Vec::new();
        self.0.retain_mut(|hooked| {
            let left = std::mem::replace(&mut hooked.leaving, wanted(hooked.collider).is_empty());
            let go = left && hooked.leaving;
            if go {
                free.push((hooked.collider, hooked.own));
            }
            !go
        });
        free
    }

    /// Returns true if [`Self::release`] would change anything.
    pub(crate) fn any_free(&self, wanted: impl Fn(ColliderHandle) -> ActiveHooks) -> bool {
        let free = |hooked: &HookedCollider| hooked.leaving || wanted(hooked.collider).is_empty();
        self.0.iter().any(free)
    }
}

impl Claims {
    pub(crate) fn new(rules: &ResponderRules, compiled: &Compiled, swept: bool) -> Self {
        let mut detectors = compiled.detectors.iter();
        Claims {
            rules: rules.clone(),
            laws: LawTable::new(compiled),
            lossless: detectors.clone().any(|it| it.law.keeps_speed()),
            any: rules.claim_any() && detectors.any(|it| it.law != ContactLaw::Observe),
            swept,
            jointed: JointedBodies::default(),
        }
    }

    /// Takes over the links of multibodies, and the bodies with impulse joints, as far as they are dynamic.
    pub(crate) fn set_jointed(
        &mut self,
        links: impl Iterator<Item = RigidBodyHandle>,
        others: impl Iterator<Item = RigidBodyHandle>,
        world: &impl Lookup,
    ) {
        let moves = |body: &RigidBodyHandle| world.body(*body).is_some_and(RigidBody::is_dynamic);
        let JointedBodies {
            links: known_links,
            others: known_others,
        } = &mut self.jointed;
        known_links.clear();
        known_others.clear();
        links
            .filter(moves)
            .for_each(|body| known_links.insert(body));
        others
            .filter(moves)
            .for_each(|body| known_others.insert(body));
    }

    /// Returns true if Rapier's solver answers the contacts of two bodies that fields claim by a law, because joints
    /// decide how one of them moves after an impact. This holds for links of multibodies, whose velocities Rapier
    /// computes from their joints, under any law and without claims; for other bodies with joints if the law loses
    /// speed. Under one that does not, the solver would lose it: of five pendulums in a row, it lifts the last one to
    /// 0.28 of the height, and fields to 0.95.
    pub(crate) fn leaves_to_solver(
        &self,
        law: Option<ContactLaw>,
        bodies: [Option<RigidBodyHandle>; 2],
    ) -> bool {
        let is_any = |of: &BodySet| bodies.iter().flatten().any(|body| of.contains(*body));
        let is_impulse = |law: &ContactLaw| matches!(law, ContactLaw::Impulse { .. });
        let loses_speed = law.is_some_and(|law| is_impulse(&law) && !law.keeps_speed());
        is_any(&self.jointed.links) || loses_speed && is_any(&self.jointed.others)
    }

    pub(crate) fn is_empty(&self) -> bool {
        !self.any
    }

    /// The law by which fields answer a pair instead of Rapier; `None` if they do not.
    pub(crate) fn law(&self, pair: [ColliderHandle; 2]) -> Option<ContactLaw> {
        if self.is_empty() || self.rules.of(pair) != Responder::Fields {
            return None;
        }
        let law = self.laws.of_pair(pair);
        law.filter(|law| *law != ContactLaw::Observe)
    }

    /// As [`Self::law`], for one step: also `None` for pairs in `released`, on which no field acts at their present
    /// poses, and for pairs in which one dynamic body [dominates](is_dominated) the other.
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

    /// The resting threshold of a body under any law of this world: a contact with it that approaches more slowly is no
    /// impact, whatever accelerates the other body.
    pub(super) fn resting_speed(&self, starts: &Starts, body: RigidBodyHandle) -> Real {
        let restitution = if self.lossless { 1.0 } else { 0.0 };
        starts.resting_speed(ContactLaw::restitution(restitution), [Some(body), None])
    }

    /// Returns true if Rapier calls `modify_solver_contacts` for a collider that fields claim.
    pub(super) fn listens(&self, handle: ColliderHandle, collider: &Collider) -> bool {
        let modify = ActiveHooks::MODIFY_SOLVER_CONTACTS;
        collider.active_hooks().contains(modify) && !self.bits(handle).is_empty()
    }

    /// The hook bits that a collider needs so that Rapier calls the hooks for it; empty if no field claims it.
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

/// Returns true if two dynamic bodies have different dominance groups. The dominant one does not react to the contact,
/// which Rapier's solver respects and the laws here do not, so such pairs are left to Rapier.
pub(crate) fn is_dominated(bodies: [Option<&RigidBody>; 2]) -> bool {
    let [Some(one), Some(two)] = bodies else {
        return false;
    };
    one.is_dynamic() && two.is_dynamic() && one.dominance_group() != two.dominance_group()
}
