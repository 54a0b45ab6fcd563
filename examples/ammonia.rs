//! Rigid ammonia in a closed box, the paper's second simulation (§4): every atom carries an
//! electric field and a collision field, every nitrogen a Lennard-Jones field, every wall a
//! collision field, all in one tree. The fields answer all contacts; Rapier finds the same ones
//! by its own means, and the two are compared in every step. The molecules start apart, on a
//! lattice, and warm up as they fall towards each other.
//!
//! ```text
//! cargo run --release --example ammonia
//! cargo run --release --example ammonia -- --picture assets/ammonia.svg
//! ```

use std::path::Path;
use std::process::ExitCode;

use rapier3d_fields::math::{DVec3, to_dpose3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::scenes::ammonia::{
    AmmoniaSettings, BOLTZMANN, BoxOfAmmonia, ContactKind, ContactKinds, SITES,
};

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
usage: ammonia [--molecules N] [--steps N] [--dt PS] [--seed N] [--picture FILE]
  --molecules  how many (216)
  --steps      how many to simulate (10000)
  --dt         length of a step in picoseconds (0.001)
  --seed       of orientations and velocities (1)
  --picture    where to write the picture (out/ammonia.svg)";

const TRAJECTORY: &str = "out/ammonia.xyz";
const STEPS_PER_SAMPLE: usize = 10;
const STEPS_PER_FRAME: usize = 50;

/// Å; both interactions end there, their forces shifted to reach zero.
const CUTOFF: Real = 10.0;
/// 1 kJ/mol in amu Å²/ps².
const KILOJOULE: f64 = 100.0;

fn main() -> ExitCode {
    exit(run())
}

fn run() -> Result<(), AnyError> {
    let args = Args::read(USAGE, &["molecules", "steps", "dt", "seed", "picture"])?;
    let defaults = AmmoniaSettings::default();
    let settings = AmmoniaSettings {
        count: args.get("molecules", defaults.count)?,
        dt: args.get("dt", defaults.dt)?,
        seed: args.get("seed", defaults.seed)?,
        ..defaults
    };
    let steps = args.steps(10_000)?;
    let picture = args.get("picture", "out/ammonia.svg".to_owned())?;

    let mut scene = settings.build()?;
    let tree = scene.tree(Some(CUTOFF), ContactLaw::elastic());
    let mut fields = scene.fields(Fields::builder(tree).cross_check(true))?;
    println!("{}", fields.plan());

    let mut trajectory = Trajectory::create(Path::new(TRAJECTORY), to_dvec3(scene.half_extents))?;
    let mut record = Record::begin(totals(&scene, &mut fields), to_f64(settings.dt), steps);
    let mut kinds = ContactKinds::new(&scene);
    write_frame(&mut trajectory, &scene, &record)?;
    let bar = progress_bar(steps);
    for step in 1..=steps {
        fields.step(&mut scene.world)?;
        record.step(&watch::contacts(&fields, &scene.world));
        kinds.count(&scene, &fields);
        if step % STEPS_PER_SAMPLE == 0 || step == steps {
            record.sample(&totals(&scene, &mut fields));
        }
        if step % STEPS_PER_FRAME == 0 {
            write_frame(&mut trajectory, &scene, &record)?;
        }
        bar.inc(1);
    }
    trajectory.finish()?;
    record.finish();
    bar.finish_and_clear();

    let end = totals(&scene, &mut fields);
    report(&scene, &record, &end);
    print_kinds(&kinds);
    let check = fields.cross_check().ok_or("the cross-check is off")?;
    print_cross_check(check, "Å");
    println!(
        "speed                   {:.0} steps/s, all of the above included",
        record.steps_per_second()
    );
    draw(Path::new(&picture), &scene, &record)?;
    println!("written                 {TRAJECTORY} (OVITO, VMD, ASE), {picture}");
    cross_check_passed(check)
}

fn totals(scene: &BoxOfAmmonia, fields: &mut Fields) -> Totals {
    let world = &scene.world;
    Totals {
        kinetic: scene.kinetic_energy(),
        potential: fields.potential_energy(world).total,
        momentum: scene.momentum(),
        angular_momentum: scene.angular_momentum(),
        scales: momentum_scales(&world.bodies),
    }
}

fn report(scene: &BoxOfAmmonia, record: &Record, end: &Totals) {
    // Six degrees of freedom, of kT/2 each.
    let temperature = |kinetic: f64| kinetic / (3.0 * BOLTZMANN * scene.molecules.len() as f64);
    let (largest, last) = record.largest_and_last_drift();
    let (momentum, angular_momentum) = record.momentum_errors(end);
    println!("simulated               {:.3} ps", record.time());
    println!(
        "temperature             {:.0} K at the start, {:.0} K at the end",
        temperature(record.start.kinetic),
        temperature(end.kinetic)
    );
    println!(
        "energy drift            {largest:.1e} at most, {last:+.1e} at the end, of the initial kinetic energy"
    );
    println!(
        "momentum error          {:.1e} of the initial Σ|mv|, walls counted",
        momentum
    );
    println!(
        "angular momentum error  {:.1e} of the initial Σ|r||mv|, walls counted",
        angular_momentum
    );
    println!("collisions answered     {}", record.collisions);
}

/// Prints contacts by kind, with their effect on the rotation of the molecules.
fn print_kinds(kinds: &ContactKinds) {
    for kind in ContactKind::ALL {
        let tally = kinds.of(kind);
        println!(
            "  {:<22}{:<7} mean lever arm {:.2} Å, mean exchange of spin {:.1} amu Å²/ps",
            kind.name(),
            tally.contacts,
            tally.mean_arm(),
            tally.mean_spin()
        );
    }
}

/// The name and place of every atom.
fn atoms(scene: &BoxOfAmmonia) -> impl Iterator<Item = (&'static str, DVec3)> + '_ {
    scene.molecules.iter().flat_map(|molecule| {
        let pose = to_dpose3(scene.world.bodies[molecule.body].position());
        SITES.iter().map(move |site| {
            let place = pose.transform_point(DVec3::from_array(site.local_point));
            (&site.name[..1], place)
        })
    })
}

fn write_frame(
    trajectory: &mut Trajectory,
    scene: &BoxOfAmmonia,
    record: &Record,
) -> Result<(), AnyError> {
    let energy = record
        .samples
        .last()
        .map_or(0.0, |sample| sample.kinetic + sample.potential);
    let comment = format!(
        "time_ps={:.4} energy_kJ_per_mol={:.6}",
        record.time(),
        energy / KILOJOULE
    );
    trajectory.frame(&comment, &atoms(scene).collect::<Vec<_>>())
}

fn draw(path: &Path, scene: &BoxOfAmmonia, record: &Record) -> Result<(), AnyError> {
    const COLORS: [Rgb; 2] = [[58.0, 98.0, 205.0], [238.0, 240.0, 244.0]];
    // Drawn with the radii at which they collide.
    let balls = atoms(scene).map(|(name, center)| {
        let (color, site) = if name == "N" { (0, 0) } else { (1, 1) };
        let radius = SITES[site].hard_radius;
        Ball {
            center,
            radius,
            color,
        }
    });
    let scene = Scene {
        title: &format!(
            "{} molecules of ammonia in a closed box, after {:.0} ps",
            scene.molecules.len(),
            record.time()
        ),
        subtitle: "an electric field and a collision field on every atom, in one tree",
        balls: balls.collect(),
        colors: &COLORS,
        half_extents: to_dvec3(scene.half_extents),
    };
    let units = Units {
        time: "ps",
        energy: "kJ/mol",
        energy_unit: KILOJOULE,
    };
    picture::write(path, &scene, record, &units)
}
