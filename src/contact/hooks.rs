//! Physics hooks that call the user's hooks, and then take contacts which fields answer off Rapier's solver.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use super::hooked::HookedColliders;
use super::ownership::{Ownership, OwnershipRules, PairOwner};
use super::rules::{Pairs, in_order};
use super::starts::Starts;
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, ColliderSet, Real, Vector};
use crate::rapier::dynamics::{RigidBody, RigidBodyHandle, RigidBodyType};
use crate::rapier::geometry::{Collider, ContactPair, NarrowPhase, Shape, ShapeType, SolverFlags};
use crate::rapier::pipeline::{
    ActiveHooks, ContactModificationContext, PairFilterContext, PhysicsHooks,
};
use crate::rigid::Lookup;

/// The record of the calls of the hooks in one step, and of their decisions.
#[derive(Debug, Default)]
pub(crate) struct HookLog {
    /// True once Rapier has called a hook for a pair of the fields.
    pub asked: AtomicBool,
    outcomes: Mutex<PairOutcomes>,
    /// True if hidden pairs are recorded.
    notes_hidden: bool,
}

impl HookLog {
    /// An empty record; `notes_hidden` turns on the record of hidden pairs.
    pub(crate) fn new(notes_hidden: bool) -> Self {
        HookLog {
            notes_hidden,
            ..HookLog::default()
        }
    }

    /// Adds a pair to one of the lists of outcomes.
    fn note(&self, pair: [ColliderHandle; 2], list: impl FnOnce(&mut PairOutcomes) -> &mut Pairs) {
        let outcomes = self.outcomes.lock();
        let mut outcomes = outcomes.unwrap_or_else(PoisonError::into_inner);
        list(&mut outcomes).insert(in_order(pair));
    }

    /// Takes the decisions out of the record.
    pub(crate) fn take(&mut self) -> PairOutcomes {
        let outcomes = self.outcomes.get_mut();
        let mut outcomes = std::mem::take(outcomes.unwrap_or_else(PoisonError::into_inner));
        // A shape of several pieces may have several manifolds; a pair with any lifted point counts as lifted.
        let PairOutcomes { lifted, held, .. } = &mut outcomes;
        held.retain(|pair| !lifted.contains(pair));
        outcomes
    }
}

impl PairOutcomes {
    /// Adds the pairs of the fields that Rapier's solver held without calling the hooks, because their colliders have
    /// no hook bits.
    pub(crate) fn add_unasked(
        &mut self,
        ownership: &Ownership,
        narrow_phase: &NarrowPhase,
        world: &impl Lookup,
    ) {
        for found in narrow_phase.contact_pairs() {
            let pair = [found.collider1, found.collider2];
            let colliders = pair.map(|handle| Some((handle, world.collider(handle)?)));
            let asked = |(handle, collider)| ownership.rules.is_hooked(handle, collider);
            if colliders.into_iter().any(|it| it.is_none_or(asked)) {
                continue;
            }
            let bodies = colliders.map(|it| {
                let handle = it?.1.parent()?;
                Some((handle, world.body(handle)?))
            });
            let awake = |(_, body): &(_, &RigidBody)| body.is_dynamic() && !body.is_sleeping();
            if bodies.iter().flatten().any(awake)
                && found.has_any_active_contact()
                && ownership.for_solver(pair, bodies).law().is_some()
            {
                self.held.insert(in_order(pair));
            }
        }
    }
}

/// The decisions on pairs of the fields in one step of Rapier's.
#[derive(Debug, Default)]
pub(crate) struct PairOutcomes {
    /// The user's hooks removed the contact: neither side answers it.
    pub vetoed: Pairs,
    /// At least one contact point was lifted off Rapier's solver: the contact is an impact, even if it becomes slow
    /// within the step.
    pub lifted: Pairs,
    /// All contact points were left to Rapier's solver.
    pub held: Pairs,
    /// The user's hooks hide the pair from Rapier, whether fields own it or not; recorded only for the cross-check.
    pub hidden: Pairs,
}

/// The hooks of an [open step](crate::pipeline::OpenStep): hand them to `PhysicsPipeline::step`.
///
/// Rapier finds and reports contacts that the fields answer as any other. Its solver holds those that last, with the
/// friction of the law and no restitution. Contact points that approach or separate fast are moved apart so that the
/// solver finds nothing to do there: they are impacts, which the fields answer. A pair that was answered in three steps
/// running by a law that loses speed and still overlaps, or that went deeper than before three times, is left to Rapier
/// until it separates, unless its law is [`Penalty`](crate::ContactLaw::Penalty).
///
/// The user's hooks are called first, for the colliders whose own `active_hooks` request it. A contact that they remove
/// is answered by neither side.
pub struct StepHooks<'a> {
    pub(crate) ownership: &'a Ownership,
    pub(crate) hooked: &'a HookedColliders,
    pub(crate) starts: &'a Starts,
    pub(crate) log: &'a HookLog,
    pub(crate) user: &'a dyn PhysicsHooks,
}

impl StepHooks<'_> {
    /// Returns true if the user's own hook bits request this hook on one of two colliders.
    fn is_users(
        &self,
        pair: [ColliderHandle; 2],
        bits: ActiveHooks,
        colliders: &ColliderSet,
    ) -> bool {
        if self.hooked.is_empty() {
            return true;
        }
        let has = |collider| colliders.get(collider).map(|it| it.active_hooks());
        pair.into_iter().any(|collider| {
            let own = self.hooked.own(collider).or_else(|| has(collider));
            own.is_some_and(|own| own.contains(bits))
        })
    }

    /// Lifts the points of a manifold that approach or separate at the resting threshold or faster off Rapier's solver,
    /// and leaves the others to it. A lifted point carries no load, so each point is decided by itself: a rocking box
    /// rests on one corner while another falls. Also sets the friction and restitution of the manifold.
    fn lift_impacts(&self, owner: PairOwner, context: &mut ContactModificationContext<'_>) {
        let Some(law) = owner.law() else {
            return;
        };
        let pair = [context.collider1, context.collider2];
        let handles = [context.rigid_body1, context.rigid_body2];
        let (bodies, dt) = (context.bodies, self.starts.dt());
        let solves = matches!(owner, PairOwner::Solver(_));
        let has_coefficients = matches!(law, ContactLaw::Impulse { .. });
        if solves && !has_coefficients {
            return self.log.note(pair, |outcomes| &mut outcomes.held);
        }
        let deepest = if solves {
            Real::NEG_INFINITY
        } else if self.ownership.rules.swept {
            Real::INFINITY
        } else {
            bearable_depth(law, pair, context.colliders)
        };
        let Some(manifold) = context.rigid_mut() else {
            return;
        };
        if manifold.solver_contacts.is_empty() {
            return;
        }
        let resting_speed = match owner {
            PairOwner::HandedOver(_) => Real::INFINITY,
            _ => self.starts.resting_speed(law, handles),
        };
        let velocity = |which: usize, point| {
            let body = handles[which].and_then(|handle| bodies.get(handle));
            body.map_or(Vector::ZERO, |body| velocity_at(body, point, dt))
        };
        let normal = *manifold.normal;
        let (mut lifted, mut bounces) = (false, false);
        for contact in manifold.solver_contacts.iter_mut() {
            let point = (contact.anchor1 + contact.anchor2) * 0.5;
            let closing = (velocity(0, point) - velocity(1, point)).dot(normal);
            // A speed that is infinite or NaN is left to Rapier.
            let fast = closing.is_finite() && closing.abs() >= resting_speed;
            if !fast {
                continue;
            }
            if closing * dt - contact.dist > deepest {
                bounces = true;
                continue;
            }
            // Both anchors move equally, because the solver takes its lever arms from their middle. The lift exceeds
            // the approach within the step by far, so the solver sees no contact.
            let lift = 10.0 + 4.0 * closing.abs() * dt + 10.0 * self.starts.rebound();
            contact.anchor1 -= normal * (0.5 * lift);
            contact.anchor2 += normal * (0.5 * lift);
            contact.dist += lift;
            lifted = true;
        }
        self.log.note(pair, |outcomes| {
            if lifted {
                &mut outcomes.lifted
            } else {
                &mut outcomes.held
            }
        });
        let [restitution, friction] = match law {
            ContactLaw::Impulse {
                restitution,
                friction,
            } => [restitution, friction],
            _ => [0.0; 2],
        };
        *manifold.restitution = if bounces { restitution } else { 0.0 };
        *manifold.friction = friction;
    }
}

/// The depth that a contact may reach within a step if the fields answer it at the end. It is finite only if exactly
/// one of the shapes has no inside (mesh, height field, triangle), because a body whose middle has passed such a
/// surface would be pushed out on the far side: half of the other shape's least half extent, or the whole of it for a
/// law that loses no speed, because Rapier's solver would take energy.
fn bearable_depth(law: ContactLaw, pair: [ColliderHandle; 2], colliders: &ColliderSet) -> Real {
    let shapes = pair.map(|handle| colliders.get(handle).map(|it| it.shape()));
    let [Some(one), Some(two)] = shapes else {
        return Real::INFINITY;
    };
    let hollow = |shape: &dyn Shape| {
        matches!(
            shape.shape_type(),
            ShapeType::TriMesh | ShapeType::HeightField | ShapeType::Triangle
        )
    };
    let body = match (law, hollow(one), hollow(two)) {
        (ContactLaw::Penalty { .. }, ..) => return Real::INFINITY,
        (_, true, false) => two,
        (_, false, true) => one,
        _ => return Real::INFINITY,
    };
    let share = if law.keeps_speed() { 1.0 } else { 0.5 };
    share * body.compute_local_aabb().half_extents().min_element()
}

/// The velocity of a point of a body; for a position-based kinematic body, from its way to its next position.
pub(super) fn velocity_at(body: &RigidBody, point: Vector, dt: Real) -> Vector {
    if body.body_type() != RigidBodyType::KinematicPositionBased || dt <= 0.0 {
        let turns = body.angvel() != Vector::ZERO;
        return if turns {
            body.velocity_at_point(point)
        } else {
            body.linvel()
        };
    }
    let local = body.position().inverse_transform_point(point);
    (body.next_position().transform_point(local) - point) / dt
}

impl PhysicsHooks for StepHooks<'_> {
    fn filter_contact_pair(&self, context: &PairFilterContext<'_>) -> Option<SolverFlags> {
        let pair = [context.collider1, context.collider2];
        let handles = [context.rigid_body1, context.rigid_body2];
        let bodies = handles.map(|handle| Some((handle?, context.bodies.get(handle?)?)));
        let owner = self.ownership.for_solver(pair, bodies);
        let bits = ActiveHooks::FILTER_CONTACT_PAIRS;
        let flags = if self.is_users(pair, bits, context.colliders) {
            self.user.filter_contact_pair(context)
        } else {
            Some(SolverFlags::COMPUTE_RIGID_IMPULSES)
        };
        if flags.is_none() && self.log.notes_hidden {
            self.log.note(pair, |outcomes| &mut outcomes.hidden);
        }
        if owner.law().is_some() {
            self.log.asked.store(true, Ordering::Relaxed);
            if flags.is_none_or(|flags| flags.is_empty()) {
                self.log.note(pair, |outcomes| &mut outcomes.vetoed);
            }
        }
        // Rapier calls this once more after bodies have moved, for its own continuous collision detection.
        let moved = |body: Option<RigidBodyHandle>| {
            let body = body.and_then(|body| context.bodies.get(body));
            body.is_some_and(|body| body.is_dynamic() && body.next_position() != body.position())
        };
        let followed = self.ownership.rules.swept && matches!(owner, PairOwner::Fields(_));
        let stops = followed && (moved(context.rigid_body1) || moved(context.rigid_body2));
        flags.filter(|_| !stops)
    }

    fn filter_intersection_pair(&self, context: &PairFilterContext<'_>) -> bool {
        self.user.filter_intersection_pair(context)
    }

    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        let pair = [context.collider1, context.collider2];
        let bits = ActiveHooks::MODIFY_SOLVER_CONTACTS;
        let count = |context: &ContactModificationContext<'_>| {
            context.rigid().map_or(0, |it| it.solver_contacts.len())
        };
        let found = count(context);
        if self.is_users(pair, bits, context.colliders) {
            self.user.modify_solver_contacts(context);
        }
        if self.ownership.rules.law(pair).is_some() {
            self.log.asked.store(true, Ordering::Relaxed);
        }
        let handles = [context.rigid_body1, context.rigid_body2];
        let bodies = handles.map(|handle| Some((handle?, context.bodies.get(handle?)?)));
        let owner = self.ownership.for_solver(pair, bodies);
        if owner.law().is_none() {
            return;
        }
        if found > 0 && count(context) == 0 {
            self.log.note(pair, |outcomes| &mut outcomes.vetoed);
        }
        self.lift_impacts(owner, context);
    }
}

/// A touching pair for which Rapier is to call the hooks in this step, if there is one.
pub(crate) fn to_ask(
    rules: &OwnershipRules,
    narrow_phase: &NarrowPhase,
    world: &impl Lookup,
) -> Option<[ColliderHandle; 2]> {
    if rules.is_empty() {
        return None;
    }
    let mut pairs = narrow_phase.contact_pairs();
    let found = pairs.find(|pair| is_asked_about(rules, pair, world))?;
    Some([found.collider1, found.collider2])
}

/// Returns true if Rapier must have called the hooks for a pair that [`to_ask`] returned before the step: the pair
/// still touches, still has hook bits, and has an awake body. A pair that was removed, moved away, disabled, made a
/// sensor, joined or filtered in the meantime does not count.
pub(crate) fn was_to_ask(
    rules: &OwnershipRules,
    [one, two]: [ColliderHandle; 2],
    narrow_phase: &NarrowPhase,
    world: &impl Lookup,
) -> bool {
    let pair = narrow_phase.contact_pair(one, two);
    pair.is_some_and(|pair| is_asked_about(rules, pair, world))
}

/// Returns true if a pair touches, fields own it, one of its colliders has hook bits, and one of its bodies is awake.
fn is_asked_about(rules: &OwnershipRules, pair: &ContactPair, world: &impl Lookup) -> bool {
    let handles = [pair.collider1, pair.collider2];
    let colliders = handles.map(|handle| Some((handle, world.collider(handle)?)));
    let colliders = || colliders.iter().flatten();
    let awake = |(_, collider): &(_, &Collider)| {
        let body = collider.parent().and_then(|body| world.body(body));
        body.is_some_and(|body| body.is_dynamic() && !body.is_sleeping())
    };
    pair.has_any_active_contact()
        && colliders().any(|(handle, collider)| rules.is_hooked(*handle, collider))
        && colliders().any(awake)
        && rules.law(handles).is_some()
}
