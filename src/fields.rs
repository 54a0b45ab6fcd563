//! The façade: everything a world needs to have fields.

use std::sync::Arc;

use crate::check::{CrossCheck, CrossCheckReport};
use crate::compile::{Compiled, Plan};
use crate::detect::{Detection, FieldContact, Responder};
use crate::eval::{PotentialEnergy, Wrench, WrenchError};
use crate::field::{Axis, Sampling, Tree, TreeError};
use crate::inject::{
    BodySample, Injector, ProbeProperties, PropertyBook, Scheme, StepError, WakePolicy,
};
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
    detection: Detection,
    check: Option<CrossCheck>,
    responder: Responder,
    axes: Vec<Arc<str>>,
    claimed: bool,
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct StepOutcome {
    /// Bodies on which fields were sampled.
    pub sampled: usize,
    /// Contacts detected at the end of the step.
    pub contacts: usize,
    /// Bodies written to after Rapier's step, by the scheme and by responses.
    pub written: usize,
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
    responder: Responder,
    cross_check: bool,
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
        self.responder = responder;
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

    /// Compares the contacts of detection fields with Rapier's in every step; see
    /// [`Fields::cross_check`].
    pub fn cross_check(mut self, on: bool) -> Self {
        self.cross_check = on;
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
        let compiled = Compiled::new(self.tree, Vec::new());
        let book = PropertyBook::new(self.axes);
        let mut injector = Injector::new(self.scheme, self.wake, book);
        injector.substeps = self.solver_iterations as u32;
        let mut check = self.cross_check.then(CrossCheck::default);
        check.iter_mut().for_each(|check| check.watch(&compiled));
        Ok(Fields {
            detection: Detection::new(&compiled),
            compiled,
            injector,
            check,
            responder: self.responder,
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
            responder: Responder::default(),
            cross_check: false,
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
            check.report.recycling |= parameters.contact_recycling;
        }
        self.begin_step(dt, &mut world.bodies, &world.colliders)?;
        if !self.claimed {
            self.claim_contacts(&mut world.colliders);
        }
        world.step();
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
            self.detection
                .run(&self.compiled, bodies, colliders, moment, |probes| {
                    Injector::gather(book, bodies, colliders, probes);
                });
            check.expect(&self.detection.contacts, colliders);
        }
        self.injector.begin(&self.compiled, dt, bodies, colliders)?;
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
        let mut written = self.injector.end(&self.compiled, bodies, colliders)?;
        if !self.compiled.detectors.is_empty() {
            let moment = self.injector.moment(dt);
            let book = &self.injector.book;
            self.detection
                .run(&self.compiled, bodies, colliders, moment, |probes| {
                    Injector::gather(book, bodies, colliders, probes);
                });
            if self.responder != Responder::Rapier {
                written += self.detection.respond(bodies);
            }
        }
        Ok(StepOutcome {
            sampled: self.injector.sampled(),
            contacts: self.detection.contacts.len(),
            written,
        })
    }

    /// Keeps Rapier from solving the contacts that the fields answer, by the colliders' solver
    /// groups; see [`Responder::Fields`]. Only needed around a pipeline of one's own, once per
    /// tree.
    pub fn claim_contacts(&mut self, colliders: &mut ColliderSet) {
        if self.responder == Responder::Fields {
            Detection::claim(&self.compiled, colliders);
        }
        self.claimed = true;
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
        self.claimed = false;
        Ok(())
    }

    fn compile(&mut self, tree: Tree) {
        self.compiled = Compiled::new(tree, self.injector.book.overrides());
        self.detection = Detection::new(&self.compiled);
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

    /// The potential energy of all bodies in the fields, as they are now.
    pub fn potential_energy(
        &mut self,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> PotentialEnergy {
        self.injector
            .potential_energy(&self.compiled, bodies, colliders)
    }

    /// The contacts detected at the end of the last step, with the impulses that answered them.
    pub fn contacts(&self) -> &[FieldContact] {
        &self.detection.contacts
    }

    /// The cross-check with Rapier so far, if it is on.
    pub fn cross_check(&self) -> Option<&CrossCheckReport> {
        self.check.as_ref().map(|check| &check.report)
    }
}
