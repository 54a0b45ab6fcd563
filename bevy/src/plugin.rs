//! The plugin.

use std::marker::PhantomData;

use bevy::ecs::intern::Interned;
use bevy::ecs::schedule::ScheduleLabel;
use bevy::ecs::system::SystemParamItem;
use bevy::platform::collections::HashSet;
use bevy::prelude::*;
use bevy_rapier3d::prelude::{
    BevyPhysicsHooks, PhysicsSet, RapierContextSimulation, RapierPhysicsPlugin,
};

use crate::components::{FieldProperties, FieldSampling, WithinCollider};
use crate::context::RapierContextFields;
use crate::force_field::ForceField;
use crate::messages::{FieldContactEvent, FieldZoneEvent};
use crate::settings::RapierFieldsSettings;
use crate::{step, sync};

/// The set of the systems that update the fields of contexts from components. It runs after Rapier's set
/// `PhysicsSet::SyncBackend`, and before `PhysicsSet::StepSimulation`.
#[derive(SystemSet, Debug, Hash, PartialEq, Eq, Clone)]
pub struct FieldsSync;

/// Rapier with force fields. Add it in place of `RapierPhysicsPlugin`: it adds that plugin itself, without the system
/// that steps. A system of its own makes the same steps in each `TimestepMode`, lets the fields act in each step, calls
/// the hooks of the app, and sends all messages.
///
/// ```no_run
/// use bevy::prelude::*;
/// use bevy_rapier3d::prelude::*;
/// use bevy_rapier3d_fields::prelude::*;
/// App::new()
///     .add_plugins((MinimalPlugins, TransformPlugin, RapierFieldsPlugin::<NoUserData>::default()))
///     .add_systems(Startup, |mut commands: Commands| {
///         let planet = Field::point_gravity(50.0).within(Region::ball(20.0));
///         commands.spawn(ForceField::new(planet));
///         commands.spawn((RigidBody::Dynamic, Collider::ball(0.5), Transform::from_xyz(8.0, 0.0, 0.0)));
///     })
///     .run();
/// ```
///
/// In a frame of several steps, Rapier's `SimulationStepStats` are those of the last step.
pub struct RapierFieldsPlugin<Hooks = ()> {
    schedule: Interned<dyn ScheduleLabel>,
    rapier: fn(RapierPhysicsPlugin<Hooks>) -> RapierPhysicsPlugin<Hooks>,
    hooks: PhantomData<Hooks>,
}

impl<Hooks> Default for RapierFieldsPlugin<Hooks> {
    fn default() -> Self {
        RapierFieldsPlugin {
            schedule: PostUpdate.intern(),
            rapier: |plugin| plugin,
            hooks: PhantomData,
        }
    }
}

impl<Hooks> RapierFieldsPlugin<Hooks> {
    /// Runs in the schedule `FixedUpdate` rather than `PostUpdate`.
    pub fn in_fixed_schedule(self) -> Self {
        self.in_schedule(FixedUpdate)
    }

    /// Runs in a schedule of your own rather than in `PostUpdate`.
    pub fn in_schedule(mut self, schedule: impl ScheduleLabel) -> Self {
        self.schedule = schedule.intern();
        self
    }

    /// Configures Rapier's plugin before it is added: length unit, contexts. Its schedule is that of this plugin.
    ///
    /// ```
    /// use bevy_rapier3d::prelude::*;
    /// use bevy_rapier3d_fields::prelude::*;
    /// let plugin = RapierFieldsPlugin::<NoUserData>::default();
    /// let plugin = plugin.with_rapier(|rapier| rapier.with_length_unit(100.0));
    /// ```
    pub fn with_rapier(
        mut self,
        rapier: fn(RapierPhysicsPlugin<Hooks>) -> RapierPhysicsPlugin<Hooks>,
    ) -> Self {
        self.rapier = rapier;
        self
    }
}

impl<Hooks> Plugin for RapierFieldsPlugin<Hooks>
where
    Hooks: 'static + BevyPhysicsHooks,
    for<'w, 's> SystemParamItem<'w, 's, Hooks>: BevyPhysicsHooks,
{
    /// # Panics
    /// If `RapierPhysicsPlugin` was added before: each step would be made twice.
    fn build(&self, app: &mut App) {
        assert!(
            !app.is_plugin_added::<RapierPhysicsPlugin<Hooks>>(),
            "`RapierFieldsPlugin` adds `RapierPhysicsPlugin` itself: add it in its place, and set \
             Rapier's plugin up by `with_rapier`"
        );
        let but_steps = HashSet::from_iter([PhysicsSet::SyncBackend, PhysicsSet::Writeback]);
        let rapier = (self.rapier)(RapierPhysicsPlugin::default());
        let rapier = rapier.in_schedule(self.schedule);
        app.add_plugins(rapier.with_physics_sets_systems(but_steps));

        app.register_required_components::<RapierContextSimulation, RapierContextFields>();
        app.init_resource::<RapierFieldsSettings>();
        app.add_message::<FieldZoneEvent>();
        app.add_message::<FieldContactEvent>();
        app.register_type::<ForceField>();
        app.register_type::<WithinCollider>();
        app.register_type::<FieldProperties>();
        app.register_type::<FieldSampling>();

        let between = FieldsSync.after(PhysicsSet::SyncBackend);
        app.configure_sets(self.schedule, between.before(PhysicsSet::StepSimulation));
        let syncs = (
            sync::sync_settings,
            sync::sync_properties,
            sync::sync_samplings,
            sync::sync_force_fields,
        );
        app.add_systems(self.schedule, syncs.chain().in_set(FieldsSync));
        let step = step::step_simulation::<Hooks>.in_set(PhysicsSet::StepSimulation);
        app.add_systems(self.schedule, step);
    }
}
