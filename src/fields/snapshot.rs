//! Snapshots: fields that go on where they were.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::Fields;
use crate::contact::{Detection, Responder};
use crate::field::{Registry, Sampling, Tree, TreeError};
use crate::inject::{InjectorState, Scheme, WakePolicy};
use crate::math::{ColliderHandle, Real, RigidBodyHandle};
use crate::rapier::pipeline::PhysicsWorld;
use crate::sample::{ColliderProperties, PropertyError};

/// Fields between two steps, to go on from later: with Rapier's own serialisation of the world it
/// belongs to, the run goes on as it would have, bit for bit.
///
/// It holds the tree, the settings, the properties of samples, the time, and what a step takes over
/// from the last: the evaluation at its end, and under which wrenches sleepers rest. It does not
/// hold results: [contacts](Fields::contacts), the [cross-check](Fields::cross_check) and the
/// [audit](Fields::audit) begin anew; nor the channel of [events](crate::FieldsBuilder::events).
/// Bodies and colliders are Rapier's handles; closures are saved by name.
///
/// JSON has no infinity, which Rapier's types may hold; use a format that has, such as CBOR. Only
/// Rapier's own state decides how Rapier goes on: its `PhysicsWorld` is to be serialised as a whole.
///
/// ```
/// use rapier3d_fields::FieldsSnapshot;
/// use rapier3d_fields::prelude::*;
/// # let mut world = PhysicsWorld::new();
/// # world.insert(RigidBodyBuilder::dynamic().translation(Vector::X), ColliderBuilder::ball(0.5));
/// let mut fields = Fields::new(Field::spring(4.0))?;
/// fields.step(&mut world)?;
/// let mut saved = Vec::new();
/// ciborium::into_writer(&(&world, FieldsSnapshot::new(&fields)), &mut saved)?;
///
/// let (mut world, snapshot): (PhysicsWorld, FieldsSnapshot) = ciborium::from_reader(&saved[..])?;
/// let mut fields = snapshot.restore(&world)?;
/// fields.step(&mut world)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FieldsSnapshot {
    tree: Tree,
    axes: Vec<(Arc<str>, Real)>,
    scheme: Scheme,
    wake: WakePolicy,
    responder: Responder,
    responder_among: Vec<(Vec<ColliderHandle>, Responder)>,
    detection: Detection,
    cross_check: bool,
    audit: bool,
    time: f64,
    properties: Vec<(ColliderHandle, ColliderProperties)>,
    samplings: Vec<(RigidBodyHandle, Sampling)>,
    state: (InjectorState, bool),
}

/// Why a snapshot was not restored.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SnapshotError {
    /// The tree or a setting was refused.
    #[error(transparent)]
    Tree(#[from] TreeError),
    /// A property of a sample was refused.
    #[error(transparent)]
    Property(#[from] PropertyError),
    /// It holds a state that no step leaves behind.
    #[error("the snapshot holds a state that no step leaves behind")]
    State,
}

impl FieldsSnapshot {
    /// Takes the present state, between two steps.
    pub fn new(fields: &Fields) -> Self {
        let settings = fields.settings();
        let properties = settings.properties.into_iter();
        FieldsSnapshot {
            tree: settings.tree.clone(),
            axes: settings.axes,
            scheme: settings.scheme,
            wake: settings.wake,
            responder: settings.responder,
            responder_among: settings.responder_among,
            detection: settings.detection,
            cross_check: settings.cross_check.is_some(),
            audit: settings.audit,
            time: settings.time,
            properties: properties.map(|(c, p)| (c, p.clone())).collect(),
            samplings: settings.samplings,
            state: fields.state(),
        }
    }

    /// Looks up the functions of closures.
    ///
    /// # Errors
    /// The registry lacks one.
    pub fn resolve(&mut self, registry: &Registry) -> Result<(), TreeError> {
        self.tree.resolve(registry)
    }

    /// The fields as they were, in the world as it was.
    ///
    /// # Errors
    /// The snapshot was changed, and says what is not possible.
    pub fn restore(self, world: &PhysicsWorld) -> Result<Fields, SnapshotError> {
        let mut builder = Fields::builder(self.tree)
            .scheme(self.scheme)
            .wake(self.wake)
            .responder(self.responder)
            .detection(self.detection)
            .cross_check(self.cross_check)
            .audit(self.audit);
        for (colliders, responder) in self.responder_among {
            builder = builder.responder_among(colliders, responder);
        }
        for (name, value) in &self.axes {
            builder = builder.axis(name, *value);
        }
        let mut fields = builder.build()?;
        fields.set_time(self.time);
        for (collider, properties) in self.properties {
            // Properties of colliders that were removed are not missed.
            if world.colliders.contains(collider) {
                fields.set_properties(collider, properties, &world.colliders)?;
            }
        }
        for (body, sampling) in self.samplings {
            if world.bodies.contains(body) {
                fields.set_sampling(body, sampling, &world.bodies)?;
            }
        }
        if self.state.0.is_bad() || !self.time.is_finite() {
            return Err(SnapshotError::State);
        }
        fields.resume(self.state, &world.bodies, &world.colliders);
        Ok(fields)
    }
}
