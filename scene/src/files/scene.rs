//! Whole scenes.

use std::collections::HashMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::body::BodyDoc;
use super::collider::{ColliderDoc, ProbeDoc};
use super::error::{FileError, content};
use super::fields::math::{ColliderHandle, Real, RigidBodyHandle};
use super::fields::rapier::pipeline::PhysicsWorld;
use super::fields::{Detection, Fields, Scheme};
use super::names::Directory;
use super::number::{Triple, bounded, triple, unless};
use super::parameters::ParametersDoc;
use super::settings::FieldsDoc;

/// The version of the schema that this crate writes, and the only one it reads.
const VERSION: u32 = 1;

/// A scene in the form of a file: Rapier's settings, bodies, and a tree of fields with its settings.
///
/// ```
/// use rapier3d_fields_scene::single::{Document, SceneFile};
/// let text = r#"{
///   "version": 1,
///   "gravity": [0, 0, 0],
///   "bodies": [{ "at": [4, 0, 0], "velocity": [0, 1, 0], "colliders": [{ "shape": { "ball": { "radius": 0.1 } } }] }],
///   "fields": { "tree": { "field": { "formula": { "point-gravity": { "mu": 4 } } } } }
/// }"#;
/// let mut scene = SceneFile::from_json(text)?.build()?;
/// for _ in 0..60 {
///     scene.fields.step(&mut scene.world)?;
/// }
/// let moon = &scene.world.bodies[scene.bodies[0]];
/// assert!((moon.translation().length() - 4.0).abs() < 1e-3, "a circular orbit");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SceneFile {
    version: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    about: Option<String>,
    #[serde(default = "usual_gravity")]
    gravity: Triple,
    #[serde(default)]
    parameters: ParametersDoc,
    #[serde(default)]
    bodies: Vec<BodyDoc>,
    fields: FieldsDoc,
    /// The text from which it was read, for the places in error messages.
    #[serde(skip)]
    text: Option<Arc<str>>,
}

/// Rapier's default gravity.
fn usual_gravity() -> Triple {
    triple(PhysicsWorld::default().gravity)
}

/// A scene ready to run.
pub struct Scene {
    /// The world.
    pub world: PhysicsWorld,
    /// Its fields.
    pub fields: Fields,
    /// The bodies, in the order of the file.
    pub bodies: Vec<RigidBodyHandle>,
    /// By body, its colliders, in the order of the file.
    pub parts: Vec<Vec<ColliderHandle>>,
    numbers: HashMap<ColliderHandle, (usize, usize)>,
}

impl Scene {
    /// The numbers of a collider in the file: of its body, and among that body's colliders.
    pub fn part_of(&self, collider: ColliderHandle) -> Option<(usize, usize)> {
        self.numbers.get(&collider).copied()
    }
}

impl SceneFile {
    /// A world with its fields in the form of a file. Bodies are numbered from 0, in the order of their
    /// handles, and colliders in the order in which they were attached to their body.
    ///
    /// Rapier's state of the last step (contacts, impulses, islands) is not part of a scene, so a running
    /// world that is written and built again may continue differently in its contacts; a snapshot of world
    /// and fields keeps that state. `user_data`, events and hooks are left out.
    ///
    /// # Errors
    /// The world has something that a file cannot hold: closures and predicates, joints, soft bodies, colliders
    /// without a body, shapes such as height fields, numbers that are not finite, sleeping thresholds other
    /// than Rapier's defaults, and anything that [`build`](Self::build) refuses, such as a body farther away
    /// than 1e15. So every file that is written can be read.
    pub fn new(world: &PhysicsWorld, fields: &Fields) -> Result<Self, FileError> {
        refuse_what_is_missing(world)?;
        let mut directory = Directory::default();
        let mut bodies = Vec::new();
        for (handle, body) in world.bodies.iter() {
            let place = format!("bodies[{}]", bodies.len());
            let mut doc = BodyDoc::write(body).map_err(|error| error.within(&place))?;
            for (number, part) in body.colliders().iter().enumerate() {
                let place = format!("{place}.colliders[{number}]");
                let collider = world.colliders.get(*part);
                let gone = || content("the collider is not in the world");
                let written = collider.ok_or_else(gone).and_then(ColliderDoc::write);
                doc.colliders
                    .push(written.map_err(|error| error.within(&place))?);
            }
            directory.push(None, handle, body.colliders().to_vec());
            bodies.push(doc);
        }
        for (body, sampling) in fields.set.samplings() {
            if let Some(number) = directory.number_of_body(body) {
                bodies[number].sampling = Some(sampling);
            }
        }
        for (collider, properties) in fields.set.colliders() {
            if let Some((body, part)) = directory.number_of_part(collider) {
                bodies[body].colliders[part].probe = Some(ProbeDoc::write(properties));
            }
        }
        let fields = FieldsDoc::write(fields, Some(&directory));
        let file = SceneFile {
            version: VERSION,
            about: None,
            gravity: triple(world.gravity),
            parameters: ParametersDoc::write(&world.integration_parameters),
            bodies,
            fields: fields.map_err(|error| error.within("fields"))?,
            text: None,
        };
        // A file that could not be built again is refused here, while the world still exists.
        file.make()?;
        Ok(file)
    }

    /// Sets the description of the scene, for readers.
    pub fn about(mut self, text: &str) -> Self {
        self.about = Some(text.to_owned());
        self
    }

    /// The description of the scene, if the file has one.
    pub fn description(&self) -> Option<&str> {
        self.about.as_deref()
    }

    /// Builds the world and its fields.
    ///
    /// # Errors
    /// The scene is not possible: it has a body that is not there, a shape without volume, or a tree
    /// that [`Fields`] refuses.
    pub fn build(&self) -> Result<Scene, FileError> {
        let text = self.text.as_deref();
        self.make().map_err(|error| match text {
            Some(text) => error.located(text),
            None => error,
        })
    }

    pub(super) fn with_text(mut self, text: &str) -> Self {
        self.text = Some(text.into());
        self
    }

    fn make(&self) -> Result<Scene, FileError> {
        if self.version != VERSION {
            let message = format!("expected {VERSION}, found {}", self.version);
            return Err(content(message).within("version"));
        }
        let parameters = self.parameters.read();
        let mut world = PhysicsWorld {
            gravity: bounded("gravity", Some(self.gravity))?,
            integration_parameters: parameters.map_err(|error| error.within("parameters"))?,
            ..PhysicsWorld::default()
        };
        let directory = self.build_bodies(&mut world)?;
        let fields = self.fields.read(Some(&directory));
        let mut fields = fields.map_err(|error| error.within("fields"))?;
        self.set_properties(&mut fields, &directory, &world)?;
        Ok(Scene {
            world,
            fields,
            bodies: directory.bodies,
            parts: directory.parts,
            numbers: directory.part_numbers,
        })
    }

    fn build_bodies(&self, world: &mut PhysicsWorld) -> Result<Directory, FileError> {
        let mut directory = Directory::default();
        for (number, doc) in self.bodies.iter().enumerate() {
            let place = format!("bodies[{number}]");
            let body = doc.read().map_err(|error| error.within(&place))?;
            let body = world.bodies.insert(body);
            let mut parts = Vec::new();
            for (number, doc) in doc.colliders.iter().enumerate() {
                let place = format!("{place}.colliders[{number}]");
                let collider = doc.read().map_err(|error| error.within(&place))?;
                let bodies = &mut world.bodies;
                parts.push(world.colliders.insert_with_parent(collider, body, bodies));
            }
            // Rapier would do this in its next step, and ignore impulses until then.
            world.bodies[body].recompute_mass_properties_from_colliders(&world.colliders);
            directory.push(doc.name.as_deref(), body, parts);
        }
        Ok(directory)
    }

    fn set_properties(
        &self,
        fields: &mut Fields,
        directory: &Directory,
        world: &PhysicsWorld,
    ) -> Result<(), FileError> {
        let numbered = self.bodies.iter().enumerate();
        for ((number, doc), (body, parts)) in numbered.zip(directory.pairs()) {
            if let Some(sampling) = doc.sampling {
                let set = fields.set_sampling(*body, sampling, &world.bodies);
                let here = format!("bodies[{number}].sampling");
                set.map_err(|error| content(error.to_string()).within(&here))?;
            }
            for ((place, collider), part) in doc.colliders.iter().enumerate().zip(parts) {
                if let Some(probe) = &collider.probe {
                    let set = fields.set_properties(*part, probe.read(), &world.colliders);
                    let here = format!("bodies[{number}].colliders[{place}].probe");
                    set.map_err(|error| content(error.to_string()).within(&here))?;
                }
            }
        }
        Ok(())
    }

    /// Replaces the time step.
    pub fn dt(mut self, dt: Real) -> Self {
        self.parameters.set_dt(dt);
        self
    }

    /// Replaces the scheme.
    pub fn scheme(mut self, scheme: Scheme) -> Self {
        self.fields.scheme = Some(scheme);
        self
    }

    /// Replaces the detection.
    pub fn detection(mut self, detection: Detection) -> Self {
        self.fields.detection = Some(detection);
        self
    }

    /// The JSON Schema of such files.
    #[cfg(feature = "schema")]
    pub fn schema() -> schemars::Schema {
        let mut schema = schemars::schema_for!(SceneFile);
        schema.insert("title".to_owned(), "Scene of rapier3d-fields".into());
        schema
    }

    /// The number of bodies.
    pub fn body_count(&self) -> usize {
        self.bodies.len()
    }

    /// The name of a body, if the file gives it one.
    pub fn body_name(&self, number: usize) -> Option<&str> {
        self.bodies.get(number)?.name.as_deref()
    }

    /// Names a body, for readers.
    pub fn name_body(mut self, number: usize, name: &str) -> Self {
        if let Some(body) = self.bodies.get_mut(number) {
            body.name = Some(name.to_owned());
        }
        self
    }
}

/// Refuses worlds with parts that a file cannot hold.
fn refuse_what_is_missing(world: &PhysicsWorld) -> Result<(), FileError> {
    let joints = world.impulse_joints.len() + world.multibody_joints.iter().count();
    if joints > 0 {
        return Err(content("joints cannot stand in a file").within("bodies"));
    }
    if !world.soft_bodies.is_empty() {
        return Err(content("soft bodies cannot stand in a file").within("bodies"));
    }
    let mut colliders = world.colliders.iter();
    if colliders.any(|(_, collider)| collider.parent().is_none()) {
        let message = "a collider without a body cannot stand in a file: give it a fixed one";
        return Err(content(message).within("bodies"));
    }
    let unless_usual = unless(world.integration_parameters.soft_bodies, Default::default());
    if unless_usual.is_some() {
        return Err(content("settings of soft bodies cannot stand in a file").within("parameters"));
    }
    Ok(())
}
