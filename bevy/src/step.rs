//! Rapier's steps, with the fields around each of them.

use bevy::ecs::query::QueryData;
use bevy::ecs::system::{StaticSystemParam, SystemParam, SystemParamItem};
use bevy::prelude::*;
use bevy_rapier3d::prelude::*;
use bevy_rapier3d::rapier::dynamics::IntegrationParameters;
use bevy_rapier3d::rapier::pipeline::PhysicsHooks;
use rapier3d_fields::{StepError, WorldMut};

use crate::context::RapierContextFields;
use crate::frame::FrameSteps;
use crate::hooks::AppHooks;
use crate::reports::{Entities, FieldMessages};

type Interpolations<'w, 's> = Query<
    'w,
    's,
    (
        &'static RapierRigidBodyHandle,
        &'static mut TransformInterpolation,
    ),
>;

/// All components of a context that a step needs.
#[derive(QueryData)]
#[query_data(mutable)]
pub(crate) struct Context {
    entity: Entity,
    simulation: &'static mut RapierContextSimulation,
    colliders: &'static mut RapierContextColliders,
    joints: &'static mut RapierContextJoints,
    bodies: &'static mut RapierRigidBodySet,
    configuration: &'static RapierConfiguration,
    lag: &'static mut SimulationToRenderTime,
    fields: &'static mut RapierContextFields,
}

/// Writers of Rapier's messages and of those of fields, and the commands that mark what Rapier disabled.
#[derive(SystemParam)]
pub(crate) struct Outlets<'w, 's> {
    commands: Commands<'w, 's>,
    collisions: MessageWriter<'w, CollisionEvent>,
    contact_forces: MessageWriter<'w, ContactForceEvent>,
    quarantines: MessageWriter<'w, PhysicsQuarantineEvent>,
    fields: FieldMessages<'w>,
}

/// The hooks and the clock of the app, for Rapier's steps.
struct Surroundings<'a> {
    hooks: &'a dyn PhysicsHooks,
    time: &'a Time,
}

/// Steps all contexts, in place of `bevy_rapier3d`'s system of the same name.
pub(crate) fn step_simulation<Hooks>(
    mut contexts: Query<Context>,
    timestep_mode: Res<TimestepMode>,
    hooks: StaticSystemParam<Hooks>,
    time: Res<Time>,
    mut outlets: Outlets,
    mut interpolations: Interpolations,
) where
    Hooks: 'static + BevyPhysicsHooks,
    for<'w, 's> SystemParamItem<'w, 's, Hooks>: BevyPhysicsHooks,
{
    let surroundings = Surroundings {
        hooks: &AppHooks(hooks.into_inner()),
        time: &time,
    };
    for mut context in &mut contexts {
        if context.configuration.physics_pipeline_active {
            let threads = context.configuration.num_threads;
            context.simulation.set_num_threads(threads);
            context.step_frame(
                *timestep_mode,
                &surroundings,
                &mut outlets,
                &mut interpolations,
            );
        } else {
            context.follow_bodies();
        }
        context.report(&mut outlets);
    }
}

impl ContextItem<'_, '_> {
    /// The steps of a frame.
    fn step_frame(
        &mut self,
        mode: TimestepMode,
        surroundings: &Surroundings<'_>,
        outlets: &mut Outlets<'_, '_>,
        interpolations: &mut Interpolations<'_, '_>,
    ) {
        let elapsed = surroundings.time.delta_secs();
        let steps = FrameSteps::new(mode, elapsed, &mut self.lag.diff);
        for round in 0..steps.rounds {
            if matches!(mode, TimestepMode::Interpolated { .. }) && round + 1 == steps.rounds {
                self.start_interpolations(interpolations);
            }
            for _ in 0..steps.substeps {
                if let Err(error) = self.step(steps.dt, surroundings, outlets) {
                    self.fields.reports.log_error(self.entity, &error);
                }
            }
        }
        self.simulation.integration_parameters.dt = steps.shown_dt;
        if steps.is_empty() {
            self.follow_bodies();
        }
    }

    /// One of Rapier's steps, with the fields around it.
    fn step(
        &mut self,
        dt: f32,
        surroundings: &Surroundings<'_>,
        outlets: &mut Outlets<'_, '_>,
    ) -> Result<(), StepError> {
        if self.configuration.simulation_mode == SimulationMode::CollisionOnly {
            self.rapier_step(dt, surroundings.hooks, surroundings.time, outlets);
            return Ok(());
        }
        let parameters = IntegrationParameters {
            dt,
            ..self.simulation.integration_parameters
        };
        let (fields, world) = self.split(&parameters);
        let open = fields.begin(world)?;
        let hooks = open.hooks(surroundings.hooks);
        self.rapier_step(dt, &hooks, surroundings.time, outlets);
        let (fields, world) = self.split(&parameters);
        fields.finish(open, world)?;
        self.fields.log_warnings();
        Ok(())
    }

    fn rapier_step(
        &mut self,
        dt: f32,
        hooks: &dyn PhysicsHooks,
        time: &Time,
        outlets: &mut Outlets<'_, '_>,
    ) {
        // With one step of fixed length per call, `bevy_rapier3d` keeps no time of its own.
        let mode = TimestepMode::Fixed { dt, substeps: 1 };
        self.simulation.step_simulation(
            &mut self.colliders,
            &mut self.joints,
            &mut self.bodies,
            self.configuration.gravity,
            self.configuration.simulation_mode,
            mode,
            Some((&outlets.collisions, &outlets.contact_forces)),
            hooks,
            time,
            &mut SimulationToRenderTime::default(),
            None,
        );
        let Outlets {
            collisions,
            contact_forces,
            ..
        } = outlets;
        self.simulation.send_bevy_events(collisions, contact_forces);
        self.mark_disabled(&mut outlets.commands);
    }

    /// The fields, and the world that they act on.
    fn split<'a>(
        &'a mut self,
        integration_parameters: &'a IntegrationParameters,
    ) -> (&'a mut rapier3d_fields::Fields, WorldMut<'a>) {
        let bodies = &mut *self.bodies;
        let joints = &mut *self.joints;
        let world = WorldMut {
            bodies: &mut bodies.bodies,
            colliders: &mut self.colliders.colliders,
            islands: &self.simulation.islands,
            narrow_phase: &self.simulation.narrow_phase,
            impulse_joints: &mut joints.impulse_joints,
            multibody_joints: &mut joints.multibody_joints,
            soft_bodies: &mut bodies.soft_bodies,
            gravity: self.configuration.gravity,
            integration_parameters,
        };
        (&mut *self.fields, world)
    }

    /// Starts the interpolation of bodies at their current poses.
    fn start_interpolations(&self, interpolations: &mut Interpolations<'_, '_>) {
        for (handle, mut interpolation) in interpolations {
            if let Some(body) = self.bodies.bodies.get(handle.0) {
                interpolation.start = Some(*body.position());
                interpolation.end = None;
            }
        }
    }

    /// Moves the colliders of bodies that the app moved, if no step does.
    fn follow_bodies(&mut self) {
        let bodies = &*self.bodies;
        bodies.propagate_modified_body_positions_to_colliders(&mut self.colliders);
    }

    /// Marks what Rapier's step disabled. The app enables it again by removing the mark.
    fn mark_disabled(&self, commands: &mut Commands<'_, '_>) {
        let quarantine = self.simulation.pipeline.quarantine();
        let bodies = quarantine.bodies().iter();
        for entity in bodies.filter_map(|it| self.bodies.rigid_body_entity(*it)) {
            commands.entity(entity).try_insert(RigidBodyDisabled);
        }
        let colliders = quarantine.colliders().iter();
        for entity in colliders.filter_map(|it| self.colliders.collider_entity(*it)) {
            commands.entity(entity).try_insert(ColliderDisabled);
        }
        let soft_bodies = quarantine.soft_bodies().iter();
        for entity in soft_bodies.filter_map(|it| self.bodies.soft_body_entity(*it)) {
            commands.entity(entity).try_insert(SoftBodyDisabled);
        }
    }

    /// Sends the messages of the steps of a frame.
    fn report(&mut self, outlets: &mut Outlets<'_, '_>) {
        let quarantines = &mut outlets.quarantines;
        self.simulation
            .send_quarantine_events(self.entity, quarantines);
        let fields = &mut *self.fields;
        let entities = Entities {
            context: self.entity,
            owners: &fields.owners,
            bodies: &self.bodies,
            colliders: &self.colliders,
        };
        fields.reports.send(&entities, &mut outlets.fields);
        fields.forget_removed();
    }
}
