//! Fields as data: what files and snapshots hold of them.

use std::sync::Arc;

use super::Fields;
use crate::contact::{Detection, Responder};
use crate::cross_check::CrossCheck;
use crate::field::{Sampling, Tree};
#[cfg(feature = "serde-serialize")]
use crate::inject::InjectorState;
use crate::inject::{Scheme, WakePolicy};
use crate::math::{ColliderHandle, Real, RigidBodyHandle, from_f64};
#[cfg(feature = "serde-serialize")]
use crate::math::{ColliderSet, RigidBodySet};
use crate::sample::ColliderProperties;

/// The settings of fields, to read.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Settings<'a> {
    /// The tree.
    pub tree: &'a Tree,
    /// The user's axes, and the world's values on them.
    pub axes: Vec<(Arc<str>, Real)>,
    /// How forces become motion.
    pub scheme: Scheme,
    /// Which bodies are woken.
    pub wake: WakePolicy,
    /// Who answers contacts.
    pub responder: Responder,
    /// Who answers contacts between any two of some colliders; the last that fits counts.
    pub responder_among: Vec<(Vec<ColliderHandle>, Responder)>,
    /// When contacts are looked for.
    pub detection: Detection,
    /// What is compared with Rapier's contacts.
    pub cross_check: Option<&'a CrossCheck>,
    /// Whether energies are balanced.
    pub audit: bool,
    /// The properties of colliders that have some.
    pub properties: Vec<(ColliderHandle, &'a ColliderProperties)>,
    /// Where bodies ask to be sampled.
    pub samplings: Vec<(RigidBodyHandle, Sampling)>,
    /// The simulated time.
    pub time: f64,
}

impl Fields {
    /// Everything that was set, the tree included.
    pub fn settings(&self) -> Settings<'_> {
        let injector = &self.injector;
        let axes = injector.book.world_values();
        let among = self.rules.among.iter().map(|(set, responder)| {
            let mut colliders: Vec<ColliderHandle> = set.iter().copied().collect();
            colliders.sort_unstable_by_key(|handle| handle.into_raw_parts());
            (colliders, *responder)
        });
        Settings {
            tree: &self.compiled.tree,
            axes: axes
                .map(|(name, value)| (name.clone(), from_f64(*value)))
                .collect(),
            scheme: injector.scheme,
            wake: injector.wake,
            responder: self.rules.everywhere,
            responder_among: among.collect(),
            detection: self.detection,
            cross_check: self.check.as_ref().map(|check| check.settings()),
            audit: self.auditor.is_some(),
            properties: injector.book.properties().collect(),
            samplings: injector.book.samplings().collect(),
            time: injector.time,
        }
    }

    /// Sets the simulated time.
    pub fn set_time(&mut self, time: f64) {
        self.injector.time = time;
        self.injector.invalidate();
    }

    /// What the next step takes over from the last one, and whether the colliders whose contacts
    /// fields answer have been told.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn state(&self) -> (InjectorState, bool) {
        (self.injector.state(), self.claimed)
    }

    /// Goes on from a state, in the world it was taken in.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn resume(
        &mut self,
        (state, claimed): (InjectorState, bool),
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) {
        self.claimed = claimed;
        self.injector
            .resume(state, &self.compiled, bodies, colliders);
    }
}
