//! The façade: everything a world needs to have fields.

#[cfg(feature = "serde")]
pub(crate) mod saved;

use std::sync::Arc;
use std::sync::mpsc::Sender;

use crate::check::{Checker, CrossCheck, CrossCheckReport};
use crate::compile::{Compiled, Plan};
use crate::detect::{
    ContactEvent, Detection, Detector, FieldContact, Reporter, Responder, ResponderHooks, Rules,
};
use crate::eval::{PotentialEnergy, Wrench, WrenchError};
use crate::explain::{self, Auditor, EnergyAudit, Explanation};
use crate::field::{Axis, Sampling, Tree, TreeError};
use crate::inject::{
    BodySample, Injector, ProbeProperties, PropertyBook, Scheme, StepError, StepWarning, Stiffness,
    WakePolicy,
};
use crate::math::{ColliderHandle, ColliderSet, Real, RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::dynamics::{IntegrationParameters, MultibodyJointSet};
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
/// - Fixed and kinematic bodies carry fields but feel none. Locked axes do not move. Bodies
///   without mass, or without inertia, are not moved, or not turned; disabled bodies and colliders
///   are not sampled.
/// - Links of multibodies, which ignore impulses, are pushed by [`Scheme::ExternalForce`] whatever
///   the scheme.
/// - The particles of soft bodies are probes of the particle's mass, without charge. They take
///   half an impulse before and half after Rapier's step (with `Kick` and `ExternalForce` the
///   whole before), for two evaluations. A soft body that sleeps is left asleep, but by
///   [`WakePolicy::Always`]. Only [`Fields::step`] does this, not `begin_step` and `end_step`.
/// - Only bodies that feel something are written to, once before and once after Rapier's step.
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
    auditor: Option<Auditor>,
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
    /// Particles of soft bodies that took an impulse after Rapier's step.
    pub particles: usize,
    /// What Rapier or the scheme will get wrong without a word; see [`Fields::warnings`].
    pub warnings: usize,
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
    audit: bool,
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
            auditor: self.audit.then(Auditor::default),
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
            audit: false,
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
        self.tell(parameters, world.gravity, &world.multibody_joints);
        if let Some(check) = &mut self.check {
            check.note(parameters);
        }
        let soft = !world.soft_bodies.is_empty();
        if soft {
            let (bodies, colliders) = (&world.bodies, &world.colliders);
            self.injector.feel_soft(
                &self.compiled,
                (dt, 0.0),
                &world.soft_bodies,
                bodies,
                colliders,
            )?;
        }
        self.begin_step(dt, &mut world.bodies, &world.colliders)?;
        if soft {
            self.injector.kick_soft(dt, &mut world.soft_bodies);
        }
        if !self.claimed {
            self.claim_contacts(&mut world.colliders);
        }
        if self.rules.among.is_empty() {
            world.step();
        } else {
            world.step_with_events(&self.hooks(), &());
        }
        if !soft {
            return self.end_step(&mut world.bodies, &world.colliders, &world.narrow_phase);
        }
        self.end_with_soft_bodies(dt, world)
    }

    /// The end of a step of a world with soft bodies.
    fn end_with_soft_bodies(
        &mut self,
        dt: Real,
        world: &mut PhysicsWorld,
    ) -> Result<StepOutcome, StepError> {
        let (bodies, colliders) = (&mut world.bodies, &world.colliders);
        let softs = &mut world.soft_bodies;
        let injector = &mut self.injector;
        if let Err(error) = injector.feel_soft(&self.compiled, (dt, dt), softs, bodies, colliders) {
            injector.abort(bodies, colliders);
            injector.restore_soft(softs);
            return Err(error);
        }
        let outcome = self.end_step(bodies, colliders, &world.narrow_phase);
        match outcome {
            Ok(outcome) => Ok(StepOutcome {
                particles: self.injector.end_soft(dt, softs),
                ..outcome
            }),
            Err(error) => {
                self.injector.restore_soft(softs);
                Err(error)
            }
        }
    }

    /// Tells what else is at work in a world: [`Fields::step`] does so by itself, around a
    /// pipeline of one's own it is to be called whenever one of these changes.
    ///
    /// - The number of solver iterations: see [`FieldsBuilder::solver_iterations`].
    /// - The largest speed Rapier allows, for [`warnings`](Self::warnings).
    /// - Gravity, which the schemes that make substeps follow as well. Untold, it is added once
    ///   a step.
    /// - The links of multibodies, which are pushed by [`Scheme::ExternalForce`] whatever the
    ///   scheme. Untold, fields do not move them under the others.
    pub fn tell(
        &mut self,
        parameters: &IntegrationParameters,
        gravity: Vector,
        multibodies: &MultibodyJointSet,
    ) {
        let injector = &mut self.injector;
        injector.substeps = u32::try_from(parameters.num_solver_iterations).unwrap_or(u32::MAX);
        injector.max_speed = Some(parameters.max_linear_velocity());
        injector.gravity = gravity;
        injector.links.clear();
        for multibody in multibodies.multibodies() {
            let links = multibody.links();
            let handles = links.map(|link| link.rigid_body_handle());
            injector.links.extend(handles);
        }
        injector
            .links
            .sort_unstable_by_key(|link| link.into_raw_parts().0);
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
        if let Some(auditor) = &mut self.auditor {
            let (probes, moment) = self
                .injector
                .all_probes(&self.compiled, dt, bodies, colliders);
            let world = (&*bodies, &(&*bodies, colliders));
            auditor.begin(&self.compiled, world, &probes, moment);
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
        if let Some(auditor) = &mut self.auditor {
            let (probes, moment) = self
                .injector
                .all_probes(&self.compiled, dt, bodies, colliders);
            let world = (&*bodies, &(&*bodies, colliders));
            auditor.end(&self.compiled, world, &probes, moment, dt);
        }
        Ok(StepOutcome {
            sampled: self.injector.sampled(),
            contacts: self.detector.contacts.len(),
            written,
            warnings: self.injector.warnings.len(),
            particles: 0,
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
        self.compile(tree);
        self.injector.forget_anchors();
        self.auditor = self.auditor.take().map(|_| Auditor::default());
        self.claimed = false;
        Ok(())
    }

    fn compile(&mut self, tree: Tree) {
        self.compiled = Compiled::new(tree, self.injector.book.overrides());
        self.detector = Detector::new(&self.compiled, self.detection);
        if let Some(check) = &mut self.check {
            check.watch(&self.compiled);
        }
    }

    /// Sets where a body is sampled by all fields that leave it to [`Sampling::Auto`], laws
    /// between sites aside; without one, as each field asks for.
    ///
    /// If any body asks for [`Sampling::Adaptive`], radial fields within balls are evaluated one by
    /// one, on all bodies.
    ///
    /// # Errors
    /// The body is not there, or a tolerance is not more than zero and finite.
    pub fn set_sampling(
        &mut self,
        body: RigidBodyHandle,
        sampling: impl Into<Option<Sampling>>,
        bodies: &RigidBodySet,
    ) -> Result<(), StepError> {
        if !bodies.contains(body) {
            return Err(StepError::NoSuchBody { body });
        }
        self.injector.book.set_sampling(body, sampling.into())?;
        if self.injector.book.overrides() != self.compiled.overrides {
            let tree = std::mem::replace(&mut self.compiled.tree, Tree::empty());
            self.compile(tree);
            self.injector.forget_batches();
        }
        self.injector.invalidate();
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

    /// How far the last wrench on a body, by a step or by [`Fields::sample`], may be off because
    /// borders of regions pass through the body; nothing if it was not sampled
    /// [adaptively](Sampling::Adaptive).
    ///
    /// It bounds what follows from not knowing where in a cell a border is, for forces that are
    /// constant over each cell: so all of the error for uniform forces on a body of cuboids, but
    /// not what a formula varies within a cell, nor what is uncertain about the volume in cells at
    /// the surface of other shapes. Borders are those of regions, predicates and soft edges aside;
    /// infinite if too many pass through one cell to be told apart (more than six of a term).
    pub fn wrench_error(&self, body: RigidBodyHandle) -> Option<WrenchError> {
        self.injector.wrench_error(body)
    }

    /// The points at which a body is sampled, as the world is now, whichever fields use them:
    /// for drawing, and for checking against the [reference](crate::reference). Those of
    /// [adaptive](Sampling::Adaptive) sampling are the ones of a body clear of borders.
    pub fn samples(
        &mut self,
        body: RigidBodyHandle,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Vec<BodySample> {
        self.injector
            .samples(body, &self.compiled, bodies, colliders)
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

    /// What the last step may have got wrong: fields too stiff for the scheme and the time step
    /// (the worst body only), and velocities that Rapier cut down. Empty if nothing.
    pub fn warnings(&self) -> &[StepWarning] {
        &self.injector.warnings
    }

    /// How stiff the fields are for a body in steps of `dt`, as the world is now; nothing for a
    /// body that fields do not move. Slow: samples the tree some tens of times at each probe of
    /// the body.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// let ball = RigidBodyBuilder::dynamic().translation(Vector::X);
    /// let (ball, _) = world.insert(ball, ColliderBuilder::ball(0.5).mass(4.0));
    /// world.bodies[ball].recompute_mass_properties_from_colliders(&world.colliders);
    /// let mut fields = Fields::new(Field::spring(16.0))?;
    /// let stiffness = fields.stiffness(ball, 0.1, &world.bodies, &world.colliders)?;
    /// let stiffness = stiffness.expect("a dynamic body");
    /// assert!((stiffness.dt_omega - 0.2).abs() < 1e-4, "ω = √(16/4)");
    /// assert!((stiffness.largest_stable_dt - 1.0).abs() < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn stiffness(
        &mut self,
        body: RigidBodyHandle,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<Option<Stiffness>, StepError> {
        self.injector
            .stiffness(body, dt, &self.compiled, bodies, colliders)
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

    /// Why the fields push a body the way they do right now: what each field gives, who overrules
    /// whom, and the wrench that results. Nothing for a body that fields cannot move.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// # let mut world = PhysicsWorld::new();
    /// # let (body, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
    /// let wind = Field::uniform(Vector::X).named("wind");
    /// let lee = Field::uniform(Vector::ZERO).within(Region::ball(2.0)).named("lee");
    /// let mut fields = Fields::new(wind.replace_union(lee))?;
    /// let why = fields.explain(body, &world.bodies, &world.colliders).unwrap();
    /// assert_eq!(why.contributions[0].overruled_by, ["field `lee`"]);
    /// println!("{why}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn explain(
        &mut self,
        body: RigidBodyHandle,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Option<Explanation> {
        let (probes, moment) = self
            .injector
            .all_probes(&self.compiled, 1.0, bodies, colliders);
        let place = probes.bodies.iter().position(|handle| *handle == body)?;
        let frames = (bodies, colliders);
        let compiled = &self.compiled;
        Some(explain::explain(
            compiled,
            &frames,
            &probes,
            moment,
            place as u32,
        ))
    }

    /// The energy audit so far, if it is on: potential and work of each field, and the drift that
    /// is left.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// # let mut world = PhysicsWorld::new();
    /// # world.gravity = Vector::ZERO;
    /// # let ball = RigidBodyBuilder::dynamic().translation(Vector::X);
    /// # world.insert(ball, ColliderBuilder::ball(0.5));
    /// let spring = Field::spring(1.0).named("spring");
    /// let friction = Field::drag(0.1, 0.0).named("friction");
    /// let mut fields = Fields::builder(spring.sum_union(friction)).audit(true).build()?;
    /// for _ in 0..60 {
    ///     fields.step(&mut world)?;
    /// }
    /// let audit = fields.audit().unwrap();
    /// println!("{audit}");
    /// assert!(audit.drift.abs() < 1e-3 * audit.initial, "what friction took is accounted for");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn audit(&self) -> Option<&EnergyAudit> {
        self.auditor.as_ref().map(|auditor| &auditor.audit)
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
