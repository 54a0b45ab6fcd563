//! Settings of the façade.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use super::Fields;
use crate::compile::Compiled;
use crate::contact::{ContactEvent, Detection, Detector, Reporter, Responder, Rules};
use crate::cross_check::{Checker, CrossCheck};
use crate::diagnose::Auditor;
use crate::field::{Axis, Tree, TreeError};
use crate::inject::{Injector, Scheme, WakePolicy};
use crate::math::{ColliderHandle, Real};
use crate::sample::Properties;

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
/// # Ok::<(), TreeError>(())
/// ```
pub struct FieldsBuilder {
    tree: Tree,
    axes: Vec<(Arc<str>, Real)>,
    scheme: Scheme,
    wake: WakePolicy,
    rules: Rules,
    reporter: Option<Reporter>,
    detection: Detection,
    cross_check: CrossCheck,
    solver_iterations: usize,
    audit: bool,
}

impl Fields {
    /// Compiles a tree, with the default settings.
    ///
    /// # Errors
    /// As [`FieldsBuilder::build`].
    pub fn new(tree: impl Into<Tree>) -> Result<Self, TreeError> {
        Self::builder(tree).build()
    }

    /// Settings for a tree.
    pub fn builder(tree: impl Into<Tree>) -> FieldsBuilder {
        FieldsBuilder {
            tree: tree.into(),
            axes: Vec::new(),
            scheme: Scheme::default(),
            wake: WakePolicy::default(),
            rules: Rules::default(),
            reporter: None,
            detection: Detection::default(),
            cross_check: CrossCheck::default(),
            solver_iterations: 4,
            audit: false,
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
        self.scheme = scheme;
        self
    }

    /// Sets when fields wake sleeping bodies.
    pub fn wake(mut self, policy: WakePolicy) -> Self {
        self.wake = policy;
        self
    }

    /// Sets who answers contacts that fields detect.
    pub fn responder(mut self, responder: Responder) -> Self {
        self.rules.everywhere = responder;
        self
    }

    /// Sets who answers contacts between any two of some colliders (of a pair, or of a group), apart
    /// from what [`FieldsBuilder::responder`] says of all others. The last such rule that fits a
    /// pair counts.
    ///
    /// Rapier learns of it by a hook, for which these colliders are given
    /// `ActiveHooks::FILTER_CONTACT_PAIRS`; around a pipeline of one's own, hand it
    /// [`Fields::hooks`].
    pub fn responder_among(
        mut self,
        colliders: impl IntoIterator<Item = ColliderHandle>,
        responder: Responder,
    ) -> Self {
        let set = colliders.into_iter().collect();
        self.rules.among.push((set, responder));
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
    /// # Ok::<(), TreeError>(())
    /// ```
    pub fn events(mut self, channel: Sender<ContactEvent>) -> Self {
        self.reporter = Some(Reporter::new(channel));
        self
    }

    /// Sets when fields look for contacts: at the end of each step, or over the whole of it.
    pub fn detection(mut self, detection: Detection) -> Self {
        self.detection = detection;
        self
    }

    /// Tells a number of solver iterations other than Rapier's default of 4, over which Rapier
    /// turns a body; [`Fields::step`] reads it from the world, an own pipeline must tell it (or
    /// all of [`Fields::tell`]).
    /// Getting it wrong costs tops of unequal inertia an error of third order in their turn per
    /// step.
    pub fn solver_iterations(mut self, iterations: usize) -> Self {
        self.solver_iterations = iterations;
        self
    }

    /// Compares the contacts of detection fields with Rapier's in every step: `true` for all pairs,
    /// or [settings](CrossCheck). The result is [`Fields::cross_check`].
    pub fn cross_check(mut self, settings: impl Into<CrossCheck>) -> Self {
        self.cross_check = settings.into();
        self
    }

    /// Keeps account of the energy in every step; see [`Fields::audit`]. Costs two walks of the
    /// reference over all samples and fields in each step, so it is for finding out, not for
    /// every day.
    pub fn audit(mut self, on: bool) -> Self {
        self.audit = on;
        self
    }

    /// Compiles the tree.
    ///
    /// # Errors
    /// The tree is empty or too deep, a parameter of it or of the scheme is out of its range, or
    /// an axis is unknown or declared twice.
    pub fn build(self) -> Result<Fields, TreeError> {
        let mut names: Vec<Arc<str>> = Vec::new();
        for (name, value) in &self.axes {
            if names.contains(name) || !matches!(Axis::named(name), Axis::User(_)) {
                let axis = name.to_string();
                return Err(TreeError::DuplicateAxis { axis });
            }
            if !value.is_finite() {
                return Err(TreeError::Parameter {
                    field: format!("axis `{name}`"),
                    quantity: "its value",
                    requirement: "finite",
                    value: crate::math::to_f64(*value),
                });
            }
            names.push(name.clone());
        }
        self.tree.validate(&names)?;
        self.scheme.validate()?;
        let compiled = Compiled::new(self.tree, Vec::new());
        let book = Properties::new(self.axes);
        let mut injector = Injector::new(self.scheme, self.wake, book);
        injector.substeps = self.solver_iterations as u32;
        injector.exact_turns = self.detection == Detection::Swept && !compiled.detectors.is_empty();
        let on = self.cross_check.on;
        let mut check = on.then(|| Checker::new(self.cross_check));
        check.iter_mut().for_each(|check| check.watch(&compiled));
        Ok(Fields {
            detector: Detector::new(&compiled, self.detection),
            detection: self.detection,
            compiled,
            injector,
            check,
            auditor: self.audit.then(Auditor::default),
            rules: self.rules,
            reporter: self.reporter,
            axes: names,
            claimed: false,
        })
    }
}
