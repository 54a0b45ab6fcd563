//! The state that one step leaves for the next.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::bridge::{Drowsing, ForceOverride, LentForces, Resting, StepError};
use crate::contact::{HandOver, HookedColliders};
use crate::cross_check::CrossCheckReport;
use crate::diagnose::{EnergyAudit, Occupant};
use crate::field::{Anchor, Axis, Frame, PropertyError};
use crate::integrate::{Edges, Evaluation, Reactions, first_unsound};
use crate::math::{ColliderHandle, Pose, RigidBodyHandle, Vector, from_f64};
use crate::rigid::Body;

/// The state that one step leaves for the next: plain data. A snapshot needs it, the [settings](crate::pipeline::FieldSettings)
/// and the fields: a new [`FieldPipeline`](crate::pipeline::FieldPipeline) continues from them bit for bit.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct FieldState {
    /// In 64 bits, so that long runs of small steps do not lose time.
    pub(crate) time: f64,
    /// The number of finished steps.
    pub(crate) steps: u64,
    /// The mark of the set in the last step.
    pub(crate) mark: Option<u64>,
    /// The evaluation with which the next step begins, unless something changed.
    pub(crate) evaluation: Option<Evaluation>,
    /// The bodies of the evaluation, as the step left them.
    pub(crate) records: Vec<BodyRecord>,
    /// The anchors that are on none of these bodies, with their frames.
    pub(crate) carriers: Vec<(Anchor, Option<Frame>)>,
    /// Bodies found stiff, in the order of their handles.
    pub(crate) stiff: Vec<RigidBodyHandle>,
    /// Bodies on which forces change abruptly.
    pub(crate) edges: Edges,
    pub(crate) resting: Resting,
    pub(crate) drowsing: Drowsing,
    pub(crate) reactions: Reactions,
    /// The numbers of bodies and colliders, once all anchors have been found; an anchor that is missing later was
    /// removed.
    pub(crate) anchored: Option<[usize; 2]>,
    /// Anchors that were reported missing.
    pub(crate) removed: Vec<Anchor>,
    /// Colliders that were given hook bits, with the bits that the user has set.
    pub(crate) hooked: Arc<HookedColliders>,
    /// Pairs that the fields have handed over, or may soon.
    pub(crate) hand_over: HandOver,
    /// Contacts at the end of the last step.
    pub(crate) touching: Vec<[ColliderHandle; 2]>,
    /// The bodies in zones at the end of the last step, in order; empty without a channel for their events.
    pub(crate) zones: Vec<Occupant>,
    pub(crate) cross_check: CrossCheckReport,
    pub(crate) audit: EnergyAudit,
    /// The number of the last step that was begun; zero if none was, or if it was read from elsewhere.
    #[cfg_attr(feature = "serde-serialize", serde(skip))]
    pub(crate) last_begun: u64,
    /// The record of an unfinished step, by which it can be taken back.
    #[cfg_attr(feature = "serde-serialize", serde(skip))]
    pub(crate) open: Option<OpenRecord>,
    /// True once the state was checked; false after it was deserialized.
    #[cfg_attr(feature = "serde-serialize", serde(skip))]
    checked: bool,
}

/// A body as a step left it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct BodyRecord {
    pub pose: Pose,
    pub linvel: Vector,
    pub angvel: Vector,
    pub sleeping: bool,
}

/// The record of a step that was begun.
#[derive(Clone, Debug, Default)]
pub(crate) struct OpenRecord {
    pub number: u64,
    pub overrides: Vec<ForceOverride>,
    /// Bodies whose gyroscopic term is off for the step.
    pub steady: Vec<RigidBodyHandle>,
    /// The forces lent to soft bodies for the step.
    pub lent: Vec<LentForces>,
}

/// A number for a step, unique within the process.
pub(super) fn next_number() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

impl OpenRecord {
    pub(crate) fn clear(&mut self) {
        self.overrides.clear();
        self.steady.clear();
        self.lent.clear();
    }
}

impl FieldState {
    /// Simulated time: the sum of all steps since zero, or since it was [set](Self::set_time).
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Sets the simulated time.
    ///
    /// # Errors
    /// The time is not finite; the present one stays.
    pub fn set_time(&mut self, time: f64) -> Result<(), PropertyError> {
        if !time.is_finite() {
            return Err(PropertyError::AxisValue {
                axis: Axis::Time.to_string(),
                value: from_f64(time),
            });
        }
        self.time = time;
        self.evaluation = None;
        Ok(())
    }

    /// Returns an error if a value is one that no step leaves behind.
    pub(crate) fn check(&mut self) -> Result<(), StepError> {
        let amiss = if self.checked { None } else { self.amiss() };
        let time = (!self.time.is_finite()).then(|| format!("time is {}", self.time));
        match amiss.or(time) {
            Some(value) => Err(StepError::State { value }),
            None => {
                self.checked = true;
                Ok(())
            }
        }
    }

    /// Returns true if there is a record of each evaluated body.
    pub(crate) fn knows_all(&self) -> bool {
        let evaluated = self.evaluation.as_ref().map(|last| last.bodies.len());
        evaluated == Some(self.records.len())
    }

    /// Makes the next step evaluate again.
    pub(crate) fn forget(&mut self) {
        self.evaluation = None;
        self.edges = Edges::default();
        self.records.clear();
    }

    /// A description of the first value that no step leaves behind; `None` if the state is sound.
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
            ("edges", self.edges.is_sound()),
            ("resting", self.resting.is_sound()),
            ("drowsing", self.drowsing.is_sound()),
            ("reactions", self.reactions.is_sound()),
            ("hand_over", self.hand_over.is_sound()),
            ("stiff", self.stiff.is_sorted_by_key(|it| index(*it))),
            ("zones", self.zones.is_sorted_by_key(Occupant::key)),
        ];
        let list = lists.iter().find(|(_, is_sound)| !is_sound);
        let list = list.map(|(name, _)| format!("{name} is out of order, or not finite"));
        let placed = |(anchor, frame): &(Anchor, Option<Frame>)| {
            let frame = frame.is_none_or(|it| it.is_finite());
            frame && anchor.local_pose().is_finite()
        };
        list.or_else(|| first_unsound(&self.records, "records", BodyRecord::is_finite))
            .or_else(|| first_unsound(&self.carriers, "carriers", placed))
    }
}

fn index(body: RigidBodyHandle) -> u32 {
    body.into_raw_parts().0
}

impl BodyRecord {
    /// Returns true if all values are finite, which need not hold for a deserialized record.
    fn is_finite(&self) -> bool {
        self.pose.is_finite() && self.linvel.is_finite() && self.angvel.is_finite()
    }

    pub(crate) fn of(body: &Body) -> Self {
        BodyRecord {
            pose: body.pose,
            linvel: body.linvel,
            angvel: body.angvel,
            sleeping: body.sleeping,
        }
    }
}
