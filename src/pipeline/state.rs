//! What outlives a step.

use std::sync::Arc;

use crate::bridge::{Drowsing, ForceOverride, LentForces, Resting, StepError};
use crate::contact::{HandOver, Listening};
use crate::cross_check::CrossCheckReport;
use crate::diagnose::EnergyAudit;
use crate::field::{Anchor, Frame};
use crate::integrate::{Evaluation, Reactions};
use crate::math::{ColliderHandle, Pose, RigidBodyHandle, Vector};
use crate::rigid::Body;

/// What the next step takes over from the last one: plain data. Beside the
/// [settings](crate::FieldSettings) and the fields it is all that a snapshot needs: a fresh
/// [`FieldPipeline`](crate::FieldPipeline) goes on with it bit for bit.
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub struct FieldState {
    /// In 64 bits, so that long runs of small steps do not lose time.
    pub(crate) time: f64,
    /// Steps finished so far.
    pub(crate) steps: u64,
    /// The mark of the set as the last step has seen it.
    pub(crate) mark: Option<u64>,
    /// The evaluation that the next step begins with, unless something changed.
    pub(crate) evaluation: Option<Evaluation>,
    /// The bodies it was made for, as the step left them.
    pub(crate) records: Vec<BodyRecord>,
    /// What fields hang on that is none of these bodies, and where it was.
    pub(crate) carriers: Vec<(Anchor, Option<Frame>)>,
    /// Bodies found stiff, in the order of their handles.
    pub(crate) stiff: Vec<RigidBodyHandle>,
    pub(crate) resting: Resting,
    pub(crate) drowsing: Drowsing,
    pub(crate) reactions: Reactions,
    /// Whether all anchors were found once, and how many bodies and colliders there were; what is
    /// missing later was removed.
    pub(crate) anchored: Option<[usize; 2]>,
    /// Anchors that were reported missing.
    pub(crate) removed: Vec<Anchor>,
    /// Colliders that were given a bit for hooks, with their own.
    pub(crate) listening: Arc<Listening>,
    /// Contacts that are Rapier's though fields claim them.
    pub(crate) hand_over: HandOver,
    /// Contacts at the end of the last step.
    pub(crate) touching: Vec<[ColliderHandle; 2]>,
    pub(crate) cross_check: CrossCheckReport,
    pub(crate) audit: EnergyAudit,
    /// The number of a step that was begun and is not finished, with what is to be taken back if it
    /// never is.
    #[cfg_attr(feature = "serde-serialize", serde(skip))]
    pub(crate) open: Option<OpenRecord>,
    /// Whether it was found to be sound, once; what is read from elsewhere was not yet.
    #[cfg_attr(feature = "serde-serialize", serde(skip))]
    checked: bool,
}

/// A body as a step left it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) struct BodyRecord {
    pub pose: Pose,
    pub linvel: Vector,
    pub angvel: Vector,
    pub sleeping: bool,
    pub colliders: u32,
}

/// A step that was begun.
#[derive(Clone, Debug, Default)]
pub(crate) struct OpenRecord {
    pub number: u64,
    pub overrides: Vec<ForceOverride>,
    /// Bodies whose gyroscopic term is off for the step.
    pub steady: Vec<RigidBodyHandle>,
    /// Those of soft bodies.
    pub lent: Vec<LentForces>,
}

impl OpenRecord {
    pub(crate) fn clear(&mut self) {
        self.overrides.clear();
        self.steady.clear();
        self.lent.clear();
    }
}

impl FieldState {
    /// Simulated time: the sum of all steps.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Sets the simulated time.
    ///
    /// # Panics
    /// Never; a time that is not finite is refused by the next step.
    pub fn set_time(&mut self, time: f64) {
        self.time = time;
        self.evaluation = None;
    }

    /// Whether it is of one piece, and could have been left behind by a step.
    pub(crate) fn check(&mut self) -> Result<(), StepError> {
        let amiss = match self.checked {
            true => None,
            false => self.amiss(),
        };
        let time = (!self.time.is_finite()).then(|| format!("time is {}", self.time));
        match amiss.or(time) {
            Some(value) => Err(StepError::State { value }),
            None => {
                self.checked = true;
                Ok(())
            }
        }
    }

    /// Whether it is known of each body that was evaluated how a step left it.
    pub(crate) fn knows_all(&self) -> bool {
        let evaluated = self.evaluation.as_ref().map(|last| last.bodies.len());
        evaluated == Some(self.records.len())
    }

    /// Has the next step evaluate anew.
    pub(crate) fn forget(&mut self) {
        self.evaluation = None;
        self.records.clear();
    }

    /// The first value that no step leaves behind.
    fn amiss(&self) -> Option<String> {
        let last = self.evaluation.as_ref();
        if let Some(amiss) = last.and_then(Evaluation::amiss) {
            return Some(format!("evaluation.{amiss}"));
        }
        let (count, known) = (self.records.len(), last.map_or(0, |last| last.bodies.len()));
        if count != known && count != 0 && last.is_some() {
            return Some(format!("records has {count} entries of {known} bodies"));
        }
        let lists = [
            ("resting", self.resting.is_sound()),
            ("drowsing", self.drowsing.is_sound()),
            ("reactions", self.reactions.is_sound()),
            ("stiff", self.stiff.is_sorted_by_key(|it| index(*it))),
        ];
        let list = lists.iter().find(|(_, is_sound)| !is_sound);
        list.map(|(name, _)| format!("{name} is out of order, or not finite"))
    }
}

fn index(body: RigidBodyHandle) -> u32 {
    body.into_raw_parts().0
}

impl BodyRecord {
    pub(crate) fn of(body: &Body) -> Self {
        BodyRecord {
            pose: body.pose,
            linvel: body.linvel,
            angvel: body.angvel,
            sleeping: body.sleeping,
            colliders: body.colliders,
        }
    }
}
