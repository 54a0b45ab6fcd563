//! Equal spheres in a closed box, the paper's first simulation (§3.3, §4): a detection field
//! around each sphere, and Rapier's contacts beside those the fields find. Runs both the paper's
//! literal rule of response and Newton's law, and compares what they conserve.
//!
//! ```text
//! cargo run --release --example spheres
//! cargo run --release --example spheres -- --law paper
//! ```

use std::path::Path;
use std::process::ExitCode;
use std::str::FromStr;

use rapier3d_fields::math::{DVec3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::scenes::spheres::{BoxOfSpheres, SpheresSettings};

#[path = "support/mod.rs"]
mod support;

use rapier3d_fields_lab::drawing::picture::{self, Scene};
use rapier3d_fields_lab::drawing::plot::Units;
use rapier3d_fields_lab::drawing::projection::{Ball, Rgb};
use rapier3d_fields_lab::record::{Record, Totals};
use rapier3d_fields_lab::single::watch::{
    self, cross_check_passed, momentum_scales, print_cross_check,
};
use rapier3d_fields_lab::xyz::Trajectory;
use support::args::Args;
use support::{AnyError, exit, progress_bar};

const USAGE: &str = "\
usage: spheres [--law paper|impulse] [--spheres N] [--steps N] [--seed N] [--picture FILE]
  --law      the law whose run is drawn and written (impulse)
  --spheres  how many (20)
  --steps    how many to simulate, of 1/60 s each (6000)
  --seed     of places and directions (1)
  --picture  where to write the picture (out/spheres.svg)";

const TRAJECTORY: &str = "out/spheres.xyz";
const STEPS_PER_SAMPLE: usize = 10;

/// The law by which spheres answer contacts.
#[derive(Clone, Copy, PartialEq)]
enum Law {
    Paper,
    Impulse,
}

impl FromStr for Law {
    type Err = &'static str;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        match word {
            "paper" => Ok(Law::Paper),
            "impulse" => Ok(Law::Impulse),
            _ => Err("must be `paper` or `impulse`"),
        }
    }
}

impl Law {
    fn contact_law(self) -> ContactLaw {
        match self {
            Law::Paper => ContactLaw::Paper,
            Law::Impulse => ContactLaw::elastic(),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Law::Paper => "the paper's rule",
            Law::Impulse => "Newton's law",
        }
    }
}

/// A box of spheres after its run.
struct Run {
    law: Law,
    scene: BoxOfSpheres,
    fields: Fields,
    record: Record,
}

fn main() -> ExitCode {
    exit(run())
}

fn run() -> Result<(), AnyError> {
    let args = Args::read(USAGE, &["law", "spheres", "steps", "seed", "picture"])?;
    let defaults = SpheresSettings::default();
    let settings = SpheresSettings {
        count: args.get("spheres", defaults.count)?,
        seed: args.get("seed", defaults.seed)?,
        ..defaults
    };
    let law = args.get("law", Law::Impulse)?;
    let steps = args.steps(6000)?;
    let picture = args.get("picture", "out/spheres.svg".to_owned())?;

    let runs = [
        simulate(&settings, Law::Impulse, steps, law)?,
        simulate(&settings, Law::Paper, steps, law)?,
    ];
    println!("{}", runs[0].fields.plan());
    for run in &runs {
        run.report();
    }
    let chosen = runs.iter().find(|run| run.law == law);
    chosen.map_or(Ok(()), |run| run.draw(Path::new(&picture)))?;
    println!("written                 {TRAJECTORY} (OVITO, VMD, ASE), {picture}");
    let mut checks = runs.iter().filter_map(|run| run.fields.cross_check());
    checks.try_for_each(cross_check_passed)
}

/// Runs a box by a law; writes its trajectory if that law is the chosen one.
fn simulate(
    settings: &SpheresSettings,
    law: Law,
    steps: usize,
    chosen: Law,
) -> Result<Run, AnyError> {
    let mut scene = settings.build()?;
    let tree = scene.tree(law.contact_law());
    let mut fields = Fields::builder(tree).cross_check(true).build()?;
    let mut trajectory = (law == chosen)
        .then(|| Trajectory::create(Path::new(TRAJECTORY), to_dvec3(scene.half_extents)))
        .transpose()?;
    let mut record = Record::begin(totals(&scene), to_f64(settings.dt), steps);
    let bar = progress_bar(steps).with_message(law.name());
    for step in 1..=steps {
        fields.step(&mut scene.world)?;
        record.step(&watch::contacts(&fields, &scene.world));
        if step % STEPS_PER_SAMPLE == 0 || step == steps {
            record.sample(&totals(&scene));
            if let Some(trajectory) = &mut trajectory {
                write_frame(trajectory, &scene, &record)?;
            }
        }
        bar.inc(1);
    }
    trajectory.map_or(Ok(()), Trajectory::finish)?;
    record.finish();
    bar.finish_and_clear();
    Ok(Run {
        law,
        scene,
        fields,
        record,
    })
}

fn totals(scene: &BoxOfSpheres) -> Totals {
    Totals {
        kinetic: scene.kinetic_energy(),
        potential: 0.0,
        momentum: scene.momentum(),
        angular_momentum: scene.angular_momentum(),
        scales: momentum_scales(&scene.world.bodies),
    }
}

fn centers(scene: &BoxOfSpheres) -> impl Iterator<Item = DVec3> + '_ {
    let bodies = &scene.world.bodies;
    let handles = scene.spheres.iter();
    handles.map(move |(body, _)| to_dvec3(bodies[*body].translation()))
}

fn write_frame(
    trajectory: &mut Trajectory,
    scene: &BoxOfSpheres,
    record: &Record,
) -> Result<(), AnyError> {
    let comment = format!(
        "time_s={:.4} energy_J={:.6}",
        record.time(),
        scene.kinetic_energy()
    );
    let atoms: Vec<_> = centers(scene).map(|center| ("X", center)).collect();
    trajectory.frame(&comment, &atoms)
}

impl Run {
    fn report(&self) {
        let Run { scene, record, .. } = self;
        let end = totals(scene);
        let (largest, last) = record.largest_and_last_drift();
        let (momentum, angular_momentum) = record.momentum_errors(&end);
        println!("{}, {:.1} s", self.law.name(), record.time());
        println!(
            "  energy drift        {last:+.1e} of the initial, {largest:.1e} at most on the way"
        );
        println!("  momentum error      {momentum:.1e} of the initial Σ|mv|, walls counted");
        println!(
            "  angular momentum    {angular_momentum:.1e} of the initial Σ|r||mv|, walls counted"
        );
        println!("  collisions answered {}", record.collisions);
        if let Some(check) = self.fields.cross_check() {
            print_cross_check(check, "m");
        }
        println!(
            "speed                 {:.0} steps/s\n",
            record.steps_per_second()
        );
    }

    fn draw(&self, path: &Path) -> Result<(), AnyError> {
        const COLORS: [Rgb; 3] = [
            [58.0, 98.0, 205.0],
            [226.0, 125.0, 40.0],
            [28.0, 145.0, 105.0],
        ];
        let Run { scene, record, .. } = self;
        let balls = centers(scene).enumerate().map(|(number, center)| Ball {
            center,
            radius: to_f64(scene.radius),
            color: number % COLORS.len(),
        });
        let picture = Scene {
            title: &format!(
                "{} equal spheres by {}",
                scene.spheres.len(),
                self.law.name()
            ),
            subtitle: "a collision field around every sphere",
            balls: balls.collect(),
            colors: &COLORS,
            half_extents: to_dvec3(scene.half_extents),
        };
        let units = Units {
            time: "s",
            energy: "J",
            energy_unit: 1.0,
        };
        picture::write(path, &picture, record, &units)
    }
}
