//! Settings of the façade.

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

/// Settings of [`Fields`].
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

    /// Settings for a tree.
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
    /// Declares an axis of the user's own, and the value every sample has on it unless it is
    /// given another by [`Fields::set_properties`].
    pub fn axis(mut self, name: &str, value: Real) -> Self {
        self.axes.push((name.into(), value));
        self
    }

    /// Sets how wrenches become motion.
    pub fn scheme(mut self, scheme: Scheme) -> Self {
        self.settings.scheme = scheme;
        self
    }

    /// Sets when fields wake sleeping bodies.
    pub fn wake(mut self, policy: WakePolicy) -> Self {
        self.settings.wake = policy;
        self
    }

    /// Sets what is done about a body to which fields give a force that is not finite, or too large.
    pub fn on_fault(mut self, policy: FaultPolicy) -> Self {
        self.settings.on_fault = policy;
        self
    }

    /// Sets who answers contacts that fields detect.
    pub fn responder(mut self, responder: Responder) -> Self {
        self.settings.set_responder(responder);
        self
    }

    /// Sets who answers contacts between any two of some colliders (of a pair, or of a group), apart
    /// from what [`FieldsBuilder::responder`] says of all others. The last such rule that fits a
    /// pair counts.
    pub fn responder_among(
        mut self,
        colliders: impl IntoIterator<Item = ColliderHandle>,
        responder: Responder,
    ) -> Self {
        self.settings.set_responder_among(colliders, responder);
        self
    }

    /// Sends contacts that begin and end, as events, into a channel.
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

    /// Sets when fields look for contacts: at the end of each step, or over the whole of it.
    pub fn detection(mut self, detection: Detection) -> Self {
        self.settings.detection = detection;
        self
    }

    /// Compares the contacts of detection fields with Rapier's in every step: `true` for all pairs,
    /// or [settings](CrossCheck). The result is [`Fields::cross_check`].
    pub fn cross_check(mut self, settings: impl Into<CrossCheck>) -> Self {
        self.settings.cross_check = settings.into();
        self
    }

    /// Keeps account of the energy in every step; see [`Fields::audit`]. Costs two walks of the
    /// reference over all samples and fields in each step, so it is for finding out, not for
    /// every day.
    pub fn audit(mut self, on: bool) -> Self {
        self.settings.audit = on;
        self
    }

    /// Compiles the tree.
    ///
    /// # Errors
    /// The tree is empty or too deep, a parameter of it or of the scheme is out of its range, or
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
        self.settings.scheme.validate()?;
        let mut pipeline = FieldPipeline::new();
        pipeline.set_events(self.events);
        Ok(Fields {
            settings: self.settings,
            state: FieldState::default(),
            set,
            pipeline,
        })
    }

    /// Sets how fields act, all at once.
    pub fn settings(mut self, settings: FieldSettings) -> Self {
        self.settings = settings;
        self
    }
}
