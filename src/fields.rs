//! The façade: everything a world needs to have fields.

mod ask;
mod builder;
mod saved;
#[cfg(feature = "serde-serialize")]
mod snapshot;

pub use builder::FieldsBuilder;
pub use saved::Settings;
#[cfg(feature = "serde-serialize")]
pub use snapshot::{FieldsSnapshot, SnapshotError};

use std::sync::Arc;

use crate::compile::Compiled;
use crate::contact::{
    Detection, Detector, FieldContact, Reporter, Responder, ResponderHooks, Rules,
};
use crate::cross_check::Checker;
use crate::diagnose::Auditor;
use crate::field::{Sampling, Tree, TreeError};
use crate::inject::{Injector, StepError};
use crate::math::{ColliderHandle, ColliderSet, Real, RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::dynamics::{IntegrationParameters, MultibodyJointSet};
use crate::rapier::geometry::NarrowPhase;
use crate::rapier::pipeline::PhysicsWorld;
use crate::sample::{ColliderProperties, PropertyError};

/// Force fields of a Rapier world.
///
/// The easy path is [`Fields::step`] in place of `world.step()`. The explicit one is
/// [`Fields::begin_step`] and [`Fields::end_step`] around a step of one's own pipeline.
///
/// What a step does to bodies:
///
/// - The wrench on every awake dynamic body becomes motion by the [`Scheme`]. The user's own
///   forces, impulses, gravity, damping, locked axes, joints and contacts keep their meaning.
/// - Bodies of unequal inertia turn freely by this crate's own rotation step, which conserves
///   angular momentum to rounding, wherever fields can turn bodies at all; Rapier carries it out,
///   so that contacts act on it. Bodies whose `gyroscopic_forces_enabled` is off are left alone.
/// - Sleeping bodies sleep on, unless the [`WakePolicy`] wakes them.
/// - Fixed and kinematic bodies carry fields but feel none. Locked axes do not move. Bodies
///   without mass, or without inertia, are not moved, or not turned; disabled bodies and colliders
///   are not sampled.
/// - Links of multibodies, which ignore impulses, are pushed by [`Scheme::ExternalForce`] whatever
///   the scheme.
/// - The particles of soft bodies are samples of the particle's mass, without charge. They take
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
///
/// [`Scheme`]: crate::Scheme
/// [`Scheme::ExternalForce`]: crate::Scheme::ExternalForce
/// [`WakePolicy`]: crate::WakePolicy
/// [`WakePolicy::Always`]: crate::WakePolicy::Always
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

impl Fields {
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
    ///
    /// [`Scheme::ExternalForce`]: crate::Scheme::ExternalForce
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
                .run(&self.compiled, bodies, colliders, moment, |samples| {
                    Injector::gather(book, bodies, colliders, samples);
                });
            check.expect(&self.detector.contacts, colliders);
        }
        if let Some(auditor) = &mut self.auditor {
            let (samples, moment) = self
                .injector
                .all_probes(&self.compiled, dt, bodies, colliders);
            let world = (&*bodies, &(&*bodies, colliders));
            auditor.begin(&self.compiled, world, &samples, moment);
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
                let samples = |bodies: &RigidBodySet, samples: &mut _| {
                    Injector::gather(book, bodies, colliders, samples);
                };
                swept =
                    detector.sweep(compiled, (bodies, colliders), (began, dt), samples, answers);
            })?;
        written += swept;
        if !self.compiled.detectors.is_empty() {
            let moment = self.injector.moment(dt);
            let book = &self.injector.book;
            self.detector
                .run(&self.compiled, bodies, colliders, moment, |samples| {
                    Injector::gather(book, bodies, colliders, samples);
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
            let (samples, moment) = self
                .injector
                .all_probes(&self.compiled, dt, bodies, colliders);
            let world = (&*bodies, &(&*bodies, colliders));
            auditor.end(&self.compiled, world, &samples, moment, dt);
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

    /// Replaces the tree; properties of samples, axes, settings and time stay.
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
    ) -> Result<(), PropertyError> {
        if !bodies.contains(body) {
            return Err(PropertyError::NoSuchBody { body });
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
    pub fn set_properties(
        &mut self,
        collider: ColliderHandle,
        properties: ColliderProperties,
        colliders: &ColliderSet,
    ) -> Result<(), PropertyError> {
        if !colliders.contains(collider) {
            return Err(PropertyError::NoSuchCollider { collider });
        }
        self.injector.book.set(collider, properties)?;
        self.injector.invalidate();
        Ok(())
    }

    /// Sets the value along a declared axis for all samples that have none of their own.
    ///
    /// # Errors
    /// The axis was not declared, or the value is not finite.
    pub fn set_axis(&mut self, name: &str, value: Real) -> Result<(), PropertyError> {
        self.injector.book.set_axis(name, value)?;
        self.injector.invalidate();
        Ok(())
    }
}
