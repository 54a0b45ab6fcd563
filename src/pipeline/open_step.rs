//! A step that was begun and not yet finished.

use std::sync::Arc;

use crate::bridge::{Rollback, SoftFlight, Stepped};
use crate::contact::{HookLog, HookedColliders, Ownership, Starts, StepHooks};
use crate::cross_check::Expected;
use crate::diagnose::AuditReading;
use crate::integrate::{FaultPolicy, Motions};
use crate::math::{ColliderHandle, Real};
use crate::rapier::pipeline::PhysicsHooks;
use crate::rigid::Body;

/// A step that [`Fields::begin`](crate::Fields::begin) began: pass its [hooks](Self::hooks) to Rapier's step, then pass
/// it to [`Fields::finish`](crate::Fields::finish).
///
/// It owns the data for the second half of the step. Bodies that are removed in the meantime are left out; bodies that
/// are added take part from the next step on; fields that are edited act, as edited, from the second half on. If a step
/// is dropped instead of finished, the next `begin` takes back its forces and switches in the world, and returns an
/// error.
#[must_use = "a step that was begun is to be finished"]
pub struct OpenStep {
    pub(super) number: u64,
    pub(super) dt: Real,
    /// True if only Rapier's step can change the world until the step is finished.
    pub(super) alone: bool,
    /// True if no field can reach any body within the step.
    pub(super) idle: bool,
    /// True if fields acted at centres of mass only.
    pub(super) at_centres: bool,
    pub(super) motions: Motions,
    /// Copies of the sampled bodies from before the step; in a step at centres of mass, of those that may fall asleep.
    pub(super) bodies: Vec<Body>,
    pub(super) rollback: Rollback,
    /// Shows how Rapier stepped; empty if the step is made by [`Fields::step`](crate::Fields::step).
    pub(super) stepped: Stepped,
    /// The mark of the set in the previous step.
    pub(super) mark: Option<u64>,
    pub(super) on_fault: FaultPolicy,
    /// The fields' contacts, which Rapier should find too; `None` without a cross-check.
    pub(super) expected: Option<Expected>,
    /// The power and potential of the fields when the step began, for the audit.
    pub(super) audit_reading: AuditReading,
    /// The loads on particles of soft bodies, if there are any.
    pub(super) soft: Option<SoftFlight>,
    /// True if sleeping bodies are evaluated.
    pub(super) sleepers: bool,
    pub(super) ownership: Ownership,
    pub(super) hooked: Arc<HookedColliders>,
    pub(super) starts: Arc<Starts>,
    /// A pair of the fields for which Rapier has to call the hooks.
    pub(super) to_ask: Option<[ColliderHandle; 2]>,
    /// True if fields may own contacts for which Rapier need not call the hooks.
    pub(super) unasked: bool,
    pub(super) hook_log: HookLog,
}

impl OpenStep {
    /// The hooks to pass to Rapier's step: the user's, and those that keep contacts which fields answer from its
    /// solver.
    pub fn hooks<'a>(&'a self, user: &'a dyn PhysicsHooks) -> StepHooks<'a> {
        StepHooks {
            ownership: &self.ownership,
            hooked: &self.hooked,
            starts: &self.starts,
            log: &self.hook_log,
            user,
        }
    }

    /// The length of the step.
    pub fn dt(&self) -> Real {
        self.dt
    }
}
