//! Predictions: a copy of a world with its fields, which is stepped ahead.

use super::Fields;
use crate::bridge::StepError;
use crate::math::{Pose, RigidBodyHandle};
use crate::pipeline::StepOutcome;
use crate::rapier::pipeline::{CollisionPipeline, PhysicsPipeline, PhysicsWorld};

/// A copy of a world with its fields, which can be stepped ahead; made by [`Fields::predict`].
pub struct Prediction {
    /// The copy of the world, under the same handles.
    pub world: PhysicsWorld,
    /// The copy of its fields.
    pub fields: Fields,
}

impl Fields {
    /// A copy of a world and of these fields, which can be stepped, pushed and edited without changing either, to
    /// predict paths.
    ///
    /// The copy has all of Rapier's sets, with contacts, joints, islands and the trees of the broad phase, gravity and
    /// parameters; and the fields, their settings and their state. It does not have the workspaces of the pipelines,
    /// which the first step fills anew (a thread pool set for the pipeline is one of them), nor the channels of
    /// [contact](crate::FieldsBuilder::events) and [zone](crate::Fields::set_zone_events) events.
    ///
    /// So its steps are those of [`Fields::step`], bit for bit, as long as both get the same input, including your own
    /// hooks. There are three exceptions. After an edit of a mass or a collider, the first predicted step has the new
    /// mass or samples where the fields' own step [may still have the old ones](crate::StepWarning::MassChanged). A
    /// step by [`begin`](Fields::begin) and `finish` marks a body as modified, which may change Rapier's order of
    /// bodies. And Rapier may keep a joint in its workspace after the type of a body was changed.
    ///
    /// It costs a copy of each set, and a compilation of the fields in the first step; each step then costs the same as
    /// a step of the world. Shapes are shared.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// let ball = RigidBodyBuilder::dynamic().linvel(Vector::new(4.0, 8.0, 0.0));
    /// let (ball, _) = world.insert(ball, ColliderBuilder::ball(0.1));
    /// let mut fields = Fields::new(Field::wind(Vector::X * -6.0, 0.0, 0.05))?;
    /// let path = fields.predict(&world).path(ball, 60)?;
    /// for pose in path {
    ///     fields.step(&mut world)?;
    ///     assert_eq!(*world.bodies[ball].position(), pose);
    /// }
    /// # Ok::<(), StepError>(())
    /// ```
    #[must_use]
    pub fn predict(&self, world: &PhysicsWorld) -> Prediction {
        Prediction {
            world: copy(world),
            fields: self.clone(),
        }
    }
}

impl Prediction {
    /// One step of the copy.
    ///
    /// # Errors
    /// As [`Fields::step`].
    pub fn step(&mut self) -> Result<StepOutcome, StepError> {
        self.fields.step(&mut self.world)
    }

    /// The pose of a body after each of the next steps, as long as the body is in the world.
    ///
    /// # Errors
    /// As [`Fields::step`].
    pub fn path(&mut self, body: RigidBodyHandle, steps: usize) -> Result<Vec<Pose>, StepError> {
        let mut path = Vec::new();
        for _ in 0..steps {
            self.step()?;
            path.extend(self.world.bodies.get(body).map(|body| *body.position()));
        }
        Ok(path)
    }
}

/// The copy has the fields, the settings and the state, so it continues like the original, bit for bit. It sends no
/// [events](crate::FieldsBuilder::events), and its first step compiles the fields.
impl Clone for Fields {
    fn clone(&self) -> Self {
        Fields {
            settings: self.settings.clone(),
            state: self.state.clone(),
            set: self.set.clone(),
            pipeline: self.pipeline.for_copy(),
        }
    }
}

/// Copies all of a world except the workspaces of its pipelines, which a step fills anew.
fn copy(world: &PhysicsWorld) -> PhysicsWorld {
    PhysicsWorld {
        gravity: world.gravity,
        integration_parameters: world.integration_parameters,
        physics_pipeline: PhysicsPipeline::new(),
        collision_pipeline: CollisionPipeline::new(),
        islands: world.islands.clone(),
        broad_phase: world.broad_phase.clone(),
        narrow_phase: world.narrow_phase.clone(),
        bodies: world.bodies.clone(),
        colliders: world.colliders.clone(),
        impulse_joints: world.impulse_joints.clone(),
        multibody_joints: world.multibody_joints.clone(),
        soft_bodies: world.soft_bodies.clone(),
        ccd_solver: Default::default(),
    }
}
