//! Do the tests notice changes of the library?
//!
//! Changes are other operators, comparisons and factors, other results, and statements left out. Each is behind a switch
//! that is read when a program starts, so one build has them all.

mod prepare;
mod programs;
mod reach;
mod report;
mod run;
mod sites;

use std::path::{Path, PathBuf};

use clap::{Parser, Subcommand};

/// A change in the copy.
#[derive(Clone, Debug)]
struct Mutant {
    /// From one on.
    id: usize,
    file: String,
    line: usize,
    change: String,
}

impl Mutant {
    fn room(&self) -> &str {
        let inside = self.file.trim_start_matches("src/");
        let room = inside.split_once('/').map_or(inside, |it| it.0);
        room.trim_end_matches(".rs")
    }
}

const LIST: &str = "mutants.tsv";

fn write_list(folder: &Path, mutants: &[Mutant]) {
    let line = |it: &Mutant| {
        let change = it.change.split_whitespace().collect::<Vec<_>>().join(" ");
        format!("{}\t{}\t{}\t{change}\n", it.id, it.file, it.line)
    };
    let text: String = mutants.iter().map(line).collect();
    std::fs::write(folder.join(LIST), text).expect("a folder that can be written to");
}

fn read_list(folder: &Path) -> Vec<Mutant> {
    let text = std::fs::read_to_string(folder.join(LIST)).expect("a folder that was prepared");
    let line = |line: &str| {
        let mut words = line.splitn(4, '\t');
        let mut word = || words.next().unwrap_or_default().to_owned();
        Mutant {
            id: word().parse().expect("a number"),
            file: word(),
            line: word().parse().expect("a number"),
            change: word(),
        }
    };
    text.lines().map(line).collect()
}

/// Tells which changes of the library no test notices.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Copy the repository, and make random changes in its `src/`. Those that do not compile are taken back.
    Prepare {
        folder: PathBuf,
        count: usize,
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Change this folder of `src/` only.
        #[arg(long, default_value = "")]
        room: String,
    },
    /// Build the tests of a copy, find out which tests come to which changes, and run these tests for each change, the
    /// quickest first, until one fails; for two changes at a time. Goes on where it was stopped.
    Run {
        folder: PathBuf,
        /// Give a change up after tests that take this many seconds without it.
        #[arg(long, default_value_t = f64::INFINITY)]
        seconds: f64,
        /// Only the changes whose number leaves this remainder.
        #[arg(long, default_value_t = 0)]
        shard: usize,
        #[arg(long, default_value_t = 1)]
        of: usize,
    },
    /// Print a table by room, and the changes that no test noticed.
    Report {
        folder: PathBuf,
        /// Fail if more than this percentage survived.
        #[arg(long, default_value_t = 100.0)]
        most: f64,
    },
}

fn main() {
    let absolute = |folder| std::path::absolute(folder).expect("a path");
    match Arguments::parse().task {
        Task::Prepare {
            folder,
            count,
            seed,
            room,
        } => prepare::prepare(&absolute(folder), count, seed, &room),
        Task::Run {
            folder,
            seconds,
            shard,
            of,
        } => run::run(&absolute(folder), seconds, shard, of.max(1)),
        Task::Report { folder, most } => {
            let survived = report::report(&absolute(folder));
            if survived > most {
                eprintln!("{survived:.1} % survived; at most {most} % may");
                std::process::exit(1);
            }
        }
    }
}
