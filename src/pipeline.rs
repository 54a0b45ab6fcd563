//! The step, from top to bottom: bodies are read and sampled, the fields evaluated, motions computed and written; then
//! Rapier steps; then the same once more, and contacts are detected, answered and checked.

mod at_centres;
mod begin;
mod checks;
mod contacts;
mod due;
mod evaluation;
mod faults;
mod finish;
mod open_step;
mod questions;
mod records;
mod scene;
mod settings;
mod stages;
mod state;
mod timings;

use due::{AnchorsApart, DueBodies};
pub use open_step::OpenStep;
pub(crate) use questions::value_of;
pub use questions::{BodySample, FieldValue};
pub(crate) use scene::Definition;
use scene::StepScene;
pub use settings::FieldSettings;
pub use state::FieldState;
use state::OpenRecord;
use timings::Stopwatch;
pub use timings::{StepStage, StepTimings};

use std::sync::Arc;
use std::sync::mpsc::Sender;

use crate::bridge::{
    Outlived, Push, Reader, Rollback, SoftBodies, StepError, StepMark, Stepped, Undo, WakePolicy,
    WorldMut,
};
use crate::contact::{
    ContactEvent, Detection, Detector, FieldContact, HookFilter, OwnershipRules, ResponderRules,
};
use crate::cross_check::Watched;
use crate::diagnose::{ZoneEvent, ZoneWatch};
use crate::eval::CentreEvaluator;
use crate::field::FieldSet;
use crate::integrate::{Evaluation, FaultPolicy, Integrator, Motions, Retried, StepWarning};
use crate::math::{Real, RigidBodyHandle};
use crate::rigid::{Body, BodySet, Wrench};
use crate::sample::{Gatherer, Properties};

/// The counts of a step, and its largest error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct StepOutcome {
    /// Rigid bodies on which fields were sampled; zero if no field can reach one.
    pub sampled: usize,
    /// Contacts detected: overlaps at the end of the step, and with swept detection touches within it.
    pub contacts: usize,
    /// Rigid bodies written to after Rapier's step, by the scheme and by responses.
    pub written: usize,
    /// Particles of soft bodies that took an impulse after Rapier's step.
    pub particles: usize,
    /// The number of possible errors of the step; see [`Fields::warnings`](crate::Fields::warnings).
    pub warnings: usize,
    /// Under a scheme that chooses substeps (`Auto`, `PerBody`): for the worst body of this step, a bound of the
    /// relative error of the energy of a vibration, and of the sum of such errors ([`Auto`](crate::Scheme::Auto)), as
    /// far as its path shows it. A quarter of the tolerance if no body came near that, zero if no field varies.
    pub error: Option<Real>,
    /// True if swept detection reached its [limit of work](FieldSettings::swept_work), of which the step
    /// [warns](StepWarning::SweptWork). The remaining impacts are answered in the next step.
    pub exhausted: bool,
}

/// The machinery of a step, for programs that keep fields, settings and state themselves, as Rapier's
/// `PhysicsPipeline` is for programs that keep its sets themselves. [`Fields`](crate::Fields) bundles the four.
///
/// It holds only buffers and caches, which are made from the fields when first needed, and updated when the fields
/// change. From the state that a step left, any pipeline continues bit for bit: a new one, the one that made the step,
/// or one that has made other steps since. It may step several worlds in turn, but then its buffers are made anew in
/// each step: a pipeline for each world is faster.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// # let mut world = PhysicsWorld::new();
/// # let (ball, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5).mass(1.0));
/// # world.gravity = Vector::ZERO;
/// let (mut set, settings) = (FieldSet::new(), FieldSettings::default());
/// set.insert(Field::uniform(Vector::X));
/// let (mut state, mut pipeline) = (FieldState::default(), FieldPipeline::new());
/// for _ in 0..60 {
///     let step = pipeline.begin(&mut set, &settings, &mut state, (&mut world).into())?;
///     world.step_with_events(&step.hooks(&()), &());
///     pipeline.finish(&mut set, &settings, &mut state, step, (&mut world).into())?;
/// }
/// assert!((world.bodies[ball].linvel().x - 1.0).abs() < 1e-5, "1 N for 1 s on 1 kg");
/// # Ok::<(), StepError>(())
/// ```
#[derive(Default)]
pub struct FieldPipeline {
    scene: StepScene,
    properties: Properties,
    reader: Reader,
    gatherer: Gatherer,
    /// A buffer for the bodies of the second half.
    late_bodies: Vec<Body>,
    integrator: Integrator,
    motions: Motions,
    /// The motions of the second half.
    late: Motions,
    rollback: Rollback,
    stepped: Stepped,
    /// True if only Rapier's step can change the world until the step is finished.
    alone: bool,
    /// The policy when the step began.
    on_fault: FaultPolicy,
    /// Bodies that are to be disabled in this half of the step.
    quarantined: Vec<RigidBodyHandle>,
    centres: CentreEvaluator,
    /// A buffer for bodies that are evaluated together.
    block: at_centres::BodyBlock,
    /// The state of the bodies before a visit wrote to them.
    undo: Undo,
    /// The evaluation at centres of mass in this half of the step.
    shown: Evaluation,
    /// A body for which a visit at centres of mass did not suffice in the last step.
    blocker: Option<RigidBodyHandle>,
    /// True if the first half of the step was made at centres of mass.
    at_centres: bool,
    due: DueBodies,
    apart: AnchorsApart,
    /// A buffer for the next evaluation. It holds that of the last step while the state has none.
    spare: Evaluation,
    /// A buffer for the record of an open step.
    spare_record: OpenRecord,
    wake_decisions: Vec<bool>,
    /// Bodies that must not fall asleep.
    restless: Vec<RigidBodyHandle>,
    /// True if `held` is up to date for this half of the step.
    held_is_known: bool,
    /// Bodies that contacts pushed in Rapier's last step.
    pushed: BodySet,
    /// True if contacts are the same as when `pushed` was found.
    pushed_is_known: bool,
    /// Shows when the next step begins whether contacts are still the same.
    pushed_mark: Option<StepMark>,
    softs: SoftBodies,
    pub(crate) detector: Detector,
    /// The revision of the detection fields for which the detector was made.
    detectors_revision: Option<u64>,
    detection: Detection,
    pushes: Vec<Push>,
    ownership_rules: Arc<OwnershipRules>,
    hook_filter: HookFilter,
    ownership_for: (ResponderRules, Detection),
    watched: Watched,
    pub(crate) warnings: Vec<StepWarning>,
    /// Bodies whose last step was repeated.
    retried: Vec<Retried>,
    /// True if bodies were added or removed since the last step.
    other_bodies: bool,
    /// True if colliders were added or removed since the last step.
    other_colliders: bool,
    /// Bodies sampled in the last step.
    sampled: usize,
    /// True once a state has been compared with a world.
    met: bool,
    outlived: Outlived,
    /// The number of the last step that this pipeline began. Its buffers belong to that step.
    last_begun: u64,
    stopwatch: Stopwatch,
    pub(crate) events: Option<Sender<ContactEvent>>,
    pub(crate) zone_events: Option<Sender<ZoneEvent>>,
    zone_watch: ZoneWatch,
}

impl FieldPipeline {
    /// A pipeline without buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// A pipeline without buffers for a copy of a state with which this one may have been used.
    pub(crate) fn for_copy(&self) -> Self {
        FieldPipeline {
            met: self.met,
            ..Self::default()
        }
    }

    /// Begins a step. Pass the [hooks](OpenStep::hooks) of the open step to Rapier's step, with the same gravity and
    /// parameters, then [finish](Self::finish) the step. The set is borrowed mutably because edits since the last step
    /// are validated first.
    ///
    /// # Errors
    /// See [`StepError`]; nothing has been written, except with [`StepError::Unfinished`].
    pub fn begin(
        &mut self,
        set: &mut FieldSet,
        settings: &FieldSettings,
        state: &mut FieldState,
        world: WorldMut<'_>,
    ) -> Result<OpenStep, StepError> {
        set.validate_changes()?;
        self.begin_step(&Definition { set, settings }, state, world, false)
    }

    /// Finishes a step: call it once after each of Rapier's steps. Fields whose lifetime is over are removed from the
    /// set. Edits since [`begin`](Self::begin) take effect, unless one of them is invalid: then the step is finished
    /// with the fields that it began with, and the next `begin` refuses the edit.
    ///
    /// # Errors
    /// See [`StepError`]; the world is as it was before [`begin`](Self::begin), except with [`StepError::NotTheirs`],
    /// which changes nothing.
    pub fn finish(
        &mut self,
        set: &mut FieldSet,
        settings: &FieldSettings,
        state: &mut FieldState,
        step: OpenStep,
        world: WorldMut<'_>,
    ) -> Result<StepOutcome, StepError> {
        let fits = set.validate_changes().is_ok();
        let fields = Definition { set, settings };
        if fits {
            self.follow(&fields);
        }
        let outcome = self.finish_step(&fields, state, step, world)?;
        set.step_done(state.time);
        Ok(outcome)
    }

    /// Sends an event to a channel when a contact begins or ends; `None` stops that.
    pub fn set_events(&mut self, channel: impl Into<Option<Sender<ContactEvent>>>) {
        self.events = channel.into();
    }

    /// Sends events of zones to a channel; see [`Fields::set_zone_events`](crate::Fields::set_zone_events).
    pub fn set_zone_events(&mut self, channel: impl Into<Option<Sender<ZoneEvent>>>) {
        self.zone_events = channel.into();
    }

    /// The contacts of the last step; see [`Fields::contacts`](crate::Fields::contacts).
    #[must_use]
    pub fn contacts(&self) -> &[FieldContact] {
        &self.detector.contacts
    }

    /// Possible errors of the last step; see [`Fields::warnings`](crate::Fields::warnings).
    #[must_use]
    pub fn warnings(&self) -> &[StepWarning] {
        &self.warnings
    }

    /// The time that each stage of the last step took; see [`Fields::timings`](crate::Fields::timings).
    #[must_use]
    pub fn timings(&self) -> &StepTimings {
        &self.stopwatch.times
    }

    /// Sets whether the stages of steps are measured, from the next step on.
    pub fn set_timed(&mut self, on: bool) {
        self.stopwatch.on = on;
    }

    /// Drops the buffers of other steps, so that the next step continues from its state as a new pipeline would. The
    /// compiled fields stay, because they carry the revision of the set from which they were made.
    fn start_over(&mut self) {
        *self = FieldPipeline {
            scene: StepScene {
                compiled: std::mem::take(&mut self.scene.compiled),
                ..StepScene::default()
            },
            properties: std::mem::take(&mut self.properties),
            stopwatch: std::mem::take(&mut self.stopwatch),
            events: self.events.take(),
            zone_events: self.zone_events.take(),
            met: self.met,
            ..Self::default()
        };
    }

    /// Updates everything that is made from the fields.
    pub(crate) fn follow(&mut self, fields: &Definition<'_>) {
        self.scene.compiled.update(fields.set);
        self.properties.update(fields.set);
        let settings = fields.settings;
        let found = Some(self.scene.compiled.detectors_revision);
        let stale = self.detectors_revision != found;
        if stale || self.detection != settings.detection {
            self.detection = settings.detection;
            self.detector = Detector::new(&self.scene.compiled, self.detection);
        }
        let ownership_for = (settings.rules.clone(), settings.detection);
        if stale || self.ownership_for != ownership_for {
            self.detectors_revision = found;
            let detectors = self.scene.compiled.detectors.iter();
            self.watched = Watched::new(detectors.map(|it| (it.collider, it.mask.is_none())));
            let swept = settings.detection == Detection::Swept;
            self.ownership_rules = Arc::new(OwnershipRules::new(
                &settings.rules,
                &self.scene.compiled,
                swept,
            ));
            self.ownership_for = ownership_for;
        }
    }
}

/// Returns whether a wrench acts on a body, and whether the body is to be woken or kept awake. `acting` has the first
/// decision for each body if any of them sleeps, else it is empty.
fn wake_decision(
    policy: WakePolicy,
    decisions: &[bool],
) -> impl Fn(usize, &Body, Wrench) -> (bool, bool) {
    move |place, body, wrench| {
        let acts = decisions.get(place).copied().unwrap_or(true);
        let always = policy == WakePolicy::Always && wrench != Wrench::ZERO;
        (acts, always || body.sleeping)
    }
}
