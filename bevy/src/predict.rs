//! Prediction of paths.

use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy_rapier3d::prelude::*;
use bevy_rapier3d::rapier::dynamics::{IntegrationParameters, RigidBodyHandle};
use bevy_rapier3d::rapier::pipeline::{CollisionPipeline, PhysicsPipeline, PhysicsWorld};
use rapier3d_fields::{Prediction, StepError};

use crate::context::RapierContextFields;

/// A system parameter that predicts the paths of bodies, by stepping a copy of their context.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_rapier3d_fields::prelude::*;
/// #[derive(Component)]
/// struct Comet;
/// fn draw_path(comet: Single<Entity, With<Comet>>, ahead: PredictFields) {
///     for place in ahead.path(*comet, 60).unwrap_or_default() {
///         println!("{}", place.translation);
///     }
/// }
/// ```
#[derive(SystemParam)]
pub struct PredictFields<'w, 's> {
    contexts: Query<'w, 's, Context>,
    bodies: Query<
        'w,
        's,
        (
            &'static RapierRigidBodyHandle,
            &'static RapierContextEntityLink,
        ),
    >,
    timestep_mode: Res<'w, TimestepMode>,
}

/// All components of a context that a copy needs.
type Context = (
    &'static RapierContextSimulation,
    &'static RapierContextColliders,
    &'static RapierContextJoints,
    &'static RapierRigidBodySet,
    &'static RapierConfiguration,
    &'static RapierContextFields,
);

impl PredictFields<'_, '_> {
    /// The poses of a body in the world after each of Rapier's next steps; empty if the entity is not (yet) a body.
    ///
    /// They are those in the app as long as it changes nothing and has no hooks: bit for bit, if its steps are of equal
    /// length. The cost is a copy of the context, and that of a real step for each step.
    ///
    /// # Errors
    /// If the fields cannot act; see [`StepError`].
    pub fn path(&self, body: Entity, steps: usize) -> Result<Vec<Transform>, StepError> {
        let Ok((handle, link)) = self.bodies.get(body) else {
            return Ok(Vec::new());
        };
        let Some(mut copy) = self.copy(link.0) else {
            return Ok(Vec::new());
        };
        let poses = copy.path(handle.0, steps)?.into_iter();
        let places = poses.map(|pose| Transform {
            translation: pose.translation,
            rotation: pose.rotation,
            ..Transform::default()
        });
        Ok(places.collect())
    }

    /// A copy of a context with its fields, to be stepped, pushed and edited; `None` if there is no such context.
    ///
    /// Its time step is that of Rapier's steps in the app. In the mode `Variable` it is that of the last frame, or the
    /// longest one if the last frame had no length.
    pub fn copy(&self, context: Entity) -> Option<Prediction> {
        let (simulation, colliders, joints, bodies, configuration, fields) =
            self.contexts.get(context).ok()?;
        let world = PhysicsWorld {
            gravity: configuration.gravity,
            integration_parameters: IntegrationParameters {
                dt: self.dt(simulation),
                ..simulation.integration_parameters
            },
            physics_pipeline: PhysicsPipeline::new(),
            collision_pipeline: CollisionPipeline::new(),
            islands: simulation.islands.clone(),
            broad_phase: simulation.broad_phase.clone(),
            narrow_phase: simulation.narrow_phase.clone(),
            bodies: bodies.bodies.clone(),
            colliders: colliders.colliders.clone(),
            impulse_joints: joints.impulse_joints.clone(),
            multibody_joints: joints.multibody_joints.clone(),
            soft_bodies: bodies.soft_bodies.clone(),
            ccd_solver: Default::default(),
        };
        let fields = fields.fields().clone();
        Some(Prediction { world, fields })
    }

    /// The handle of a body, for a [copy](Self::copy) of its context.
    pub fn handle(&self, body: Entity) -> Option<RigidBodyHandle> {
        self.bodies.get(body).ok().map(|it| it.0.0)
    }

    fn dt(&self, simulation: &RapierContextSimulation) -> f32 {
        match *self.timestep_mode {
            TimestepMode::Fixed { dt, substeps } => dt / substeps as f32,
            TimestepMode::Interpolated {
                dt,
                time_scale,
                substeps,
            } => dt / substeps as f32 * time_scale,
            TimestepMode::Variable {
                max_dt, substeps, ..
            } => {
                let last = simulation.integration_parameters.dt;
                let last = if last > 0.0 { last } else { max_dt };
                last / substeps as f32
            }
        }
    }
}
