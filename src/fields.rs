//! The façade: everything a world needs to have fields.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use crate::check::{Checker, CrossCheck, CrossCheckReport};
use crate::compile::{Compiled, Plan};
use crate::detect::{
    ContactEvent, Detection, Detector, FieldContact, Reporter, Responder, ResponderHooks, Rules,
};
use crate::eval::{PotentialEnergy, Wrench};
use crate::field::{Axis, Tree, TreeError};
use crate::inject::{Injector, ProbeProperties, PropertyBook, Scheme, StepError, WakePolicy};
use crate::math::{ColliderHandle, ColliderSet, Real, RigidBodyHandle, RigidBodySet};
use crate::rapier::geometry::NarrowPhase;
use crate::rapier::pipeline::PhysicsWorld;

/// Force fields of a Rapier world.
///
/// The easy path is [`Fields::step`] in place of `world.step()`. The explicit one is
/// [`Fields::begin_step`] and [`Fields::end_step`] around a step of one's own pipeline.
///
/// What a step does to bodies:
///
/// - The wrench on every awake dynamic body becomes motion by the [`Scheme`]. The user's own
///   forces, impulses, gravity, damping, locked axes, joints and contacts keep their meaning.
/// - Bodies of unequal inertia turn freely by the layer's own rotation step, which conserves
///   angular momentum to rounding, wherever fields can turn bodies at all; Rapier carries it out,
///   so that contacts act on it. Bodies whose `gyroscopic_forces_enabled` is off are left alone.
/// - Sleeping bodies sleep on, unless the [`WakePolicy`] wakes them.
/// - Fixed and kinematic bodies carry fields but feel none. Soft bodies are left alone. Links of
///   multibodies ignore impulses; use [`Scheme::ExternalForce`] for them.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let mut world = PhysicsWorld::new();
/// let (moon, _) = world.insert(
///     RigidBodyBuilder::dynamic().translation(Vector::X * 4.0).linvel(Vector::Y),
///     ColliderBuilder::ball(0.1),
/// );
/// world.gravity = Vector::ZERO;
/// let mut fields = Fields::new(Field::point_gravity(4.0))?;
/// for _ in 0..60 {
///     fields.step(&mut world)?;
/// }
/// let distance = world.bodies[moon].translation().length();
/// assert!((distance - 4.0).abs() < 1e-3, "a circular orbit");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Fields {
    compiled: Compiled,
    injector: Injector,
    detector: Detector,
    detection: Detection,
    check: Option<Checker>,
    rules: Rules,
    reporter: Option<Reporter>,
    axes: Vec<Arc<str>>,
    claimed: bool,
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct StepOutcome {
    /// Bodies on which fields were sampled.
    pub sampled: usize,
    /// Contacts detected: overlaps at the end of the step, and touches within it.
    pub contacts: usize,
    /// Bodies written to after Rapier's step, by the scheme and by responses.
    pub written: usize,
    /// Whether swept detection gave up on this step, after more impacts than bodies that can come
    /// to rest have (10,000, and 256 per body); the rest is answered in the next.
    pub exhausted: bool,
}

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
}

impl FieldsBuilder {
    /// Declares an axis of the user's own, and the value every probe has on it unless it is
    /// given another by [`Fields::set_probe`].
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
    /// turns a body; [`Fields::step`] reads it from the world, an own pipeline must tell it.
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

    /// Compiles the tree.
    ///
    /// # Errors
    /// The tree is empty or too deep, a parameter is out of its range, or an axis is unknown or
    /// declared twice.
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
        let compiled = Compiled::new(self.tree);
        let book = PropertyBook::new(self.axes);
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
            rules: self.rules,
            reporter: self.reporter,
            axes: names,
            claimed: false,
        })
    }
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
        }
    }

    /// One step of a world with its fields: [`begin_step`](Self::begin_step), `world.step()`,
    /// [`end_step`](Self::end_step). If fields are to answer contacts, the first step also
    /// [claims](Self::claim_contacts) them.
    ///
    /// # Errors
    /// See [`StepError`]; poses, velocities and forces of all bodies are as they were before.
    pub fn step(&mut self, world: &mut PhysicsWorld) -> Result<StepOutcome, StepError> {
        let parameters = &world.integration_parameters;
        let dt = parameters.dt;
        self.injector.substeps = parameters.num_solver_iterations as u32;
        if let Some(check) = &mut self.check {
            check.note(parameters);
        }
        self.begin_step(dt, &mut world.bodies, &world.colliders)?;
        if !self.claimed {
            self.claim_contacts(&mut world.colliders);
        }
        if self.rules.among.is_empty() {
            world.step();
        } else {
            world.step_with_events(&self.hooks(), &());
        }
        self.end_step(&mut world.bodies, &world.colliders, &world.narrow_phase)
    }

    /// What happens before Rapier's step of length `dt`.
    ///
    /// # Errors
    /// See [`StepError`]; nothing has been written.
    pub fn begin_step(
        &mut self,
        dt: Real,
        bodies: &mut RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<(), StepError> {
        // Anew, and not from the end of the last step: users may have changed bodies and colliders.
        if let Some(check) = &mut self.check {
            let moment = self.injector.moment(dt);
            let book = &self.injector.book;
            self.detector
                .run(&self.compiled, bodies, colliders, moment, |probes| {
                    Injector::gather(book, bodies, colliders, probes);
                });
            check.expect(&self.detector.contacts, colliders);
        }
        self.injector.begin(&self.compiled, dt, bodies, colliders)?;
        self.detector.begin(bodies, self.injector.free_turns());
        Ok(())
    }

    /// What happens after Rapier's step.
    ///
    /// # Errors
    /// See [`StepError`]; poses, velocities and forces of all bodies are as they were before
    /// [`begin_step`](Self::begin_step).
    pub fn end_step(
        &mut self,
        bodies: &mut RigidBodySet,
        colliders: &ColliderSet,
        narrow_phase: &NarrowPhase,
    ) -> Result<StepOutcome, StepError> {
        let dt = self.injector.open_dt();
        if let Some(check) = &mut self.check {
            let injector = &self.injector;
            check.compare(colliders, narrow_phase, |handle| {
                injector.pose_before(handle, colliders)
            });
        }
        let began = self.injector.moment(dt);
        let (compiled, detector) = (&self.compiled, &mut self.detector);
        let rules = &self.rules;
        let answers = |contact: &FieldContact| rules.answers(contact);
        let mut swept = 0;
        let mut written = self
            .injector
            .end(compiled, bodies, colliders, |book, bodies| {
                let probes = |bodies: &RigidBodySet, probes: &mut _| {
                    Injector::gather(book, bodies, colliders, probes);
                };
                swept = detector.sweep(compiled, (bodies, colliders), (began, dt), probes, answers);
            })?;
        written += swept;
        if !self.compiled.detectors.is_empty() {
            let moment = self.injector.moment(dt);
            let book = &self.injector.book;
            self.detector
                .run(&self.compiled, bodies, colliders, moment, |probes| {
                    Injector::gather(book, bodies, colliders, probes);
                });
            if rules.everywhere != Responder::Rapier || !rules.among.is_empty() {
                written += self.detector.respond(bodies, dt, answers);
            }
            self.detector.add_touches();
            if let Some(reporter) = &mut self.reporter {
                reporter.report(&self.detector.contacts, self.injector.time);
            }
        }
        Ok(StepOutcome {
            sampled: self.injector.sampled(),
            contacts: self.detector.contacts.len(),
            written,
            exhausted: self.detector.exhausted,
        })
    }

    /// Keeps Rapier from solving the contacts that the fields answer, by the colliders' solver
    /// groups; see [`Responder::Fields`]. Keeps Rapier from recycling the contacts that a
    /// cross-check watches. Only needed around a pipeline of one's own, once per
    /// tree.
    pub fn claim_contacts(&mut self, colliders: &mut ColliderSet) {
        Detector::claim(&self.compiled, &self.rules, colliders);
        if let Some(check) = &mut self.check {
            check.keep_fresh(colliders);
        }
        self.claimed = true;
    }

    /// The hooks by which Rapier learns which contacts are not its own, if there are
    /// [rules](FieldsBuilder::responder_among) for some: for a pipeline of one's own.
    pub fn hooks(&self) -> ResponderHooks {
        let detectors = self.compiled.detectors.iter();
        ResponderHooks {
            rules: self.rules.clone(),
            detecting: detectors.map(|detector| detector.collider).collect(),
        }
    }

    /// Replaces the tree; properties of probes, axes, settings and time stay.
    ///
    /// # Errors
    /// As [`FieldsBuilder::build`]; the old tree stays in place.
    pub fn set_tree(&mut self, tree: impl Into<Tree>) -> Result<(), TreeError> {
        let tree = tree.into();
        tree.validate(&self.axes)?;
        self.compiled = Compiled::new(tree);
        self.detector = Detector::new(&self.compiled, self.detection);
        if let Some(check) = &mut self.check {
            check.watch(&self.compiled);
        }
        self.injector.forget_anchors();
        self.claimed = false;
        Ok(())
    }

    /// Sets what fields may ask of a collider.
    ///
    /// # Errors
    /// The collider is not there, a value is out of its range, or an axis was not declared.
    pub fn set_probe(
        &mut self,
        collider: ColliderHandle,
        properties: ProbeProperties,
        colliders: &ColliderSet,
    ) -> Result<(), StepError> {
        if !colliders.contains(collider) {
            return Err(StepError::NoSuchCollider { collider });
        }
        self.injector.book.set(collider, properties)?;
        self.injector.invalidate();
        Ok(())
    }

    /// Sets the value along a declared axis for all probes that have none of their own.
    ///
    /// # Errors
    /// The axis was not declared, or the value is not finite.
    pub fn set_axis(&mut self, name: &str, value: Real) -> Result<(), StepError> {
        self.injector.book.set_axis(name, value)?;
        self.injector.invalidate();
        Ok(())
    }

    /// What the compiler decided; prints as a short report.
    pub fn plan(&self) -> &Plan {
        &self.compiled.plan
    }

    /// Simulated time: the sum of all steps.
    pub fn time(&self) -> f64 {
        self.injector.time
    }

    /// The last wrench of the fields on a body, in world axes; nothing if it was not sampled.
    pub fn wrench(&self, body: RigidBodyHandle) -> Option<Wrench> {
        self.injector.wrench(body)
    }

    /// The wrench of the fields on a body as the world is now, whether or not a step was made.
    /// Works out those on all bodies, so it costs as much as a step's evaluation.
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn sample(
        &mut self,
        body: RigidBodyHandle,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<Option<Wrench>, StepError> {
        self.injector
            .sample(body, &self.compiled, bodies, colliders)
    }

    /// The potential energy of all bodies in the fields, as they are now.
    pub fn potential_energy(
        &mut self,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> PotentialEnergy {
        self.injector
            .potential_energy(&self.compiled, bodies, colliders)
    }

    /// The contacts of the last step, with the impulses that answered them: with swept detection
    /// first the touches in it, in the order of time; then overlaps at its end, in the order of the
    /// colliders' handles.
    pub fn contacts(&self) -> &[FieldContact] {
        &self.detector.contacts
    }

    /// The cross-check with Rapier so far, if it is on.
    pub fn cross_check(&self) -> Option<&CrossCheckReport> {
        self.check.as_ref().map(|check| &check.report)
    }
}
