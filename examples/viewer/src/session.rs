//! A scene file that is open: its world and fields, which are read anew when the file changes.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use rapier3d_fields::debug_render::{FieldDebugRenderMode, FieldDebugRenderPipeline};
use rapier3d_fields::diagnose::PotentialEnergy;
use rapier3d_fields::prelude::*;
use rapier3d_fields_scene::single::{Document, Scene, SceneFile};

use crate::drawing::Lines;

/// The mechanical energy of a scene, without that of Rapier's own gravity.
pub struct Energies {
    pub kinetic: f64,
    pub fields: PotentialEnergy,
}

pub struct Session {
    path: PathBuf,
    /// The time at which the file was last changed, as far as it is known.
    changed: Option<SystemTime>,
    pub scene: Scene,
    pub about: String,
    /// Steps since the scene was read.
    pub steps: usize,
    /// The reason why the changed file was refused.
    pub refused_file: Option<String>,
    /// The reason why the last step was refused.
    pub refused_step: Option<String>,
    /// The warnings of the last step.
    pub warnings: Vec<StepWarning>,
    pub drawing: FieldDebugRenderPipeline,
}

impl Session {
    /// # Errors
    /// The file cannot be read, or is not a scene.
    pub fn open(path: &Path, mode: FieldDebugRenderMode) -> Result<Self, String> {
        let (scene, about) = read(path)?;
        let mut session = Session {
            path: path.to_owned(),
            changed: time_of(path),
            scene,
            about,
            steps: 0,
            refused_file: None,
            refused_step: None,
            warnings: Vec::new(),
            drawing: FieldDebugRenderPipeline::new(Default::default(), mode),
        };
        session.scene.fields.set_timed(true);
        Ok(session)
    }

    /// Reads the file anew if it has changed. Returns true if the scene is another one now; a file that is refused
    /// leaves the scene as it is.
    pub fn reload_if_changed(&mut self) -> bool {
        let changed = time_of(&self.path);
        if changed == self.changed {
            return false;
        }
        self.changed = changed;
        match read(&self.path) {
            Ok((scene, about)) => {
                (self.scene, self.about) = (scene, about);
                self.steps = 0;
                (self.refused_file, self.refused_step) = (None, None);
                self.warnings.clear();
                self.scene.fields.set_timed(true);
                true
            }
            Err(refused) => {
                self.refused_file = Some(refused);
                false
            }
        }
    }

    /// Makes one step. A step that is refused leaves the world as it was.
    pub fn step(&mut self) {
        let Scene { world, fields, .. } = &mut self.scene;
        match fields.step(world) {
            Ok(_) => {
                self.steps += 1;
                self.refused_step = None;
                self.warnings = fields.warnings().to_vec();
            }
            Err(error) => self.refused_step = Some(error.to_string()),
        }
    }

    pub fn energies(&self) -> Energies {
        let bodies = self.scene.world.bodies.iter();
        let kinetic = bodies.map(|(_, body)| f64::from(body.kinetic_energy()));
        Energies {
            kinetic: kinetic.sum(),
            fields: self.scene.fields.potential_energy(&self.scene.world),
        }
    }

    /// Draws the fields as lines.
    pub fn draw(&mut self, lines: &mut Lines<'_>) {
        let Scene { world, fields, .. } = &self.scene;
        self.drawing.render(lines, fields, world);
    }
}

fn read(path: &Path) -> Result<(Scene, String), String> {
    let place = path.display();
    let text = std::fs::read_to_string(path).map_err(|error| format!("{place}: {error}"))?;
    let refused = |error| format!("{place}: {error}");
    let file = SceneFile::from_json(&text).map_err(refused)?;
    let about = file.description().unwrap_or_default().to_owned();
    let scene = file.build().map_err(refused)?;
    Ok((scene, about))
}

fn time_of(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path)
        .and_then(|data| data.modified())
        .ok()
}
