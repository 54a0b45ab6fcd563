//! Runs a scene file, and writes where its bodies go, what the fields do to them, and who touches
//! whom. What a scene file holds is described at `rapier3d_fields::files`.
//!
//! ```text
//! cargo run --release --example simulate -- examples/scenes/planet.json \
//!     --steps 600 --every 10 --trajectory out/planet.csv
//! ```

use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use rapier3d_fields::files::{Document, Scene, SceneFile};

#[path = "support/mod.rs"]
mod support;
#[path = "support/tables.rs"]
mod tables;

use support::args::Args;
use support::record::print_cross_check;
use support::{AnyError, exit, progress_bar};
use tables::Tables;

const USAGE: &str = "\
usage: simulate SCENE.json [--steps N] [--every K]
                [--trajectory FILE] [--wrenches FILE] [--contacts FILE]
  --steps       how many to simulate (600)
  --every       write trajectory and wrenches after every K-th step (1); contacts of every step
  --trajectory  where bodies are: step, time, body, centre of mass, quaternion from body to world
                axes (w, x, y, z), velocity of the centre of mass, angular velocity in world axes
  --wrenches    of the fields on each body that can move, where it is: force, and torque about the
                centre of mass, in world axes
  --contacts    who touches whom: for each the number of its body and of the collider on it, normal
                from the first to the second, point, depth, and whether the fields found it or
                Rapier; at the same step, both are for the same poses
Bodies are numbered from 0, in the order of the file.";

const OPTIONS: [&str; 5] = ["steps", "every", "trajectory", "wrenches", "contacts"];

fn main() -> ExitCode {
    exit(run())
}

fn run() -> Result<(), AnyError> {
    let (args, words) = Args::with_words(USAGE, &OPTIONS)?;
    let [file] = &words[..] else {
        return Err(format!("expected one scene file, found {}\n{USAGE}", words.len()).into());
    };
    let (steps, every) = (args.steps(600)?, args.get("every", 1)?);
    if every == 0 {
        return Err("--every 0: expected one or more".into());
    }
    let mut scene = load(Path::new(file))?;
    let path = |name: &str| args.get(name, String::new());
    let [trajectory, wrenches, contacts] =
        [path("trajectory")?, path("wrenches")?, path("contacts")?];
    let mut tables = Tables::create(&trajectory, &wrenches, &contacts)?;
    println!("{} bodies\n{}", scene.bodies.len(), scene.fields.plan());

    let began = Instant::now();
    let found = simulate(&mut scene, &mut tables, steps, every)?;
    let seconds = began.elapsed().as_secs_f64();
    tables.finish()?;
    report(&scene, steps, seconds, found);
    Ok(())
}

fn load(file: &Path) -> Result<Scene, AnyError> {
    let name = file.display();
    let text = fs::read_to_string(file).map_err(|error| format!("cannot read {name}: {error}"))?;
    let scene = SceneFile::from_json(&text).and_then(|scene| scene.build());
    scene.map_err(|error| format!("{name}: {error}").into())
}

/// Returns how many contacts the fields found, and how many warnings there were.
fn simulate(
    scene: &mut Scene,
    tables: &mut Tables,
    steps: usize,
    every: usize,
) -> Result<[usize; 2], AnyError> {
    let mut found = [0; 2];
    tables.poses(0, scene)?;
    tables.wrenches(0, scene)?;
    let bar = progress_bar(steps);
    for step in 1..=steps {
        tables.before(scene);
        let outcome = scene.fields.step(&mut scene.world);
        let outcome = outcome.map_err(|error| format!("in step {step}: {error}"))?;
        found[0] += outcome.contacts;
        found[1] += outcome.warnings;
        tables.contacts(step, scene)?;
        if step % every == 0 {
            tables.poses(step, scene)?;
            tables.wrenches(step, scene)?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    tables.last_contacts(steps, scene)?;
    Ok(found)
}

fn report(scene: &Scene, steps: usize, seconds: f64, [contacts, warnings]: [usize; 2]) {
    println!("simulated               {:.6}", scene.fields.time());
    println!("contacts of the fields  {contacts}");
    println!("warnings                {warnings}");
    for warning in scene.fields.warnings() {
        println!("  in the last step: {warning:?}");
    }
    if let Some(check) = scene.fields.cross_check() {
        print_cross_check(check, "length units");
    }
    println!(
        "speed                   {:.0} steps/s",
        steps as f64 / seconds
    );
}
