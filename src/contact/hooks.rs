//! Contacts that fields answer are claimed from Rapier by physics hooks, together with the user's.

use std::collections::HashSet;
use std::sync::atomic::{AtomicBool, Ordering};

use super::Responder;
use super::Rules;
use crate::math::ColliderHandle;
use crate::rapier::dynamics::RigidBodyHandle;
use crate::rapier::geometry::SolverFlags;
use crate::rapier::pipeline::{
    ActiveHooks, ContactModificationContext, PairFilterContext, PhysicsHooks,
};
use crate::rigid::Lookup;

/// Which contacts Rapier is to leave to the fields.
#[derive(Clone, Debug, Default)]
pub(crate) struct Claims {
    rules: Rules,
    /// Colliders with a detection field.
    detecting: HashSet<ColliderHandle>,
}

/// Colliders that were given a hook bit, with the bits that were theirs.
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) struct Listening(Vec<(ColliderHandle, ActiveHooks)>);

impl Listening {
    fn own(&self, collider: ColliderHandle) -> Option<ActiveHooks> {
        let place = self.0.binary_search_by_key(&key(collider), |of| key(of.0));
        Some(self.0[place.ok()?].1)
    }

    pub(crate) fn add(&mut self, told: impl Iterator<Item = (ColliderHandle, ActiveHooks)>) {
        let told: Vec<_> = told.collect();
        // Of two entries of a collider the later is first, and stays.
        self.0.splice(0..0, told);
        self.0.sort_by_key(|of| key(of.0));
        self.0.dedup_by_key(|of| key(of.0));
    }
}

fn key(collider: ColliderHandle) -> (u32, u32) {
    collider.into_raw_parts()
}

impl Claims {
    pub(crate) fn new(rules: &Rules, detecting: impl Iterator<Item = ColliderHandle>) -> Self {
        let claims = rules.claim_any();
        Claims {
            rules: rules.clone(),
            detecting: detecting.filter(|_| claims).collect(),
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.detecting.is_empty()
    }

    /// The colliders that Rapier has to ask about.
    pub(crate) fn colliders(&self) -> impl Iterator<Item = ColliderHandle> {
        self.detecting.iter().copied()
    }

    /// Whether fields answer contacts of a pair in Rapier's place.
    pub(crate) fn claims(&self, pair: [ColliderHandle; 2]) -> bool {
        let detected = pair
            .iter()
            .all(|collider| self.detecting.contains(collider));
        detected && self.rules.of(pair) == Responder::Fields
    }
}

/// The hooks of an [open step](crate::OpenStep): hand them to `PhysicsPipeline::step`.
///
/// Contacts that the fields answer are found and reported by Rapier, but not solved, and stop
/// nobody in continuous collision detection. Whatever else comes goes to the user's hooks, for the
/// colliders whose own `active_hooks` ask for it.
pub struct StepHooks<'a> {
    pub(crate) claims: &'a Claims,
    pub(crate) listening: &'a Listening,
    pub(crate) asked: &'a AtomicBool,
    pub(crate) user: &'a dyn PhysicsHooks,
}

impl StepHooks<'_> {
    /// Whether the user's hooks are for one of two colliders.
    fn is_users(
        &self,
        pair: [ColliderHandle; 2],
        bits: ActiveHooks,
        has: impl Fn(ColliderHandle) -> ActiveHooks,
    ) -> bool {
        if self.listening.0.is_empty() {
            return true;
        }
        let own = |collider| {
            let own = self.listening.own(collider);
            own.unwrap_or_else(|| has(collider))
        };
        pair.into_iter()
            .any(|collider| own(collider).contains(bits))
    }
}

impl PhysicsHooks for StepHooks<'_> {
    fn filter_contact_pair(&self, context: &PairFilterContext<'_>) -> Option<SolverFlags> {
        let pair = [context.collider1, context.collider2];
        let has = |collider| active_hooks(context.colliders.get(collider));
        let claimed = self.claims.claims(pair);
        if claimed {
            self.asked.store(true, Ordering::Relaxed);
        }
        let flags = if self.is_users(pair, ActiveHooks::FILTER_CONTACT_PAIRS, has) {
            self.user.filter_contact_pair(context)?
        } else {
            SolverFlags::COMPUTE_RIGID_IMPULSES
        };
        if !claimed {
            return Some(flags);
        }
        // Rapier asks once more when bodies have moved, to stop the fast ones.
        let moved = |body: Option<RigidBodyHandle>| {
            let body = body.and_then(|body| context.bodies.get(body));
            body.is_some_and(|body| body.is_dynamic() && body.next_position() != body.position())
        };
        let stops = moved(context.rigid_body1) || moved(context.rigid_body2);
        (!stops).then(SolverFlags::empty)
    }

    fn filter_intersection_pair(&self, context: &PairFilterContext<'_>) -> bool {
        self.user.filter_intersection_pair(context)
    }

    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        self.user.modify_solver_contacts(context);
    }
}

fn active_hooks(collider: Option<&crate::rapier::geometry::Collider>) -> ActiveHooks {
    collider.map_or(ActiveHooks::empty(), |collider| collider.active_hooks())
}

/// Whether Rapier holds a touching pair that fields claim.
pub(crate) fn holds_claimed(
    claims: &Claims,
    narrow_phase: &crate::rapier::geometry::NarrowPhase,
) -> bool {
    let mut pairs = narrow_phase.contact_pairs();
    pairs.any(|pair| {
        pair.has_any_active_contact() && claims.claims([pair.collider1, pair.collider2])
    })
}

/// Colliders of a world that are to be told that hooks are there for them.
pub(crate) fn silent<'a>(
    colliders: impl Iterator<Item = ColliderHandle> + 'a,
    world: &'a impl Lookup,
) -> impl Iterator<Item = (ColliderHandle, ActiveHooks)> + 'a {
    colliders.filter_map(|handle| {
        let hooks = world.collider(handle)?.active_hooks();
        let told = hooks.contains(ActiveHooks::FILTER_CONTACT_PAIRS);
        (!told).then_some((handle, hooks))
    })
}
