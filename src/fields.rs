//! The façade: everything a world needs to have fields.

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
use crate::field::{
    BuildError, ColliderProperties, Field, FieldKey, FieldSet, PropertyError, Sampling, Tree,
};
use crate::math::{ColliderHandle, ColliderSet, Real, RigidBodyHandle, RigidBodySet};
use crate::pipeline::{
    Definition, FieldPipeline, FieldSettings, FieldState, OpenStep, StepOutcome,
};
use crate::rapier::pipeline::{EventHandler, PhysicsHooks, PhysicsWorld};
use crate::threads::Pool;

/// Force fields of a Rapier world: what they are, how they act, what outlives a step, and the
/// machinery, bundled as Rapier's `PhysicsWorld` bundles its sets.
///
/// [`Fields::step`] stands in place of `world.step()`, and [`Fields::step_with`] in place of
/// `world.step_with_events(…)`. Around a pipeline of your own, [`Fields::begin`] and
/// [`Fields::finish`] do the same, bit for bit.
///
/// A step does this to bodies:
///
/// - The wrench on every awake dynamic body becomes motion by the [`Scheme`]. The user's own
///   forces, impulses, gravity, damping, locked axes, joints and contacts keep their meaning.
/// - Bodies of unequal inertia turn freely by this crate's own rotation step, which conserves
///   angular momentum to rounding, wherever fields can turn bodies at all; Rapier carries it out,
///   so that contacts act on it. Bodies whose `gyroscopic_forces_enabled` is off are left alone.
/// - Sleeping bodies sleep on, unless the [`WakePolicy`] wakes them. They are looked at when a
///   field changed, moved, or depends on time.
/// - Fixed and kinematic bodies carry fields but feel none. Locked axes do not move. Bodies
///   without mass, or without inertia, are not moved, or not turned; disabled bodies and colliders
///   are not sampled.
/// - Links of multibodies, which ignore impulses, are pushed by [`Scheme::ExternalForce`] whatever
///   the scheme.
/// - The particles of soft bodies are samples of the particle's mass, without charge, for two evaluations a
///   step. Of a force that reads no velocities they take half an impulse before and half after Rapier's
///   step (with `Kick` and `ExternalForce` the whole before). Drag, wind, and all else that acts on a
///   particle in them, are a force during Rapier's step: the mean along the way of a free particle, exact in
///   the velocity with gravity and damping, whatever the scheme. So a particle that is held by a pin, a
///   contact or its neighbours feels of a drag of rate k a part less, k·dt/2 where that is small, and no more
///   than what brings it to the speed of the flow within a step. A soft body that sleeps is left asleep,
///   but by [`WakePolicy::Always`].
/// - The volume of a particle is a quarter of each cell that it is a corner of, as the cells are now. Without
///   cells, what a closed surface encloses is shared out to its particles by the area around them. Open
///   sheets and ropes have no volume, whatever their contact skin: they displace nothing, which
///   [`StepWarning::NoVolume`](crate::StepWarning::NoVolume) says where a field acts on volumes.
/// - Only bodies that feel something are written to, once before and once after Rapier's step.
/// - A force that is not finite, or too large for any velocity, never reaches Rapier: the
///   [`FaultPolicy`](crate::FaultPolicy) says what happens to the body.
///
/// Who is awake is asked of Rapier's islands. Where more than half of the bodies and 256 sleep, a
/// body that you wake without moving the time forward is felt from the second half of the step on.
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
    /// How fields act.
    pub settings: FieldSettings,
    /// The state that the next step takes over from the last one.
    pub state: FieldState,
    /// The fields, and what is said of colliders and axes.
    pub set: FieldSet,
    pipeline: FieldPipeline,
}

impl Fields {
    /// Fields of their parts, which may be those that were saved: the next step goes on from them,
    /// bit for bit, with a fresh pipeline.
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
    /// A field or a setting is out of its range, or the state is not one that a step leaves behind.
    pub fn from_parts(
        mut set: FieldSet,
        settings: FieldSettings,
        mut state: FieldState,
    ) -> Result<Self, StepError> {
        set.validate_changes()?;
        settings.scheme.validate()?;
        state.check()?;
        Ok(Fields {
            settings,
            state,
            set,
            pipeline: FieldPipeline::new(),
        })
    }

    /// Sends contacts that begin and end, as events, into a channel; `None` ends that.
    pub fn set_events(&mut self, channel: impl Into<Option<Sender<ContactEvent>>>) {
        self.pipeline.set_events(channel);
    }

    /// One step of a world with its fields, in place of `world.step()`.
    ///
    /// # Errors
    /// See [`StepError`]; the world is as it was before.
    pub fn step(&mut self, world: &mut PhysicsWorld) -> Result<StepOutcome, StepError> {
        self.step_with(world, &(), &())
    }

    /// One step of a world with its fields, with hooks and events of your own, in place of
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

    /// Begins a step around a pipeline of your own, before Rapier's step: hand the
    /// [hooks](OpenStep::hooks) of the open step to `PhysicsPipeline::step`, with the same gravity
    /// and parameters, then [finish](Fields::finish) it.
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
    /// See [`StepError`]; nothing has been written.
    pub fn begin(&mut self, world: WorldMut<'_>) -> Result<OpenStep, StepError> {
        let (settings, state) = (&self.settings, &mut self.state);
        self.pipeline.begin(&mut self.set, settings, state, world)
    }

    /// As [`begin`](Self::begin), where Rapier's step follows at once.
    fn begin_alone(&mut self, world: WorldMut<'_>) -> Result<OpenStep, StepError> {
        self.set.validate_changes()?;
        let (set, settings) = (&self.set, &self.settings);
        let definition = Definition { set, settings };
        self.pipeline
            .begin_step(&definition, &mut self.state, world, true)
    }

    /// Finishes a step after Rapier's step: call it once for each of its steps.
    ///
    /// Where fields pushed a body before it, a step that was not made is
    /// [an error](StepError::NotStepped), and one that was made twice
    /// [a warning](crate::StepWarning::OtherSteps) where it shows on what moves freely or rests.
    ///
    /// # Errors
    /// See [`StepError`]; the world is as it was before [`begin`](Self::begin).
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

    /// Replaces all fields; properties of colliders, axes, settings and time stay.
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

    /// Sets where a body is sampled by all fields that leave it to [`Sampling::Auto`], laws
    /// between sites aside; without one, as each field asks for.
    ///
    /// # Errors
    /// The body is not there.
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
        self.set.set_properties(collider, properties)
    }

    /// Sets the value along a declared axis for all samples that have none of their own.
    ///
    /// # Errors
    /// The axis was not declared, or the value is not finite.
    pub fn set_axis(&mut self, name: &str, value: Real) -> Result<(), PropertyError> {
        self.set.set_axis(name, value)
    }
}

/// `fields["wind"].strength = 2.0`: the fields of the [set](Fields::set), by handle or name.
///
/// # Panics
/// If there is no such field, as maps do.
impl<K: FieldKey> Index<K> for Fields {
    type Output = Field;

    fn index(&self, key: K) -> &Field {
        &self.set[key]
    }
}

/// # Panics
/// If there is no such field, as maps do.
impl<K: FieldKey> IndexMut<K> for Fields {
    fn index_mut(&mut self, key: K) -> &mut Field {
        &mut self.set[key]
    }
}
