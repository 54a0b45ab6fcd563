//! Error against run time: the accuracy that each method gives for its time, on many scenes, in both precisions, beside
//! loops written without this crate.
//!
//! `cargo run --release --example error_vs_runtime -- --quick` takes some minutes, prints which method to use for which
//! scene, and writes `out/error_vs_runtime/report.html`, a self-contained page, beside its numbers as CSV and JSON.
//! Errors are the same on every machine; times are of this machine, on one thread.
//!
//! The results of each scene in each precision are a file in `out/error_vs_runtime/runs/`, written when they are
//! complete: a study that was stopped continues. `--shard 2/8` runs one of eight parts, on any machine; `--merge` puts
//! the parts together, and ends with exit code 3 if some are missing. On the cores of one machine, with GNU parallel,
//! which runs a part that failed once more (`tests/shards.sh` shows it):
//!
//! ```text
//! parallel --retries 2 error_vs_runtime --shard {}/8 ::: $(seq 8) && error_vs_runtime --merge
//! ```
//!
//! As a job array of Slurm, where the same command again runs the parts that failed (`tests/slurm.sh` shows it, on one
//! node):
//!
//! ```text
//! sbatch --wait --array=1-8 --wrap 'error_vs_runtime --shard $SLURM_ARRAY_TASK_ID/8' && error_vs_runtime --merge
//! ```
//!
//! The cost of a sweep of a million runs is in `lab/sweep.md`.
//!
//! `--file scene.json` studies a scene of your own, against its own run in f64 at steps so short that halving them
//! changes little; the change by the last halving is printed first.

use std::path::PathBuf;
use std::process::ExitCode;

#[path = "support/mod.rs"]
mod support;

use clap::{Parser, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use rapier3d_fields_lab::drawing::{
    pixels,
    work_precision::{OVERVIEW, diagrams},
};
use rapier3d_fields_lab::single::stability::Kind;
use rapier3d_fields_lab::study::{
    Ablation, Job, Machine, Method, Outcome, Report, Run, Scene, Shard, StabilityCell, Store, Work,
    to_table,
};
use rapier3d_fields_lab::{double, single};
use support::AnyError;

/// Error against run time, on many scenes.
#[derive(Parser)]
struct Options {
    /// Fewer and longer time steps, and fewer timed rounds.
    #[arg(long)]
    quick: bool,
    /// Only scenes whose names contain this.
    #[arg(long, value_name = "NAME")]
    scene: Vec<String>,
    /// A scene file of your own, studied instead of all others, against its own run in f64 at the smallest step.
    #[arg(long, value_name = "SCENE.json", conflicts_with = "scene")]
    file: Option<PathBuf>,
    /// Name and text of that file.
    #[arg(skip)]
    own: Option<(String, String)>,
    /// Simulated time of that scene, in its unit of time (600 of its steps).
    #[arg(long, value_name = "T", requires = "file")]
    duration: Option<f64>,
    /// Only methods whose names contain this.
    #[arg(long, value_name = "NAME")]
    methods: Vec<String>,
    /// Bits of the numbers.
    #[arg(long, value_enum, default_value = "both")]
    precision: Precision,
    /// Folder of the results.
    #[arg(long, value_name = "DIR", default_value = "out/error_vs_runtime")]
    out: PathBuf,
    /// Runs only the i-th of n parts, as 2/8, and makes no report.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Makes the report from existing parts, and runs nothing.
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

/// The exit code if parts are missing.
const INCOMPLETE: u8 = 3;

/// The number of time steps of a scene under `--quick`, the longest ones.
const QUICK_STEPS: usize = 5;

/// Kinds of scene for the stability map under `--quick`.
const QUICK_KINDS: [Kind; 6] = [
    Kind::Spring,
    Kind::Rotor,
    Kind::Pair(100.0),
    Kind::PenaltyWalls,
    Kind::Comet,
    Kind::Gyration,
];

/// Scenes in which the cost of features that they do not need is measured; under `--quick` only the first.
const LEAVING_OUT: [&str; 6] = [
    "cluster of 8",
    "spring",
    "Kepler 0.5",
    "dipole",
    "ammonia gas",
    "flock",
];

/// The cases of a precision, or the user's scene file.
macro_rules! cases {
    ($options:expr, $lab:ident) => {
        match &$options.own {
            Some((name, text)) => $lab::cases::Filed::new(name, text, $options.duration)
                .map(|it| vec![Box::new(it) as Box<dyn $lab::cases::Case>]),
            None => Ok($lab::cases::all()),
        }
    };
}

/// A hash of a text (FNV-1a).
fn fingerprint(text: &str) -> u64 {
    let mix = |sum: u64, byte: u8| (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    text.bytes().fold(0xcbf2_9ce4_8422_2325, mix)
}

fn main() -> ExitCode {
    let mut options = Options::parse();
    match run(&mut options) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &mut Options) -> Result<ExitCode, AnyError> {
    options.read_file()?;
    let (jobs, scenes) = options.jobs()?;
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
    /// The options with which results must have been made to be used again.
    fn plan(&self) -> String {
        let methods = self.chosen(&Method::ALL).map(Method::name);
        let haste = if self.quick { "quick" } else { "full" };
        let own = self.own.iter().map(|(_, text)| {
            let duration = self.duration.map_or(String::new(), |it| format!(", {it}"));
            format!("; file {:x}{duration}", fingerprint(text))
        });
        let own: String = own.collect();
        format!("{haste}; {}{own}", methods.collect::<Vec<_>>().join(", "))
    }

    /// Reads the user's scene file, if one is given.
    fn read_file(&mut self) -> Result<(), AnyError> {
        let Some(path) = &self.file else {
            return Ok(());
        };
        let told = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let text = std::fs::read_to_string(path).map_err(|error| told(&error))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        // Commas separate the columns of tables.
        let name = name.replace(',', " ");
        let scene = single::cases::Filed::new(&name, &text, self.duration);
        let doubt = scene.map_err(|error| told(&error))?.doubt();
        println!(
            "{name}: the last halving of the step moved the reference by {doubt:.1e}; errors below say nothing."
        );
        self.own = Some((name, text));
        Ok(())
    }

    fn chosen<'a>(&'a self, methods: &'a [Method]) -> impl Iterator<Item = Method> + 'a {
        let wanted = |method: &Method| {
            self.methods.is_empty() || self.methods.iter().any(|it| method.name().contains(it))
        };
        methods.iter().copied().filter(wanted)
    }

    /// The jobs, and the scenes that they study.
    fn jobs(&self) -> Result<(Vec<Job>, Vec<Scene>), AnyError> {
        let wanted = |name: &String| {
            self.scene.is_empty() || self.scene.iter().any(|it| name.contains(it.as_str()))
        };
        let precisions = self.bits();
        let (mut jobs, mut scenes) = (Vec::new(), Vec::new());
        for case in cases!(self, single)? {
            let about = case.about();
            // A scene selected by name runs even if it takes too long for `--quick`.
            let named = !self.scene.is_empty() || self.own.is_some();
            let hasty = !self.quick || case.is_quick() || named;
            if !wanted(&about.name) || !hasty {
                continue;
            }
            jobs.extend(precisions.iter().map(|precision| Job {
                precision: *precision,
                work: Work::Case(about.name.clone()),
            }));
            scenes.push(about.scene());
        }
        for work in self.other_work() {
            let all = precisions.iter().map(|precision| Job {
                precision: *precision,
                work: work.clone(),
            });
            jobs.extend(all.filter(|job| wanted(&job.to_string())));
        }
        Ok((jobs, scenes))
    }

    /// Work besides cases: the stability map, the cost of unneeded features, the number of bodies in real time.
    fn other_work(&self) -> Vec<Work> {
        if self.own.is_some() {
            return Vec::new();
        }
        let kinds = self
            .kinds()
            .map(|kind| Work::Stability(format!("{kind:?}")));
        let few = if self.quick { 1 } else { LEAVING_OUT.len() };
        let leave_out = LEAVING_OUT[..few].iter();
        let leave_out = leave_out.map(|it| Work::LeaveOut((*it).to_owned()));
        let paced = !self.quick || self.scene.iter().any(|it| it.contains("real time"));
        let scenes = single::cases::SCENES.iter().filter(|_| paced);
        let real_time = scenes.map(|it| Work::RealTime((*it).to_owned()));
        kinds.chain(leave_out).chain(real_time).collect()
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

    /// Does the jobs that have no results yet.
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
                    Work::LeaveOut(name) => {
                        outcome.ablations = self.leave_out(name, job.precision)?
                    }
                    Work::RealTime(scene) => {
                        let found = match job.precision {
                            32 => single::cases::ceiling(scene)?,
                            _ => double::cases::ceiling(scene)?,
                        };
                        outcome.ceilings = found.into_iter().collect();
                    }
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
                use $lab::cases::{Effort, study};
                let mut cases = cases!(self, $lab)?.into_iter();
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

    /// The cost of features that a case does not need.
    fn leave_out(&self, name: &str, precision: u32) -> Result<Vec<Ablation>, AnyError> {
        let rounds = if self.quick { 7 } else { 31 };
        macro_rules! leave_out {
            ($lab:ident) => {{
                let mut cases = $lab::cases::all().into_iter();
                let case = cases.find(|it| it.about().name == name);
                Ok($lab::cases::leave_out(
                    case.ok_or("no such case")?.as_ref(),
                    rounds,
                )?)
            }};
        }
        match precision {
            32 => leave_out!(single),
            _ => leave_out!(double),
        }
    }

    fn report(&self, scenes: Vec<Scene>, outcome: Outcome) -> Result<(), AnyError> {
        let report = Report {
            machine: Machine::here(),
            scenes,
            runs: outcome.runs,
            cells: outcome.cells,
            ablations: outcome.ablations,
            ceilings: outcome.ceilings,
        };
        if self.table {
            println!("{}", to_table(&report.runs));
        }
        for it in &report.ablations {
            println!(
                "f{} {}: with {} a step takes {:.2} ({:.2} to {:.2}) times {:.1} µs; bodies end {:.0e} elsewhere",
                it.precision,
                it.case,
                it.switch,
                it.ratios[1],
                it.ratios[0],
                it.ratios[2],
                1e6 * it.step,
                it.change
            );
        }
        for it in &report.ceilings {
            println!(
                "f{} {}: {} bodies at 60 Hz, {:.1} ms a step",
                it.precision,
                it.scene,
                it.count,
                1e3 * it.step
            );
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
            report.html(&rapier3d_fields_lab::replay::all()?)?,
        )?;
        let draw = |name: &str, bits: u32, scenes: &[&str]| -> Result<(), AnyError> {
            let picture = diagrams(&report, bits, scenes)?;
            if let Some(pixels) = pixels(&picture)? {
                std::fs::write(self.out.join(format!("{name}.png")), pixels)?;
            }
            Ok(write(&format!("{name}.svg"), picture)?)
        };
        for bits in self.bits() {
            draw(&format!("f{bits}"), *bits, &[])?;
        }
        draw("overview", self.bits()[0], &OVERVIEW)?;
        println!(
            "\nWrote report.html, .csv, .json and diagrams in {}.",
            self.out.display()
        );
        Ok(())
    }
}
