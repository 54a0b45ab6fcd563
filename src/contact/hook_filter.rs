//! Colliders that need no physics hook in a step.
//!
//! Rapier reuses the contacts of a pair that hardly moved, unless a hook is active on one of its colliders. The
//! [hooks](super::StepHooks) leave slow contacts to Rapier's solver, with the friction of the law and no restitution.
//! So where nothing that may touch is fast, Rapier's own friction equals that of the law, and its restitution is zero,
//! a hook would change nothing and is not requested: Rapier's part of the step is then the same as without fields.

use super::laws::combined;
use super::ownership::OwnershipRules;
use super::starts::{Starts, pivot};
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, Real, RigidBodyHandle};
use crate::rapier::dynamics::{
    CoefficientCombineRule, IntegrationParameters, RigidBody, RigidBodyType,
};
use crate::rapier::geometry::{Collider, ColliderMaterial};
use crate::rigid::{Lookup, local_pose};

/// A body counts as slow only below this share of the impact threshold, so that rounding cannot make it an impact.
const SURELY: Real = 0.98;

/// With more kinds of colliders than this, kinds are not compared, and every collider keeps its hook.
const MOST_KINDS: usize = 16;

/// Finds the colliders of a step that need no hook; its buffers are reused.
#[derive(Debug, Default)]
pub(crate) struct HookFilter {
    /// Slow bodies in the order of their handles, each with the speed that a body touching it may have without the
    /// contact being an impact; infinite for bodies that are not dynamic and stand still.
    slow: Vec<(RigidBodyHandle, Real)>,
    kinds: Vec<ContactKind>,
    /// By kind: true if the kind [agrees](ContactKind::agrees) with every kind in the step.
    agree: Vec<bool>,
    /// Colliders that may go without a hook, each with the index of its kind: those of slow bodies and those without a
    /// body.
    candidates: Vec<(ColliderHandle, usize)>,
    /// By the index of a collider: true if it needs no hook.
    quiet: Vec<bool>,
}

/// The properties of a collider that decide its friction and restitution.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ContactKind {
    law: Option<ContactLaw>,
    material: ColliderMaterial,
}

impl ContactKind {
    /// Returns true if Rapier's own coefficients for a pair give what the hooks would: the friction of the law, and no
    /// restitution. Pairs that fields do not answer agree; penalty laws never do.
    fn agrees(&self, other: &ContactKind) -> bool {
        let friction = match combined([self.law, other.law]) {
            None | Some(ContactLaw::Observe) => return true,
            Some(ContactLaw::Penalty { .. }) => return false,
            Some(ContactLaw::Impulse { friction, .. }) => friction,
            Some(_) => 0.0,
        };
        let [one, two] = [&self.material, &other.material];
        let combine = CoefficientCombineRule::combine;
        let rules = [one.friction_combine_rule, two.friction_combine_rule];
        let rubs = combine(one.friction, two.friction, rules[0], rules[1]);
        let rules = [one.restitution_combine_rule, two.restitution_combine_rule];
        let bounces = combine(one.restitution, two.restitution, rules[0], rules[1]);
        rubs == friction && bounces == 0.0
    }
}

impl HookFilter {
    /// Finds the quiet colliders from the bodies as they are when Rapier's step begins.
    pub(crate) fn find(
        &mut self,
        rules: &OwnershipRules,
        starts: &Starts,
        world: &impl Lookup,
        parameters: &IntegrationParameters,
    ) {
        self.quiet.clear();
        self.find_slow(rules, starts, world, parameters);
        if self.slow.iter().all(|(_, left)| *left == Real::INFINITY) {
            return;
        }
        self.kinds.clear();
        self.candidates.clear();
        let mut slow = self.slow.iter().peekable();
        for (handle, body) in world.bodies().filter(|(_, body)| body.is_enabled()) {
            let is_slow = slow.next_if(|(slow, _)| *slow == handle).is_some();
            for handle in body.colliders() {
                let Some(collider) = world.collider(*handle) else {
                    continue;
                };
                let kind = kind_of(&mut self.kinds, rules, *handle, collider);
                // A sleeping body may have contacts that were lifted off the solver, so it keeps its hook.
                let keeps_hook = body.is_sleeping() && rules.is_hooked(*handle, collider);
                if is_slow && !keeps_hook {
                    self.candidates.push((*handle, kind));
                }
            }
        }
        for (handle, collider) in world.free_colliders() {
            let kind = kind_of(&mut self.kinds, rules, handle, collider);
            self.candidates.push((handle, kind));
        }
        if self.kinds.len() > MOST_KINDS {
            return;
        }
        let agrees = |kind: &ContactKind| self.kinds.iter().all(|other| kind.agrees(other));
        self.agree.clear();
        self.agree.extend(self.kinds.iter().map(agrees));
        for (handle, _) in self.candidates.iter().filter(|(_, kind)| self.agree[*kind]) {
            let index = handle.into_raw_parts().0 as usize;
            self.quiet.resize(self.quiet.len().max(index + 1), false);
            self.quiet[index] = true;
        }
    }

    /// Collects the bodies of which no two approach fast, nor any of them and a collider that no field rules.
    fn find_slow(
        &mut self,
        rules: &OwnershipRules,
        starts: &Starts,
        world: &impl Lookup,
        parameters: &IntegrationParameters,
    ) {
        self.slow.clear();
        if rules.is_empty() {
            return;
        }
        let near = parameters.prediction_distance();
        // A collider without pairs of the fields has no hook, however fast it is.
        let mut unhooked: Real = 0.0;
        for (handle, body) in world.bodies().filter(|(_, body)| body.is_enabled()) {
            let mut colliders = body.colliders().iter();
            let any_unhooked = colliders.any(|it| rules.hook_bits(*it).is_empty());
            let limit = SURELY * rules.resting_speed(starts, handle);
            let dynamic = body.is_dynamic() && body.soft_ccd_prediction() <= 0.0;
            // Most moving bodies are fast enough by their linear velocity alone.
            if body.is_dynamic() && !any_unhooked && 2.0 * body.linvel().length() >= limit {
                continue;
            }
            let speed = fastest(body, world, near, parameters.dt);
            if any_unhooked {
                unhooked = unhooked.max(speed);
            }
            if dynamic && 2.0 * speed < limit {
                self.slow.push((handle, limit - speed));
            } else if !body.is_dynamic() && speed == 0.0 {
                self.slow.push((handle, Real::INFINITY));
            }
        }
        self.slow.retain(|(_, left)| unhooked < *left);
    }

    /// Returns true if a collider needs no hook.
    pub(crate) fn is_quiet(&self, collider: ColliderHandle) -> bool {
        let index = collider.into_raw_parts().0 as usize;
        self.quiet.get(index) == Some(&true)
    }

    /// Returns true if there may be colliders that need no hook.
    pub(crate) fn any(&self) -> bool {
        !self.quiet.is_empty()
    }
}

/// An upper bound of the speed of a body's points, and of points within `near` of its colliders. A position-based
/// kinematic body moves to its next position within `dt`.
fn fastest(body: &RigidBody, world: &impl Lookup, near: Real, dt: Real) -> Real {
    let (linear, turning) = match body.body_type() {
        RigidBodyType::KinematicPositionBased if dt > 0.0 => {
            let (now, next) = (body.position(), body.next_position());
            let turn = now.rotation.inverse() * next.rotation;
            let shift = (next.translation - now.translation).length();
            (shift / dt, 2.0 * turn.xyz().length() / dt)
        }
        _ => (body.linvel().length(), body.angvel().length()),
    };
    if turning == 0.0 {
        return linear;
    }
    let colliders = body.colliders().iter();
    let reaches = colliders.filter_map(|handle| {
        let collider = world.collider(*handle)?;
        let bounds = collider.shape().compute_local_bounding_sphere();
        let arm = local_pose(collider).translation.length();
        Some(arm + bounds.center.length() + bounds.radius + collider.contact_skin())
    });
    let reach = reaches.fold(0.0, Real::max) + pivot(body).length() + near;
    linear + turning * reach
}

/// The index of a collider's kind; a new kind is added while there is room.
fn kind_of(
    kinds: &mut Vec<ContactKind>,
    rules: &OwnershipRules,
    handle: ColliderHandle,
    collider: &Collider,
) -> usize {
    let kind = ContactKind {
        law: rules.laws.of(handle),
        material: *collider.material(),
    };
    let known = kinds.iter().position(|known| *known == kind);
    known.unwrap_or_else(|| {
        if kinds.len() <= MOST_KINDS {
            kinds.push(kind);
        }
        kinds.len() - 1
    })
}
