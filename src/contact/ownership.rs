//! The side that answers each pair of colliders in a step: one table for hooks, detection, answers and the hand-over.

use std::sync::Arc;

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

/// The side that answers the contacts of a pair in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PairOwner {
    /// Rapier, as without fields.
    Rapier,
    /// Rapier and the fields, each by its own rule.
    Both,
    /// The fields answer impacts by this law. While the contact lasts, Rapier's solver holds it, with the friction of
    /// the law and no restitution.
    Fields(ContactLaw),
    /// Rapier's solver, with the friction and restitution of this law, because joints decide how one of the bodies moves
    /// after an impact.
    Solver(ContactLaw),
    /// Rapier's solver, as if the contact lasted, until the pair separates: the fields could not separate it.
    HandedOver(ContactLaw),
}

/// The owners of all pairs in a step.
#[derive(Debug, Default)]
pub(crate) struct Ownership {
    pub rules: Arc<OwnershipRules>,
    /// Pairs on which no detection field acts at their poses when the step begins.
    pub released: Pairs,
    /// Pairs that the fields have handed over to Rapier until they separate.
    pub handed_over: Pairs,
}

/// The two bodies of a pair; `None` for a collider without a body.
pub(crate) type PairBodies<'a> = [Option<(RigidBodyHandle, &'a RigidBody)>; 2];

/// The rules and laws by which pairs have their owners, apart from what happened to single pairs.
#[derive(Clone, Debug, Default)]
pub(crate) struct OwnershipRules {
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

impl Ownership {
    /// The owner of a pair in this step.
    pub(crate) fn of(&self, pair: [ColliderHandle; 2], bodies: PairBodies<'_>) -> PairOwner {
        let rules = &self.rules;
        let responder = rules.rules.of(pair);
        if responder == Responder::Rapier || is_dominated(bodies.map(|it| Some(it?.1))) {
            return PairOwner::Rapier;
        }
        let law = rules.law(pair);
        let solves = rules.leaves_to_solver(law, bodies.map(|it| Some(it?.0)));
        match law {
            None if responder == Responder::Both && !solves => PairOwner::Both,
            None => PairOwner::Rapier,
            Some(law) if solves => PairOwner::Solver(law),
            Some(law) if self.handed_over.contains(&in_order(pair)) => PairOwner::HandedOver(law),
            Some(law) => PairOwner::Fields(law),
        }
    }

    /// The owner of a pair for Rapier's solver, which works with the poses when the step begins: of pairs on which no
    /// field acts there it is Rapier.
    pub(super) fn for_solver(
        &self,
        pair: [ColliderHandle; 2],
        bodies: PairBodies<'_>,
    ) -> PairOwner {
        if !self.released.is_empty() && self.released.contains(&in_order(pair)) {
            return PairOwner::Rapier;
        }
        self.of(pair, bodies)
    }
}

impl PairOwner {
    /// The law by which fields or, in their place, Rapier's solver answer the pair; `None` if Rapier answers by its own
    /// rule.
    pub(super) fn law(self) -> Option<ContactLaw> {
        match self {
            PairOwner::Rapier | PairOwner::Both => None,
            PairOwner::Fields(law) | PairOwner::Solver(law) | PairOwner::HandedOver(law) => {
                Some(law)
            }
        }
    }
}

impl OwnershipRules {
    pub(crate) fn new(rules: &ResponderRules, compiled: &Compiled, swept: bool) -> Self {
        let mut detectors = compiled.detectors.iter();
        OwnershipRules {
            rules: rules.clone(),
            laws: LawTable::new(compiled),
            lossless: detectors.clone().any(|it| it.law.keeps_speed()),
            any: rules.fields_own_any() && detectors.any(|it| it.law != ContactLaw::Observe),
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

    /// Returns true if Rapier's solver answers the contacts of two bodies under a law of the fields, because joints
    /// decide how one of them moves after an impact. This holds for links of multibodies, whose velocities Rapier
    /// computes from their joints, under any law and without one; for other bodies with joints if the law loses
    /// speed. Under one that does not, the solver would lose it: of five pendulums in a row, it lifts the last one to
    /// 0.28 of the height, and fields to 0.95.
    fn leaves_to_solver(
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

    /// The resting threshold of a body under any law of this world: a contact with it that approaches more slowly is no
    /// impact, whatever accelerates the other body.
    pub(super) fn resting_speed(&self, starts: &Starts, body: RigidBodyHandle) -> Real {
        let restitution = if self.lossless { 1.0 } else { 0.0 };
        starts.resting_speed(ContactLaw::restitution(restitution), [Some(body), None])
    }

    /// Returns true if Rapier calls `modify_solver_contacts` for a collider that has pairs of the fields.
    pub(super) fn is_hooked(&self, handle: ColliderHandle, collider: &Collider) -> bool {
        let modify = ActiveHooks::MODIFY_SOLVER_CONTACTS;
        collider.active_hooks().contains(modify) && !self.hook_bits(handle).is_empty()
    }

    /// The hook bits that a collider needs so that Rapier calls the hooks for it; empty if it has no pairs of the fields.
    pub(crate) fn hook_bits(&self, collider: ColliderHandle) -> ActiveHooks {
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
fn is_dominated(bodies: [Option<&RigidBody>; 2]) -> bool {
    let [Some(one), Some(two)] = bodies else {
        return false;
    };
    one.is_dynamic() && two.is_dynamic() && one.dominance_group() != two.dominance_group()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bridge::WorldRef;
    use crate::field::{Field, FieldSet};
    use crate::rapier::dynamics::RigidBodyBuilder;
    use crate::rapier::geometry::ColliderBuilder;
    use crate::rapier::pipeline::PhysicsWorld;

    /// Two dynamic balls, each with a contact field.
    struct Pair {
        world: PhysicsWorld,
        bodies: [RigidBodyHandle; 2],
        colliders: [ColliderHandle; 2],
    }

    impl Pair {
        fn new() -> Self {
            let mut world = PhysicsWorld::new();
            let mut insert = || {
                let body = RigidBodyBuilder::dynamic();
                world.insert(body, ColliderBuilder::ball(0.5))
            };
            let both = [insert(), insert()];
            Pair {
                world,
                bodies: both.map(|it| it.0),
                colliders: both.map(|it| it.1),
            }
        }

        /// The rules under a law, with links of multibodies and bodies that have other joints.
        fn ownership(
            &self,
            law: ContactLaw,
            responder: Responder,
            links: &[RigidBodyHandle],
            jointed: &[RigidBodyHandle],
        ) -> Ownership {
            let mut set = FieldSet::new();
            for collider in self.colliders {
                set.insert(Field::contact(law).at(collider));
            }
            let rules = ResponderRules {
                everywhere: responder,
                among: Vec::new(),
            };
            let mut rules = OwnershipRules::new(&rules, &Compiled::new(&set), false);
            let [links, jointed] = [links, jointed].map(|it| it.iter().copied());
            let view = WorldRef::new(&self.world.bodies, &self.world.colliders);
            rules.set_jointed(links, jointed, &view);
            Ownership {
                rules: Arc::new(rules),
                ..Ownership::default()
            }
        }

        /// The owner in the step, and for Rapier's solver.
        fn owners(&self, ownership: &Ownership) -> [PairOwner; 2] {
            let bodies = self
                .bodies
                .map(|body| Some((body, &self.world.bodies[body])));
            // The order of a pair does not matter.
            let mut pair = self.colliders;
            let owners = [
                ownership.of(pair, bodies),
                ownership.for_solver(pair, bodies),
            ];
            pair.reverse();
            let [two, one] = bodies;
            assert_eq!(owners[0], ownership.of(pair, [one, two]));
            assert_eq!(owners[1], ownership.for_solver(pair, [one, two]));
            owners
        }
    }

    #[test]
    fn rules_laws_and_joints_decide_the_owner() {
        let pair = Pair::new();
        let [one, _] = pair.bodies;
        let elastic = ContactLaw::elastic();
        let lossy = ContactLaw::restitution(0.5);
        let owner = |law, responder, links: &[_], jointed: &[_]| {
            let [of, solver] = pair.owners(&pair.ownership(law, responder, links, jointed));
            assert_eq!(of, solver);
            of
        };
        use Responder::{Both, Fields, Rapier};
        for (law, responder, links, jointed, expected) in [
            (
                lossy,
                Fields,
                [].as_slice(),
                [].as_slice(),
                PairOwner::Fields(lossy),
            ),
            (lossy, Both, &[], &[], PairOwner::Both),
            (lossy, Rapier, &[], &[], PairOwner::Rapier),
            (ContactLaw::Observe, Fields, &[], &[], PairOwner::Rapier),
            (lossy, Fields, &[], &[one], PairOwner::Solver(lossy)),
            (elastic, Fields, &[], &[one], PairOwner::Fields(elastic)),
            (elastic, Fields, &[one], &[], PairOwner::Solver(elastic)),
            (lossy, Both, &[one], &[], PairOwner::Rapier),
            (lossy, Both, &[], &[one], PairOwner::Both),
        ] {
            let found = owner(law, responder, links, jointed);
            assert_eq!(
                found, expected,
                "{law:?} {responder:?} {links:?} {jointed:?}"
            );
        }
    }

    #[test]
    fn pairs_change_their_owner_by_release_hand_over_and_dominance() {
        let mut pair = Pair::new();
        let law = ContactLaw::restitution(0.5);
        let mut ownership = pair.ownership(law, Responder::Fields, &[], &[]);
        assert_eq!(pair.owners(&ownership), [PairOwner::Fields(law); 2]);
        // Where no field acts, only Rapier's solver leaves the pair to Rapier: one may act later in the step.
        ownership.released.insert(in_order(pair.colliders));
        let released = [PairOwner::Fields(law), PairOwner::Rapier];
        assert_eq!(pair.owners(&ownership), released);
        ownership.released.clear();
        ownership.handed_over.insert(in_order(pair.colliders));
        assert_eq!(pair.owners(&ownership), [PairOwner::HandedOver(law); 2]);
        pair.world.bodies[pair.bodies[0]].set_dominance_group(1);
        assert_eq!(pair.owners(&ownership), [PairOwner::Rapier; 2]);
    }
}
