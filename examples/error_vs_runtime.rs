//! Error against run time: which method gives how much accuracy for its time, on many scenes, in both
//! precisions, beside what one writes without this crate.
//!
//! `cargo run --release --example error_vs_runtime -- --quick` takes some minutes, prints what to use
//! for what, and writes `out/error_vs_runtime/report.html`, a page with everything in it, beside its
//! numbers as CSV and JSON. Errors are the same on every machine; times are of this one, on one thread.
//!
//! Each scene in each precision is a file in `out/error_vs_runtime/runs/`, there when it is complete: a
//! study that was stopped goes on where it was. `--shard 2/8` makes one of eight parts, on as many
//! machines as there are; `--merge` puts them together, and ends with exit code 3 if some are missing.

use std::path::PathBuf;
use std::process::ExitCode;

#[path = "support/mod.rs"]
mod support;

use clap::{Parser, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use rapier3d_fields_lab::drawing::work_precision::diagrams;
use rapier3d_fields_lab::single::stability::Kind;
use rapier3d_fields_lab::study::{
    Job, Machine, Method, Outcome, Report, Run, Scene, Shard, StabilityCell, Store, Work, to_table,
};
use rapier3d_fields_lab::{double, single};
use support::AnyError;

/// Error against run time, on many scenes.
#[derive(Parser)]
struct Options {
    /// Fewer and longer time steps, and fewer rounds on the clock.
    #[arg(long)]
    quick: bool,
    /// Only scenes whose names hold this.
    #[arg(long, value_name = "NAME")]
    scene: Vec<String>,
    /// Only methods whose names hold this.
    #[arg(long, value_name = "NAME")]
    methods: Vec<String>,
    /// Bits of the numbers.
    #[arg(long, value_enum, default_value = "both")]
    precision: Precision,
    /// Where results are kept.
    #[arg(long, value_name = "DIR", default_value = "out/error_vs_runtime")]
    out: PathBuf,
    /// Makes only the i-th of n parts, as 2/8, and no report.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Makes the report from parts that are there, and runs nothing.
    #[arg(long, conflicts_with = "shard")]
    merge: bool,
    /// Prints all runs, too.
    #[arg(long)]
    table: bool,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Precision {
    F32,
    F64,
    Both,
}

/// Parts are missing.
const INCOMPLETE: u8 = 3;

/// Of the longest time steps of a scene, how many are made in haste.
const QUICK_STEPS: usize = 5;

/// Scenes that say the most on one picture.
const OVERVIEW: [&str; 4] = ["spring", "Kepler 0.9", "bound dimer", "sphere impacts"];

/// Kinds of scene for the stability map, in haste.
const QUICK_KINDS: [Kind; 6] = [
    Kind::Spring,
    Kind::Rotor,
    Kind::Pair(100.0),
    Kind::PenaltyWalls,
    Kind::Comet,
    Kind::Gyration,
];

fn main() -> ExitCode {
    let options = Options::parse();
    match run(&options) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<ExitCode, AnyError> {
    let (jobs, scenes) = options.jobs();
    if jobs.is_empty() {
        return Err("no scene has such a name".into());
    }
    let store = Store::new(options.out.join("runs"), options.plan());
    if !options.merge {
        let own = options.shard.unwrap_or(Shard::WHOLE).share(jobs.clone());
        options.make(&store, own)?;
    }
    if options.shard.is_some() {
        return Ok(ExitCode::SUCCESS);
    }
    let outcome = match store.merge(&jobs)? {
        Ok(outcome) => outcome,
        Err(missing) => {
            for job in missing {
                eprintln!("missing: {job}");
            }
            return Ok(ExitCode::from(INCOMPLETE));
        }
    };
    options.report(scenes, outcome)?;
    Ok(ExitCode::SUCCESS)
}

impl Options {
    /// What results must have been made by to be used again.
    fn plan(&self) -> String {
        let methods = self.chosen(&Method::ALL).map(Method::name);
        let haste = if self.quick { "quick" } else { "full" };
        format!("{haste}; {}", methods.collect::<Vec<_>>().join(", "))
    }

    fn chosen<'a>(&'a self, methods: &'a [Method]) -> impl Iterator<Item = Method> + 'a {
        let wanted = |method: &Method| {
            self.methods.is_empty() || self.methods.iter().any(|it| method.name().contains(it))
        };
        methods.iter().copied().filter(wanted)
    }

    /// What is to be done, and what it is about.
    fn jobs(&self) -> (Vec<Job>, Vec<Scene>) {
        let wanted = |name: &String| {
            self.scene.is_empty() || self.scene.iter().any(|it| name.contains(it.as_str()))
        };
        let precisions = self.bits();
        let (mut jobs, mut scenes) = (Vec::new(), Vec::new());
        for case in single::cases::all() {
            let about = case.about();
            if !wanted(&about.name) {
                continue;
            }
            jobs.extend(precisions.iter().map(|precision| Job {
                precision: *precision,
                work: Work::Case(about.name.clone()),
            }));
            scenes.push(Scene {
                name: about.name,
                description: about.description.to_owned(),
                time_unit: about.time_unit.to_owned(),
                views: about.views,
            });
        }
        for kind in self
            .kinds()
            .filter(|kind| wanted(&format!("stability of {kind:?}")))
        {
            jobs.extend(precisions.iter().map(|precision| Job {
                precision: *precision,
                work: Work::Stability(format!("{kind:?}")),
            }));
        }
        (jobs, scenes)
    }

    fn bits(&self) -> &'static [u32] {
        match self.precision {
            Precision::F32 => &[32],
            Precision::F64 => &[64],
            Precision::Both => &[32, 64],
        }
    }

    /// The kinds of scene of the stability map.
    fn kinds(&self) -> impl Iterator<Item = Kind> {
        let kinds = Kind::ALL.into_iter();
        kinds.filter(|kind| !self.quick || QUICK_KINDS.contains(kind))
    }

    /// Does what is not done.
    fn make(&self, store: &Store, jobs: Vec<Job>) -> Result<(), AnyError> {
        let style = ProgressStyle::with_template("{bar:40.cyan/blue} {pos}/{len} {msg}");
        let progress = ProgressBar::new(jobs.len() as u64).with_style(style?);
        for job in jobs {
            progress.set_message(job.to_string());
            if store.load(&job)?.is_none() {
                let mut outcome = Outcome::default();
                match &job.work {
                    Work::Case(name) => {
                        outcome.runs = self.study(name, job.precision, &progress)?
                    }
                    Work::Stability(kind) => outcome.cells = self.map(kind, job.precision),
                }
                store.save(&job, &outcome)?;
            }
            progress.inc(1);
        }
        progress.finish_and_clear();
        Ok(())
    }

    /// The rows of the stability map of a kind of scene.
    fn map(&self, kind: &str, precision: u32) -> Vec<StabilityCell> {
        macro_rules! map {
            ($lab:ident) => {{
                use $lab::stability::{Damping, Kind, SCHEMES, map};
                let kinds = Kind::ALL.into_iter().filter(|it| format!("{it:?}") == kind);
                let dampings = if self.quick {
                    &Damping::ALL[..1]
                } else {
                    &Damping::ALL
                };
                let mut cells = Vec::new();
                for kind in kinds {
                    for damping in dampings {
                        let rows = SCHEMES
                            .into_iter()
                            .map(|scheme| map(kind, *damping, scheme));
                        cells.extend(rows.flatten());
                    }
                }
                cells
            }};
        }
        match precision {
            32 => map!(single),
            _ => map!(double),
        }
    }

    fn study(
        &self,
        name: &str,
        precision: u32,
        progress: &ProgressBar,
    ) -> Result<Vec<Run>, AnyError> {
        /// The same for both precisions.
        macro_rules! study {
            ($lab:ident) => {{
                use $lab::cases::{Effort, all, study};
                let mut cases = all().into_iter();
                let case = cases.find(|it| it.about().name == name);
                let case = case.ok_or("no such case")?;
                let effort = match self.quick {
                    true => Effort {
                        rounds: 3,
                        seconds: 0.25,
                        most: 15,
                    },
                    false => Effort::default(),
                };
                let mut steps = case.about().time_steps();
                steps.truncate(if self.quick { QUICK_STEPS } else { steps.len() });
                let mut plan = Vec::new();
                for method in self.chosen(case.methods()) {
                    plan.extend(steps.iter().map(|dt| (method, *dt)));
                }
                Ok(study(case.as_ref(), &plan, effort, || progress.tick())?)
            }};
        }
        match precision {
            32 => study!(single),
            _ => study!(double),
        }
    }

    fn report(&self, scenes: Vec<Scene>, outcome: Outcome) -> Result<(), AnyError> {
        let report = Report {
            machine: Machine::here(),
            scenes,
            runs: outcome.runs,
            cells: outcome.cells,
        };
        if self.table {
            println!("{}", to_table(&report.runs));
        }
        for advice in report.advice() {
            println!("f{} {}", advice.precision, advice.sentence);
        }
        println!();
        for bits in [32, 64] {
            report.overall(bits).iter().for_each(|it| println!("{it}"));
        }
        for (scheme, turn) in report.safe_turns() {
            match turn {
                Some(turn) => {
                    println!("{scheme}: stable in all scenes of the map up to dt·ω = {turn}")
                }
                None => println!("{scheme}: at no dt·ω of the map stable in all its scenes"),
            }
        }
        std::fs::create_dir_all(&self.out)?;
        let write = |name: &str, text: String| std::fs::write(self.out.join(name), text);
        write("report.csv", report.csv())?;
        write("report.json", report.json().to_string())?;
        write(
            "report.html",
            report.html(&rapier3d_fields_lab::replay::all()?),
        )?;
        for bits in self.bits() {
            write(&format!("f{bits}.svg"), diagrams(&report, *bits, &[])?)?;
        }
        write(
            "overview.svg",
            diagrams(&report, self.bits()[0], &OVERVIEW)?,
        )?;
        println!(
            "\nWrote report.html, .csv, .json and diagrams in {}.",
            self.out.display()
        );
        Ok(())
    }
}
