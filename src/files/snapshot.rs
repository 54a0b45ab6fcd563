//! Snapshots: fields that go on where they were.

use serde::{Deserialize, Serialize};

use super::collider::ProbeDoc;
use super::error::{FileError, content};
use super::settings::FieldsDoc;
use crate::field::Sampling;
use crate::fields::Fields;
use crate::inject::InjectorState;
use crate::math::{ColliderHandle, RigidBodyHandle};
use crate::rapier::pipeline::PhysicsWorld;

/// Fields between two steps, to go on from later: with Rapier's own serialisation of the world it
/// belongs to, the run goes on as it would have, bit for bit.
///
/// It holds the tree, the settings, the properties of samples, the time, and what a step takes over
/// from the last: the evaluation at its end, and under which wrenches sleepers rest. It does not
/// hold results: [contacts](Fields::contacts), the [cross-check](Fields::cross_check) and the
/// [audit](Fields::audit) begin anew; nor the channel of [events](crate::FieldsBuilder::events).
/// Bodies and colliders are Rapier's handles.
///
/// JSON has no infinity, which Rapier's types may hold; use a format that has, such as CBOR. Only
/// Rapier's own state decides how Rapier goes on: its `PhysicsWorld` is to be serialised as a whole.
///
/// ```
/// use rapier3d_fields::files::FieldsSnapshot;
/// use rapier3d_fields::prelude::*;
/// # let mut world = PhysicsWorld::new();
/// # world.insert(RigidBodyBuilder::dynamic().translation(Vector::X), ColliderBuilder::ball(0.5));
/// let mut fields = Fields::new(Field::spring(4.0))?;
/// fields.step(&mut world)?;
/// let mut saved = Vec::new();
/// ciborium::into_writer(&(&world, FieldsSnapshot::new(&fields)?), &mut saved)?;
///
/// let (mut world, snapshot): (PhysicsWorld, FieldsSnapshot) = ciborium::from_reader(&saved[..])?;
/// let mut fields = snapshot.restore(&world)?;
/// fields.step(&mut world)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FieldsSnapshot {
    fields: FieldsDoc,
    samples: Vec<(ColliderHandle, ProbeDoc)>,
    samplings: Vec<(RigidBodyHandle, Sampling)>,
    state: InjectorState,
    claimed: bool,
}

impl FieldsSnapshot {
    /// Takes the present state, between two steps.
    ///
    /// # Errors
    /// The tree holds code, which cannot be written; or something is not finite, or nested too
    /// deeply.
    pub fn new(fields: &Fields) -> Result<Self, FileError> {
        let settings = fields.settings();
        let samples = settings.book.colliders().iter();
        Ok(FieldsSnapshot {
            fields: FieldsDoc::write(&settings, None)?,
            samples: samples
                .map(|(part, p)| (*part, ProbeDoc::write(p)))
                .collect(),
            samplings: settings.book.samplings().to_vec(),
            state: fields.state(),
            claimed: settings.claimed,
        })
    }

    /// The fields as they were, in the world as it was.
    ///
    /// # Errors
    /// The snapshot was changed, and says what is not possible.
    pub fn restore(self, world: &PhysicsWorld) -> Result<Fields, FileError> {
        let mut fields = self.fields.read(None)?;
        for (part, doc) in &self.samples {
            // Properties of colliders that were removed are not missed.
            if world.colliders.contains(*part) {
                fields.set_properties(*part, doc.read(), &world.colliders)?;
            }
        }
        for (body, sampling) in &self.samplings {
            if world.bodies.contains(*body) {
                fields.set_sampling(*body, *sampling, &world.bodies)?;
            }
        }
        if self.state.is_bad() {
            return Err(content("a state that no step leaves behind").within("state"));
        }
        fields.resume(self.state, self.claimed, &world.bodies, &world.colliders);
        Ok(fields)
    }
}
