//! `Fields`: a field set, its settings, its state and the pipeline, bundled for a world.

mod builder;
mod estimate;
mod predict;
mod questions;

pub use builder::FieldsBuilder;
pub use estimate::ErrorEstimate;
pub use predict::Prediction;

use std::ops::{Index, IndexMut};
use std::sync::mpsc::Sender;

use crate::bridge::{StepError, WorldMut};
use crate::contact::ContactEvent;
use crate::diagnose::ZoneEvent;
use crate::field::{
    BuildError, ColliderProperties, Field, FieldKey, FieldSet, PropertyError, Sampling, Tree,
};
use crate::math::{ColliderHandle, ColliderSet, Real, RigidBodyHandle, RigidBodySet};
use crate::pipeline::{
    Definition, FieldPipeline, FieldSettings, FieldState, OpenStep, StepOutcome,
};
use crate::rapier::pipeline::{EventHandler, PhysicsHooks, PhysicsWorld};
use crate::threads::Pool;

/// The force fields of a Rapier world: the fields, their settings, the state that outlives a step, and the pipeline,
/// bundled as Rapier's `PhysicsWorld` bundles its sets.
///
/// Call [`Fields::step`] in place of `world.step()`, and [`Fields::step_with`] in place of
/// `world.step_with_events(…)`. Around a pipeline of your own, [`Fields::begin`] and
/// [`Fields::finish`] do the same, bit for bit.
///
/// The effect of a step on bodies:
///
/// - The wrench on each awake dynamic body becomes motion by the [`Scheme`]. The user's own
///   forces, impulses, gravity, damping, locked axes, joints and contacts keep their meaning.
/// - Where fields can rotate bodies at all, this crate computes the free rotation of bodies of unequal inertia, and
///   with [swept detection](crate::Detection::Swept) of balls, too; it conserves angular momentum to rounding. Rapier
///   carries the rotation out, so that contacts act on it. Bodies with a locked rotation, or whose
///   `gyroscopic_forces_enabled` is off, are left to Rapier.
/// - Sleeping bodies stay asleep, unless the [`WakePolicy`] wakes them. They are evaluated when a
///   field changed, moved, or depends on time, but not under [`WakePolicy::Never`].
/// - Fixed and kinematic bodies may carry fields, but get no force. Locked axes do not move. Bodies
///   without mass are not moved, and bodies without inertia not rotated; disabled bodies and colliders
///   are not sampled.
/// - Links of multibodies, which ignore impulses, are moved as by [`Scheme::ExternalForce`] under
///   every scheme.
/// - The particles of soft bodies are samples of the particle's mass, without charge, evaluated twice a
///   step. A force that does not depend on velocities acts by half an impulse before and half after Rapier's
///   step (with `Kick` and `ExternalForce` by the whole before it). Drag, wind, and all other forces on a
///   particle inside them act as a force during Rapier's step under any scheme: the mean along the path of a
///   free particle, exact in the velocity, with gravity and damping. So on a particle held by a pin, a contact or its
///   neighbours, a drag of rate k, and its weight beside it, are too small by a share of about k·dt/2 where that is
///   small, and the drag is at most the force that brings it to the speed of the flow within a step;
///   [`StepWarning::PinnedParticles`](crate::StepWarning::PinnedParticles) warns where a body has
///   pins and a held particle lacks more than a hundredth of the force. A soft body
///   that sleeps stays asleep, except under [`WakePolicy::Always`].
/// - The volume of a particle is a quarter of each cell that it is a corner of, in the present shape. Without
///   cells, the volume that a closed surface encloses is shared among its particles by the area around them.
///   Open sheets and ropes have no volume, whatever their contact skin: they displace nothing, and
///   [`StepWarning::NoVolume`](crate::StepWarning::NoVolume) warns where a field acts on volumes.
/// - Velocities and forces are written only of bodies on which a field acts, that this crate rotates, or that a
///   contact field pushes.
/// - A force that is not finite, or too large for any velocity, never reaches Rapier: the
///   [`FaultPolicy`](crate::FaultPolicy) decides what happens to the body.
///
/// Where bodies that are not active in Rapier's islands, fixed ones included, outnumber the active ones by more than
/// 256, fields act on a body that you have woken between steps only from the second half of the next step on.
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
/// [`WakePolicy::Never`]: crate::WakePolicy::Never
pub struct Fields {
    /// The settings: how fields act.
    pub settings: FieldSettings,
    /// The state that one step leaves for the next.
    pub state: FieldState,
    /// The fields, the properties of colliders, and the declared axes.
    pub set: FieldSet,
    pipeline: FieldPipeline,
}

impl Fields {
    /// Fields made of their parts, which may have been saved. The next step continues bit for bit, with a new pipeline,
    /// which has no channels for events.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
    /// let mut fields = Fields::new(Field::spring(4.0))?;
    /// fields.step(&mut world)?;
    /// let (set, settings, state) = (&fields.set, &fields.settings, &fields.state);
    /// let again = Fields::from_parts(set.clone(), settings.clone(), state.clone())?;
    /// assert_eq!(again.time(), fields.time());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// A field or a setting is out of its range, or the state has a value that no step leaves behind.
    pub fn from_parts(
        mut set: FieldSet,
        settings: FieldSettings,
        mut state: FieldState,
    ) -> Result<Self, StepError> {
        set.validate_changes()?;
        settings.validate()?;
        state.check()?;
        Ok(Fields {
            settings,
            state,
            set,
            pipeline: FieldPipeline::new(),
        })
    }

    /// Sends an event to a channel when a contact begins or ends; `None` stops that.
    pub fn set_events(&mut self, channel: impl Into<Option<Sender<ContactEvent>>>) {
        self.pipeline.set_events(channel);
    }

    /// Sends an event to a channel when a body enters or leaves a zone, in the order of time; `None` stops that.
    ///
    /// A zone is the region of a field that is enabled and within its lifetime. Contact fields, fields without a
    /// region, prototypes of [instances](crate::Tree::instances), and fields whose region differs between the colliders
    /// of a body (a [predicate](crate::Region::predicate), or an axis such as charge) have no zone. A body is inside if
    /// its centre of mass is, it is dynamic or kinematic and enabled, it does not carry the field, and the field's
    /// groups allow one of its colliders.
    ///
    /// The time of an event lies within the step: the centre of mass is taken to move on a straight line in the frame
    /// of the field, from its place before the step to that after it, and crosses the border at that time. So a body
    /// that passes through a zone in one step enters and leaves it. A stay shorter than 1/256 of the path may be
    /// missed, or than 1/16 of the step where the region is not made of solids alone. A body that was put into a zone
    /// between steps enters at the start of the next one.
    ///
    /// Costs a test of each body against each zone in each step; nothing without a channel. The bodies inside are part
    /// of the [state](crate::pipeline::FieldState).
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// use rapier3d_fields::diagnose::ZoneEvent;
    /// let mut world = PhysicsWorld::new();
    /// world.gravity = Vector::ZERO;
    /// let comet = RigidBodyBuilder::dynamic().linvel(Vector::X * 3.0);
    /// let (comet, _) = world.insert(comet, ColliderBuilder::ball(0.1));
    /// let cloud = Field::drag(0.5, 0.0).within(Region::ball(1.0)).at(Vector::X * 2.0);
    /// let mut fields = Fields::new(cloud.named("cloud"))?;
    /// let (sender, events) = std::sync::mpsc::channel();
    /// fields.set_zone_events(sender);
    /// for _ in 0..30 {
    ///     fields.step(&mut world)?;
    /// }
    /// let event = events.try_recv()?;
    /// let (cloud, third) = (fields.set.handle("cloud"), 1.0 / 3.0);
    /// assert!((event.time() - third).abs() < 1e-5);
    /// assert!(matches!(event, ZoneEvent::Entered { field, body, .. } if Some(field) == cloud && body == comet));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn set_zone_events(&mut self, channel: impl Into<Option<Sender<ZoneEvent>>>) {
        self.pipeline.set_zone_events(channel);
    }

    /// One step of a world with its fields, instead of `world.step()`.
    ///
    /// # Errors
    /// See [`StepError`]; the world is as it was before.
    pub fn step(&mut self, world: &mut PhysicsWorld) -> Result<StepOutcome, StepError> {
        self.step_with(world, &(), &())
    }

    /// One step of a world with its fields, with hooks and events of your own, instead of
    /// `world.step_with_events(hooks, events)`.
    ///
    /// # Errors
    /// As [`Fields::step`].
    pub fn step_with(
        &mut self,
        world: &mut PhysicsWorld,
        hooks: &dyn PhysicsHooks,
        events: &dyn EventHandler,
    ) -> Result<StepOutcome, StepError> {
        let pool = Pool::of(world);
        let open = pool.run(|| self.begin_alone(WorldMut::from(&mut *world)))?;
        world.step_with_events(&open.hooks(hooks), events);
        pool.run(|| self.finish(open, WorldMut::from(world)))
    }

    /// Begins a step around a pipeline of your own, before Rapier's step. Pass the [hooks](OpenStep::hooks) of the open
    /// step to `PhysicsPipeline::step`, with the same gravity and parameters, then [finish](Fields::finish) the step.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// # let mut world = PhysicsWorld::new();
    /// # world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
    /// # let mut fields = Fields::new(Field::uniform(Vector::X))?;
    /// # let my_hooks = ();
    /// let step = fields.begin(WorldMut::from(&mut world))?;
    /// world.physics_pipeline.step(
    ///     world.gravity,
    ///     &world.integration_parameters,
    ///     &mut world.islands,
    ///     &mut world.broad_phase,
    ///     &mut world.narrow_phase,
    ///     &mut world.bodies,
    ///     &mut world.colliders,
    ///     &mut world.impulse_joints,
    ///     &mut world.multibody_joints,
    ///     &mut world.soft_bodies,
    ///     &mut world.ccd_solver,
    ///     &step.hooks(&my_hooks),
    ///     &(),
    /// );
    /// let outcome = fields.finish(step, WorldMut::from(&mut world))?;
    /// assert_eq!(outcome.sampled, 1);
    /// # Ok::<(), StepError>(())
    /// ```
    ///
    /// # Errors
    /// See [`StepError`]; nothing has been written, except with [`StepError::Unfinished`].
    pub fn begin(&mut self, world: WorldMut<'_>) -> Result<OpenStep, StepError> {
        let (settings, state) = (&self.settings, &mut self.state);
        self.pipeline.begin(&mut self.set, settings, state, world)
    }

    /// As [`begin`](Self::begin), if Rapier's step follows at once.
    fn begin_alone(&mut self, world: WorldMut<'_>) -> Result<OpenStep, StepError> {
        self.set.validate_changes()?;
        let (set, settings) = (&self.set, &self.settings);
        let definition = Definition { set, settings };
        self.pipeline
            .begin_step(&definition, &mut self.state, world, true)
    }

    /// Finishes a step after Rapier's step. Call it once for each of Rapier's steps.
    ///
    /// If Rapier's step was not made, it returns [an error](StepError::NotStepped). If Rapier made several steps, it
    /// gives [a warning](crate::StepWarning::OtherSteps), as far as bodies that move freely or rest show it. Both are
    /// detected by dynamic bodies that are awake only: in a world without any, a missing step is not noticed, and
    /// neither is a missing step of zero length.
    ///
    /// # Errors
    /// See [`StepError`]; the world is as it was before [`begin`](Self::begin), except with [`StepError::NotTheirs`],
    /// which changes nothing.
    pub fn finish(
        &mut self,
        step: OpenStep,
        world: WorldMut<'_>,
    ) -> Result<StepOutcome, StepError> {
        let (settings, state) = (&self.settings, &mut self.state);
        self.pipeline
            .finish(&mut self.set, settings, state, step, world)
    }

    fn definition(&self) -> Definition<'_> {
        Definition {
            set: &self.set,
            settings: &self.settings,
        }
    }

    /// Replaces all fields, and begins the energy audit anew. Properties of colliders, axes, settings and time stay.
    ///
    /// # Errors
    /// As [`FieldsBuilder::build`]; the old fields stay in place.
    pub fn set_tree(&mut self, tree: impl Into<Tree>) -> Result<(), BuildError> {
        let mut set = self.set.clone();
        set.clear();
        let tree = tree.into();
        if tree.field_count() == 0 {
            return Err(BuildError::Empty);
        }
        set.insert(tree);
        set.validate_changes()?;
        self.set = set;
        self.state.audit = Default::default();
        Ok(())
    }

    /// Sets the sampling of a body for all fields with [`Sampling::Auto`], except laws between sites; `None` returns
    /// the choice to the fields.
    ///
    /// # Errors
    /// The body is not in the set.
    pub fn set_sampling(
        &mut self,
        body: RigidBodyHandle,
        sampling: impl Into<Option<Sampling>>,
        bodies: &RigidBodySet,
    ) -> Result<(), PropertyError> {
        if !bodies.contains(body) {
            return Err(PropertyError::NoSuchBody { body });
        }
        self.set.set_sampling(body, sampling);
        Ok(())
    }

    /// Sets the properties of a collider that fields read.
    ///
    /// # Errors
    /// The collider is not in the set, a value is out of its range, or an axis was not declared.
    pub fn set_properties(
        &mut self,
        collider: ColliderHandle,
        properties: ColliderProperties,
        colliders: &ColliderSet,
    ) -> Result<(), PropertyError> {
        if !colliders.contains(collider) {
            return Err(PropertyError::NoSuchCollider { collider });
        }
        self.set.set_properties(collider, properties)
    }

    /// Sets the value on a declared axis for all samples that have no value of their own.
    ///
    /// # Errors
    /// The axis was not declared, or the value is not finite.
    pub fn set_axis(&mut self, name: &str, value: Real) -> Result<(), PropertyError> {
        self.set.set_axis(name, value)
    }
}

/// The fields of the [set](Fields::set), by handle or name: `fields["wind"].strength = 2.0`.
///
/// # Panics
/// If there is no such field, like an index into a map.
impl<K: FieldKey> Index<K> for Fields {
    type Output = Field;

    fn index(&self, key: K) -> &Field {
        &self.set[key]
    }
}

/// # Panics
/// If there is no such field, like an index into a map.
impl<K: FieldKey> IndexMut<K> for Fields {
    fn index_mut(&mut self, key: K) -> &mut Field {
        &mut self.set[key]
    }
}
