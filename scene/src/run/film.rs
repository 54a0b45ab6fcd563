//! The page that replays a run.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use super::super::{Pace, Recorder};
use super::fields::math::{Real, to_f64};
use super::tables::create_file;
use super::{Scene, SceneFile};
use crate::page::Page;
use crate::program::{AnyError, Options};

/// The recording for the page, if a page was asked for.
pub struct Film(Option<Recording>);

struct Recording {
    path: String,
    file: File,
    recorder: Recorder,
    /// The name of the scene file; `description` is the text `about` in it.
    title: String,
    description: String,
    facts: String,
}

impl Film {
    /// Begins a recording before the first step, if a page was asked for.
    ///
    /// # Errors
    /// The file of the page cannot be created.
    pub fn create(
        file: &SceneFile,
        scene: &Scene,
        steps: usize,
        options: &Options,
    ) -> Result<Self, AnyError> {
        if options.html.is_empty() {
            return Ok(Film(None));
        }
        let pace = Pace {
            steps,
            every: options.every,
        };
        let mut recorder = Recorder::new(&scene.world, &scene.fields, pace);
        for (number, body) in scene.bodies.iter().enumerate() {
            if let Some(name) = file.body_name(number) {
                recorder.name(*body, name);
            }
        }
        let title = Path::new(&options.scene).file_name();
        let title = title.map_or(options.scene.clone(), |it| {
            it.to_string_lossy().into_owned()
        });
        Ok(Film(Some(Recording {
            path: options.html.clone(),
            file: create_file(&options.html)?,
            recorder,
            title,
            description: file.description().unwrap_or_default().to_owned(),
            facts: facts(scene, steps),
        })))
    }

    /// Records the world after a step.
    pub fn after_step(&mut self, scene: &Scene) {
        if let Some(recording) = &mut self.0 {
            recording.recorder.after_step(&scene.world, &scene.fields);
        }
    }

    /// Writes the page.
    ///
    /// # Errors
    /// The page cannot be written.
    pub fn finish(self, scene: &Scene) -> Result<(), AnyError> {
        let Some(mut recording) = self.0 else {
            return Ok(());
        };
        let mut replay = recording.recorder.finish(&scene.world);
        replay.name.clone_from(&recording.title);
        replay.description = recording.description;
        let page = Page {
            title: recording.title,
            facts: recording.facts,
            replay,
        };
        let written = recording.file.write_all(page.html()?.as_bytes());
        let path = &recording.path;
        written.map_err(|error| format!("cannot write {path}: {error}"))?;
        println!("written                 {path}");
        Ok(())
    }
}

/// A sentence on the size of a run.
fn facts(scene: &Scene, steps: usize) -> String {
    let count = |number: usize, one: &str, more: &str| match number {
        1 => format!("1 {one}"),
        _ => format!("{number} {more}"),
    };
    let bodies = count(scene.bodies.len(), "body", "bodies");
    let steps = count(steps, "step", "steps");
    let dt = to_f64(scene.world.integration_parameters.dt);
    // Five significant digits, without trailing zeros.
    let dt: f64 = format!("{dt:.4e}").parse().unwrap_or(dt);
    let bits = 8 * size_of::<Real>();
    let check = match scene.fields.cross_check() {
        Some(_) => " The contacts of the fields were checked against those of Rapier.",
        None => "",
    };
    format!("{bodies}, {steps} of {dt} in {bits} bits.{check}")
}
