//! The pairs that can be compared, and the reasons why others cannot.

use super::bands::Bands;
use super::counts::Reason;
use super::settings::CrossCheck;
use super::sighting::{Expected, RapierPoint};
use crate::contact::{Joints, Pairs, in_order};
use crate::math::{ColliderHandle, RigidBodyHandle};
use crate::rapier::dynamics::IntegrationParameters;
use crate::rapier::geometry::{Collider, NarrowPhase};
use crate::rigid::Lookup;

/// Colliders with a detection field, each once and in the order of their handles, so that a walk over them visits a
/// world's colliders in the order of memory.
#[derive(Debug, Default)]
pub(crate) struct Watched(Vec<WatchedCollider>);

#[derive(Clone, Copy, Debug)]
struct WatchedCollider {
    collider: ColliderHandle,
    /// True if the field acts everywhere.
    everywhere: bool,
}

impl Watched {
    /// Made from the colliders of all detection fields, each with true if the field acts everywhere.
    pub(crate) fn new(detectors: impl Iterator<Item = (ColliderHandle, bool)>) -> Self {
        let of_field = |(collider, everywhere)| WatchedCollider {
            collider,
            everywhere,
        };
        let mut all: Vec<_> = detectors.map(of_field).collect();
        all.sort_unstable_by_key(|it| it.collider.into_raw_parts());
        all.dedup_by(|other, kept| {
            let same = other.collider == kept.collider;
            kept.everywhere |= same && other.everywhere;
            same
        });
        Watched(all)
    }

    fn of(&self, collider: ColliderHandle) -> Option<WatchedCollider> {
        let key = collider.into_raw_parts();
        let place = self
            .0
            .binary_search_by_key(&key, |it| it.collider.into_raw_parts());
        place.ok().map(|place| self.0[place])
    }

    pub(crate) fn contains(&self, collider: ColliderHandle) -> bool {
        self.of(collider).is_some()
    }

    pub(crate) fn colliders(&self) -> impl Iterator<Item = ColliderHandle> {
        self.0.iter().map(|it| it.collider)
    }
}

/// Returns true if a collider of the pair has a detection field and the settings watch the pair.
pub(super) fn is_watched(
    settings: &CrossCheck,
    watched: &Watched,
    pair: [ColliderHandle; 2],
) -> bool {
    pair.iter().any(|it| watched.contains(*it)) && settings.watches(pair)
}

/// The inputs of the comparison of a step: what is compared, and the world after Rapier's step.
pub(crate) struct Judging<'a, W> {
    pub settings: &'a CrossCheck,
    pub watched: &'a Watched,
    pub expected: &'a Expected,
    pub world: &'a W,
    pub narrow_phase: &'a NarrowPhase,
    pub joints: Joints<'a>,
    pub parameters: &'a IntegrationParameters,
    /// Pairs that the user's hooks have hidden from Rapier.
    pub hidden: &'a Pairs,
}

impl<W: Lookup> Judging<'_, W> {
    /// See [`is_watched`].
    pub(super) fn watches(&self, pair: [ColliderHandle; 2]) -> bool {
        is_watched(self.settings, self.watched, pair)
    }

    /// The reason why a pair of which one side found an overlap cannot be compared; `None` if it can. `seen` is true if
    /// the fields found it, and `spots` are the contact points that Rapier holds.
    pub(super) fn obstacle(
        &self,
        pair: [ColliderHandle; 2],
        seen: bool,
        spots: &[RapierPoint],
        bands: &Bands,
    ) -> Option<Reason> {
        let world = self.world;
        let [one, two] = pair.map(|handle| world.collider(handle));
        let colliders = [one?, two?];
        let bodies = colliders.map(Collider::parent);
        if self.parameters.max_ccd_substeps > 1 {
            return Some(|it| &mut it.ccd_substeps);
        }
        if self.may_recycle(colliders) {
            return Some(|it| &mut it.recycled);
        }
        if !bodies.into_iter().any(|body| self.was_awake(body)) {
            return Some(|it| &mut it.asleep);
        }
        if spots.iter().any(|spot| spot.stale > 2.0 * bands.rounding) {
            return Some(|it| &mut it.moved);
        }
        let found = bodies.map(|handle| world.body(handle?));
        let mut found = found.iter().flatten();
        if found.clone().any(|it| it.is_soft_frame()) {
            return Some(|it| &mut it.soft);
        }
        if seen {
            return self.rapier_is_kept_away(pair, bodies);
        }
        if !found.any(|it| it.is_dynamic()) {
            return Some(|it| &mut it.immovable);
        }
        let masked =
            |handle: &ColliderHandle| !self.watched.of(*handle).is_some_and(|it| it.everywhere);
        pair.iter().all(masked).then_some(|it| &mut it.masked)
    }

    fn may_recycle(&self, colliders: [&Collider; 2]) -> bool {
        self.settings.lets_recycle
            && self.parameters.contact_recycling
            && colliders.iter().all(|it| it.active_hooks().is_empty())
    }

    /// Returns true if a body kept Rapier updating its contacts throughout the step.
    fn was_awake(&self, body: Option<RigidBodyHandle>) -> bool {
        let Some(handle) = body else {
            return false;
        };
        let found = self.world.body(handle);
        let moves = found.is_some_and(|body| !body.is_fixed());
        moves && !self.expected.asleep.contains(&handle)
    }

    fn rapier_is_kept_away(
        &self,
        pair: [ColliderHandle; 2],
        bodies: [Option<RigidBodyHandle>; 2],
    ) -> Option<Reason> {
        if self.hidden.contains(&pair) {
            return Some(|it| &mut it.hidden);
        }
        let apart = self.joints.keep_apart(bodies);
        apart.then_some(|it| &mut it.jointed)
    }

    /// The number of watched sensor pairs that overlap.
    pub(super) fn sensors(&self) -> u64 {
        let pairs = self.narrow_phase.intersection_pairs();
        let overlapping =
            pairs.filter(|(one, two, overlaps)| *overlaps && self.watches(in_order([*one, *two])));
        overlapping.count() as u64
    }
}
