//! Fields as data: what files and snapshots hold of them.

use std::sync::Arc;

use super::{Fields, FieldsBuilder};
use crate::compile::Prepared;
use crate::contact::{Detection, Rules};
use crate::cross_check::CrossCheck;
use crate::field::{Properties, Tree};
use crate::inject::{InjectorState, Scheme, WakePolicy};
use crate::math::{ColliderSet, Real, RigidBodySet, from_f64};

/// The settings of fields.
pub(crate) struct Settings<'a> {
    pub tree: Tree,
    pub axes: Vec<(Arc<str>, Real)>,
    pub scheme: Scheme,
    pub wake: WakePolicy,
    pub rules: &'a Rules,
    pub detection: Detection,
    pub cross_check: Option<&'a CrossCheck>,
    pub audit: bool,
    pub book: &'a Properties,
    pub time: f64,
    /// Whether the colliders whose contacts fields answer have been told.
    pub claimed: bool,
}

impl Fields {
    pub(crate) fn settings(&self) -> Settings<'_> {
        let injector = &self.injector;
        let axes = self.set.data().axes().iter();
        Settings {
            tree: self.set.tree(),
            axes: axes
                .map(|(name, value)| (name.clone(), from_f64(*value)))
                .collect(),
            scheme: injector.scheme,
            wake: injector.wake,
            rules: &self.rules,
            detection: self.detection,
            cross_check: self.check.as_ref().map(|check| check.settings()),
            audit: self.auditor.is_some(),
            book: self.set.data(),
            time: injector.time,
            claimed: self.claimed,
        }
    }

    /// Sets the simulated time.
    pub(crate) fn set_time(&mut self, time: f64) {
        self.injector.time = time;
        self.injector.invalidate();
    }

    /// What the next step takes over from the last one.
    pub(crate) fn state(&self) -> InjectorState {
        self.injector.state()
    }

    /// Goes on from a state, in the world it was taken in.
    pub(crate) fn resume(
        &mut self,
        state: InjectorState,
        claimed: bool,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) {
        self.claimed = claimed;
        self.injector.resume(
            state,
            Prepared {
                set: &self.set,
                compiled: &self.compiled,
            },
            bodies,
            colliders,
        );
    }
}

impl FieldsBuilder {
    /// Sets who answers which contacts, all rules at once.
    pub(crate) fn rules(mut self, rules: Rules) -> Self {
        self.rules = rules;
        self
    }
}
