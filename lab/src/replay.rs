//! Recorded scenes for the page of the study.

use rapier3d_fields::prelude::*;
use rapier3d_fields_scene::page::Replay;
use rapier3d_fields_scene::single::{Pace, Recorder};

use crate::AnyError;
use crate::single::scenes::ammonia::AmmoniaSettings;
use crate::single::scenes::level;
use crate::single::scenes::spheres::SpheresSettings;

/// A scene with its description on the page.
struct Scene {
    name: &'static str,
    description: &'static str,
    time_unit: &'static str,
    pace: Pace,
    world: PhysicsWorld,
    fields: Fields,
}

/// Runs and records the scenes of the page.
///
/// # Errors
/// A scene cannot be built, or a step of it fails.
pub fn all() -> Result<Vec<Replay>, AnyError> {
    [ammonia()?, spheres()?, level()?]
        .into_iter()
        .map(Scene::play)
        .collect()
}

fn ammonia() -> Result<Scene, AnyError> {
    let settings = AmmoniaSettings {
        count: 27,
        ..AmmoniaSettings::default()
    };
    let scene = settings.build()?;
    let tree = scene.tree(Some(10.0), ContactLaw::elastic());
    let fields = scene.fields(Fields::builder(tree).cross_check(true))?;
    Ok(Scene {
        name: "27 molecules of ammonia",
        description: "Each atom carries an electric field, and a detection field that answers contacts.",
        time_unit: "ps",
        pace: pace(3000, 15),
        world: scene.world,
        fields,
    })
}

fn spheres() -> Result<Scene, AnyError> {
    let settings = SpheresSettings {
        count: 40,
        ..SpheresSettings::default()
    };
    let scene = settings.build()?;
    let tree = scene.tree(ContactLaw::elastic());
    Ok(Scene {
        name: "40 spheres in a box",
        description: "Elastic spheres, found and answered by a field around each.",
        time_unit: "s",
        pace: pace(600, 3),
        world: scene.world,
        fields: Fields::builder(tree).cross_check(true).build()?,
    })
}

/// Crates on a floor under Rapier's gravity; wind over a half of it, a pool, a planet.
fn level() -> Result<Scene, AnyError> {
    let (world, tree) = level::build();
    Ok(Scene {
        name: "a level with wind and water",
        description: "Crates and balls fall under Rapier's gravity; wind blows over the left half, a pool carries what \
                      floats on the right, a moon goes around its planet.",
        time_unit: "s",
        pace: pace(720, 4),
        world,
        fields: Fields::new(tree)?,
    })
}

fn pace(steps: usize, every: usize) -> Pace {
    Pace {
        steps,
        every: Some(every),
    }
}

impl Scene {
    fn play(mut self) -> Result<Replay, AnyError> {
        let mut recorder = Recorder::new(&self.world, &self.fields, self.pace);
        for _ in 0..self.pace.steps {
            self.fields.step(&mut self.world)?;
            recorder.after_step(&self.world, &self.fields);
        }
        Ok(Replay {
            name: self.name.to_owned(),
            description: self.description.to_owned(),
            time_unit: self.time_unit.to_owned(),
            ..recorder.finish(&self.world)
        })
    }
}
