//! The parts of a Rapier world that a step needs, borrowed mutably or read only.

use crate::field::{Anchor, Frame, Frames};
use crate::math::{ColliderHandle, ColliderSet, RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::dynamics::{
    ImpulseJointSet, IntegrationParameters, IslandManager, MultibodyJointSet, RigidBody,
    SoftBodySet,
};
use crate::rapier::geometry::{Collider, NarrowPhase};
use crate::rapier::pipeline::PhysicsWorld;
use crate::rigid::{Lookup, is_sound, origin_velocity};

/// All parts of a world that a step reads or writes, borrowed from wherever they are kept: for
/// [`Fields::begin`](crate::Fields::begin) and [`Fields::finish`](crate::Fields::finish) around a pipeline of your own.
/// From a `PhysicsWorld` by `WorldMut::from(&mut world)`.
pub struct WorldMut<'a> {
    /// All rigid bodies.
    pub bodies: &'a mut RigidBodySet,
    /// All colliders.
    pub colliders: &'a mut ColliderSet,
    /// Rapier's islands, which hold the active bodies.
    pub islands: &'a IslandManager,
    /// The contacts that Rapier found in its last step.
    pub narrow_phase: &'a NarrowPhase,
    /// Joints between bodies. These and the multibody joints are written only if a step is refused after Rapier's.
    pub impulse_joints: &'a mut ImpulseJointSet,
    /// Multibodies (articulations): their links ignore impulses, so forces push them.
    pub multibody_joints: &'a mut MultibodyJointSet,
    /// Soft bodies: fields push their particles one by one.
    pub soft_bodies: &'a mut SoftBodySet,
    /// The gravity that is passed to Rapier's step.
    pub gravity: Vector,
    /// The parameters that are passed to Rapier's step: time step, solver iterations, speed limit.
    pub integration_parameters: &'a IntegrationParameters,
}

impl<'a> From<&'a mut PhysicsWorld> for WorldMut<'a> {
    fn from(world: &'a mut PhysicsWorld) -> Self {
        WorldMut {
            bodies: &mut world.bodies,
            colliders: &mut world.colliders,
            islands: &world.islands,
            narrow_phase: &world.narrow_phase,
            impulse_joints: &mut world.impulse_joints,
            multibody_joints: &mut world.multibody_joints,
            soft_bodies: &mut world.soft_bodies,
            gravity: world.gravity,
            integration_parameters: &world.integration_parameters,
        }
    }
}

impl WorldMut<'_> {
    /// The same borrows for a shorter lifetime.
    pub fn as_mut(&mut self) -> WorldMut<'_> {
        WorldMut {
            bodies: self.bodies,
            colliders: self.colliders,
            islands: self.islands,
            narrow_phase: self.narrow_phase,
            impulse_joints: self.impulse_joints,
            multibody_joints: self.multibody_joints,
            soft_bodies: self.soft_bodies,
            gravity: self.gravity,
            integration_parameters: self.integration_parameters,
        }
    }

    pub(crate) fn view(&self) -> WorldRef<'_> {
        WorldRef::new(self.bodies, self.colliders)
    }
}

/// The bodies and colliders of a world, borrowed read only. Methods of [`Fields`](crate::Fields) that do not change
/// the world take it, as `&world` of a `PhysicsWorld` or as `WorldRef::new(&bodies, &colliders)`.
#[derive(Clone, Copy)]
pub struct WorldRef<'a> {
    /// All rigid bodies.
    pub bodies: &'a RigidBodySet,
    /// All colliders.
    pub colliders: &'a ColliderSet,
}

impl<'a> From<&'a PhysicsWorld> for WorldRef<'a> {
    fn from(world: &'a PhysicsWorld) -> Self {
        WorldRef::new(&world.bodies, &world.colliders)
    }
}

impl<'a> From<&'a mut PhysicsWorld> for WorldRef<'a> {
    fn from(world: &'a mut PhysicsWorld) -> Self {
        WorldRef::from(&*world)
    }
}

impl<'a> WorldRef<'a> {
    /// Borrows sets that are kept outside of a `PhysicsWorld`.
    pub fn new(bodies: &'a RigidBodySet, colliders: &'a ColliderSet) -> Self {
        WorldRef { bodies, colliders }
    }
}

impl Lookup for WorldRef<'_> {
    fn body(&self, handle: RigidBodyHandle) -> Option<&RigidBody> {
        self.bodies.get(handle)
    }

    fn collider(&self, handle: ColliderHandle) -> Option<&Collider> {
        self.colliders.get(handle)
    }

    fn bodies(&self) -> impl Iterator<Item = (RigidBodyHandle, &RigidBody)> {
        self.bodies.iter()
    }

    fn free_colliders(&self) -> impl Iterator<Item = (ColliderHandle, &Collider)> {
        let colliders = self.colliders.iter();
        colliders.filter(|(_, collider)| collider.parent().is_none())
    }
}

impl Frames for WorldRef<'_> {
    fn frame(&self, anchor: &Anchor) -> Option<Frame> {
        let WorldRef { bodies, colliders } = *self;
        let of_body = |handle: RigidBodyHandle| {
            let body = bodies.get(handle).filter(|body| is_sound(body))?;
            Some(Frame {
                pose: *body.position(),
                velocity: origin_velocity(body),
                angvel: body.angvel(),
                body: Some(handle),
                collider: None,
            })
        };
        anchor.frame(of_body, |handle| colliders.get(handle))
    }
}
