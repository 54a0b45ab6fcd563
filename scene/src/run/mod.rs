//! Runs a scene in one precision.

mod film;
mod tables;

use std::collections::BTreeMap;
use std::time::Instant;

use super::fields::math::{from_f64, to_f64};
use super::fields::{Detection, Scheme};
use super::{Document, Scene, SceneFile, fields};
use crate::program::{AnyError, Options, progress_bar};
use film::Film;
use tables::Tables;

/// Runs a scene with the given options, writes the tables and the page, and prints a summary.
/// If a step fails, the page shows the steps before it.
///
/// # Errors
/// The scene or an option is wrong, a step failed, a table or the page cannot be written, the two sides of the
/// cross-check disagree; or, if that was asked for, there was a warning.
pub(crate) fn run(text: &str, options: &Options) -> Result<(), AnyError> {
    let mut file = SceneFile::from_json(text)?;
    if let Some(dt) = options.dt {
        file = file.dt(from_f64(dt));
    }
    if let Some(scheme) = &options.scheme {
        file = file.scheme(choice::<Scheme>("scheme", scheme)?);
    }
    if let Some(detection) = &options.detection {
        file = file.detection(choice::<Detection>("detection", detection)?);
    }
    let mut scene = file.build()?;
    let dt = to_f64(scene.world.integration_parameters.dt);
    let steps = match options.duration {
        Some(duration) if dt > 0.0 => (duration / dt).round() as usize,
        _ => options.steps,
    };
    if steps == 0 {
        return Err("there is nothing to run".into());
    }
    let mut tables = Tables::create(&options.tables)?;
    let mut film = Film::create(&file, &scene, steps, options)?;
    println!("{} bodies\n{}", scene.bodies.len(), scene.fields.plan());

    if let Some(steps) = options.estimate {
        println!("{}", estimate(&scene, steps)?);
    }
    let mut told = Told::default();
    let began = Instant::now();
    let every = options.every.unwrap_or(1);
    let simulated = told.simulate(&mut scene, &mut tables, &mut film, [steps, every]);
    let seconds = began.elapsed().as_secs_f64();
    film.finish(&scene)?;
    simulated?;
    tables.finish()?;
    told.print(&scene);
    println!(
        "speed                   {:.0} steps/s",
        steps as f64 / seconds
    );
    let disagreed = disagreements(&scene);
    if disagreed > 0 {
        return Err(format!("the cross-check with Rapier found {disagreed} disagreements").into());
    }
    match told.warnings {
        0 => Ok(()),
        warnings if options.strict => Err(format!("{warnings} warnings").into()),
        _ => Ok(()),
    }
}

/// The largest of the estimated errors of all bodies after some steps.
fn estimate(scene: &Scene, steps: usize) -> Result<String, AnyError> {
    let errors = scene.fields.estimate_error(&scene.world, steps)?;
    let largest = |of: fn(&fields::ErrorEstimate) -> fields::math::Real| {
        let worst = errors.iter().max_by(|a, b| of(a).total_cmp(&of(b)));
        worst.map_or("none".to_owned(), |it| {
            let number = scene.bodies.iter().position(|body| *body == it.body);
            let number = number.map_or(String::new(), |it| format!(" (body {it})"));
            format!("{:.1e}{number}", of(it))
        })
    };
    Ok(format!(
        "estimated errors after {steps} steps: position {}, attitude {} rad, velocity {}, angular velocity {} rad/time",
        largest(|it| it.position),
        largest(|it| it.rotation),
        largest(|it| it.velocity),
        largest(|it| it.angular_velocity),
    ))
}

/// A choice on the command line: a name, or JSON.
fn choice<T: for<'de> serde::Deserialize<'de>>(name: &str, value: &str) -> Result<T, AnyError> {
    let json = if value.trim_start().starts_with('{') {
        value.to_owned()
    } else {
        serde_json::to_string(value)?
    };
    let mut reader = serde_json::Deserializer::from_str(&json);
    let read = crate::choice::optional::<T, _>(&mut reader).map_err(|error| error.to_string());
    let read = read.and_then(|read| read.ok_or_else(|| "there is none".to_owned()));
    read.map_err(|error| format!("--{name} {value}: {error}").into())
}

/// The counts and warnings of a run, for its summary.
#[derive(Default)]
struct Told {
    contacts: usize,
    warnings: usize,
    /// By kind of warning and body: the step and text of the first warning, and their number.
    distinct: BTreeMap<String, (usize, String, usize)>,
}

impl Told {
    fn simulate(
        &mut self,
        scene: &mut Scene,
        tables: &mut Tables,
        film: &mut Film,
        [steps, every]: [usize; 2],
    ) -> Result<(), AnyError> {
        tables.poses(0, scene)?;
        tables.wrenches(0, scene)?;
        tables.energies(0, scene)?;
        let bar = progress_bar(steps);
        for step in 1..=steps {
            tables.before(scene);
            let outcome = scene.fields.step(&mut scene.world);
            let outcome = outcome.map_err(|error| format!("in step {step}: {error}"))?;
            self.contacts += outcome.contacts;
            self.warnings += outcome.warnings;
            self.note(step, scene);
            tables.contacts(step, scene)?;
            tables.warnings(step, scene)?;
            film.after_step(scene);
            if step % every == 0 {
                tables.poses(step, scene)?;
                tables.wrenches(step, scene)?;
                tables.energies(step, scene)?;
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        tables.last_contacts(steps, scene)
    }

    fn note(&mut self, step: usize, scene: &Scene) {
        for warning in scene.fields.warnings() {
            let text = warning.to_string();
            // The texts of one kind of warning about one body differ in their numbers from step to step.
            let body = tables::body_of(warning);
            let kind = format!("{:?} {body:?}", std::mem::discriminant(warning));
            let entry = self.distinct.entry(kind).or_insert((step, text, 0));
            entry.2 += 1;
        }
    }

    fn print(&self, scene: &Scene) {
        println!("simulated               {:.6}", scene.fields.time());
        println!("contacts of the fields  {}", self.contacts);
        println!("warnings                {}", self.warnings);
        let mut distinct: Vec<_> = self.distinct.values().collect();
        distinct.sort();
        for (step, text, count) in distinct {
            println!("  from step {step}, {count} times: {text}");
        }
        if let Some(check) = scene.fields.cross_check() {
            print!("{check}");
            println!("  (lengths in the scene's unit)");
        }
    }
}

/// The number of disagreements of the cross-check; zero without one.
fn disagreements(scene: &Scene) -> u64 {
    let check = scene.fields.cross_check();
    check.map_or(0, |check| check.disagreed())
}
