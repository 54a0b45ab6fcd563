//! A step between its two halves.

use std::sync::Arc;

use crate::bridge::{Rollback, SoftFlight, Stepped};
use crate::contact::{Claims, Heard, Listening, Pairs, Starts, StepHooks};
use crate::cross_check::Expected;
use crate::diagnose::Tally;
use crate::integrate::{FaultPolicy, Motions};
use crate::math::{ColliderHandle, Real};
use crate::rapier::pipeline::PhysicsHooks;
use crate::rigid::Body;

/// A step that [`Fields::begin`](crate::Fields::begin) began: hand its [hooks](Self::hooks) to
/// Rapier's step, then give it to [`Fields::finish`](crate::Fields::finish).
///
/// It owns what the second half of the step needs. Bodies that are removed meanwhile are left out;
/// bodies that are added take part from the next step on; fields that are edited act, as edited,
/// from the second half on. A step that is dropped instead of finished is taken back as far as it
/// stands in the world (forces, switches) when the next one begins, which says so.
#[must_use = "a step that was begun is to be finished"]
pub struct OpenStep {
    pub(super) number: u64,
    pub(super) dt: Real,
    /// Whether nobody but Rapier has the world until it is finished.
    pub(super) alone: bool,
    /// Whether no field can reach any body within the step.
    pub(super) idle: bool,
    /// Whether fields acted at centres of mass alone.
    pub(super) at_centres: bool,
    pub(super) motions: Motions,
    /// The bodies that were sampled, as they were; of a step at centres of mass, those that may fall asleep.
    pub(super) bodies: Vec<Body>,
    pub(super) rollback: Rollback,
    /// By what Rapier's step shows, unless it is ours.
    pub(super) stepped: Stepped,
    /// That of the set as the step before has seen it.
    pub(super) mark: Option<u64>,
    pub(super) on_fault: FaultPolicy,
    /// Contacts that Rapier should find.
    pub(super) expected: Option<Expected>,
    /// What the fields did when the step began, if there is an audit.
    pub(super) tally: Tally,
    /// How particles of soft bodies were pushed, if there are any.
    pub(super) soft: Option<SoftFlight>,
    /// Whether sleepers are looked at.
    pub(super) sleepers: bool,
    pub(super) claims: Arc<Claims>,
    pub(super) listening: Arc<Listening>,
    pub(super) starts: Arc<Starts>,
    /// Pairs on which no detection field acts where they are.
    pub(super) released: Pairs,
    /// Pairs that fields have given back to Rapier while they last.
    pub(super) given: Pairs,
    /// A claimed pair that Rapier is to ask about.
    pub(super) to_ask: Option<[ColliderHandle; 2]>,
    /// Whether there are claimed contacts about which Rapier need not ask.
    pub(super) unasked: bool,
    pub(super) heard: Heard,
}

impl OpenStep {
    /// The hooks that Rapier's step is to be given: yours, with those by which Rapier learns which
    /// contacts are not its own.
    pub fn hooks<'a>(&'a self, user: &'a dyn PhysicsHooks) -> StepHooks<'a> {
        StepHooks {
            claims: &self.claims,
            listening: &self.listening,
            starts: &self.starts,
            released: &self.released,
            given: &self.given,
            heard: &self.heard,
            user,
        }
    }

    /// The length of the step.
    pub fn dt(&self) -> Real {
        self.dt
    }
}
