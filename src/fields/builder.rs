//! The builder of `Fields`: a tree, its axes, and the settings.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use super::Fields;
use crate::bridge::WakePolicy;
use crate::contact::{ContactEvent, Detection, Responder};
use crate::cross_check::CrossCheck;
use crate::field::{BuildError, FieldSet, Tree};
use crate::integrate::{FaultPolicy, Scheme};
use crate::math::{ColliderHandle, Real};
use crate::pipeline::{FieldPipeline, FieldSettings, FieldState};

/// Builds [`Fields`] from a tree and settings.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let heat = Field::closure(["temperature".into()], |s: &Sample| Vector::Y * s.axes[0]);
/// let fields = Fields::builder(heat)
///     .axis("temperature", 20.0)
///     .scheme(Scheme::Kick)
///     .wake(WakePolicy::Never)
///     .build()?;
/// # Ok::<(), BuildError>(())
/// ```
#[must_use = "nothing is built before `build`"]
pub struct FieldsBuilder {
    tree: Tree,
    axes: Vec<(Arc<str>, Real)>,
    settings: FieldSettings,
    events: Option<Sender<ContactEvent>>,
}

impl Fields {
    /// Compiles a tree, with the default settings.
    ///
    /// # Errors
    /// As [`FieldsBuilder::build`].
    pub fn new(tree: impl Into<Tree>) -> Result<Self, BuildError> {
        Self::builder(tree).build()
    }

    /// A builder for a tree, with the default settings.
    pub fn builder(tree: impl Into<Tree>) -> FieldsBuilder {
        FieldsBuilder {
            tree: tree.into(),
            axes: Vec::new(),
            settings: FieldSettings::default(),
            events: None,
        }
    }
}

impl FieldsBuilder {
    /// Declares an axis of the user's own. `value` is that of all samples to which [`Fields::set_properties`] gives no
    /// other.
    pub fn axis(mut self, name: &str, value: Real) -> Self {
        self.axes.push((name.into(), value));
        self
    }

    /// Sets the scheme, by which wrenches become motion.
    pub fn scheme(mut self, scheme: Scheme) -> Self {
        self.settings.scheme = scheme;
        self
    }

    /// Sets the rule by which fields wake sleeping bodies.
    pub fn wake(mut self, policy: WakePolicy) -> Self {
        self.settings.wake = policy;
        self
    }

    /// Sets the treatment of bodies to which fields give a force that is not finite, or too large.
    pub fn on_fault(mut self, policy: FaultPolicy) -> Self {
        self.settings.on_fault = policy;
        self
    }

    /// Sets the side that answers contacts which fields detect.
    pub fn responder(mut self, responder: Responder) -> Self {
        self.settings.set_responder(responder);
        self
    }

    /// Sets the side that answers contacts between any two of these colliders, instead of the one set by
    /// [`FieldsBuilder::responder`]. Of several such rules, the last one that fits a pair counts.
    pub fn responder_among(
        mut self,
        colliders: impl IntoIterator<Item = ColliderHandle>,
        responder: Responder,
    ) -> Self {
        self.settings.set_responder_among(colliders, responder);
        self
    }

    /// Sends an event to a channel when a contact begins or ends.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let (sender, events) = std::sync::mpsc::channel();
    /// let fields = Fields::builder(Field::uniform(Vector::X)).events(sender).build()?;
    /// for event in events.try_iter() {
    ///     println!("{event:?}");
    /// }
    /// # Ok::<(), BuildError>(())
    /// ```
    pub fn events(mut self, channel: Sender<ContactEvent>) -> Self {
        self.events = Some(channel);
        self
    }

    /// Sets the time at which fields detect contacts: at the end of each step, or over the whole of it.
    pub fn detection(mut self, detection: Detection) -> Self {
        self.settings.detection = detection;
        self
    }

    /// Compares the contacts of detection fields with Rapier's in each step: `true` for all pairs, or
    /// [settings](CrossCheck). [`Fields::cross_check`] returns the result.
    pub fn cross_check(mut self, settings: impl Into<CrossCheck>) -> Self {
        self.settings.cross_check = settings.into();
        self
    }

    /// Turns on the energy audit; see [`Fields::audit`]. It costs two walks of the reference evaluator over all samples
    /// and fields in each step, so it is meant for debugging.
    pub fn audit(mut self, on: bool) -> Self {
        self.settings.audit = on;
        self
    }

    /// Compiles the tree.
    ///
    /// # Errors
    /// The tree is empty or too deep, one of its parameters or a setting is out of its range, or
    /// an axis is unknown or declared twice.
    pub fn build(self) -> Result<Fields, BuildError> {
        let mut set = FieldSet::new();
        for (name, value) in &self.axes {
            set.declare_axis(name, *value)?;
        }
        if self.tree.field_count() == 0 {
            return Err(BuildError::Empty);
        }
        set.insert(self.tree);
        set.validate_changes()?;
        self.settings.validate()?;
        let mut pipeline = FieldPipeline::new();
        pipeline.set_events(self.events);
        Ok(Fields {
            settings: self.settings,
            state: FieldState::default(),
            set,
            pipeline,
        })
    }

    /// Sets all settings at once.
    pub fn settings(mut self, settings: FieldSettings) -> Self {
        self.settings = settings;
        self
    }
}
