//! Do the tests notice changes of the library?
//!
//! - `cargo run --release -p rapier3d-fields-mutants -- prepare FOLDER COUNT [SEED [ROOM]]` copies the repository to a
//!   folder and makes that many random changes in its `src/` (or one room of it): other operators, comparisons and
//!   factors, results, statements left out. Each is behind a switch, so one build has them all. Changes that do not
//!   compile are taken back.
//! - `… -- run FOLDER [SHARD OF]` builds the tests there, and runs them once for each change (or each of a shard),
//!   until one fails. Two run at a time. It goes on where it was stopped.
//! - `… -- report FOLDER` prints a table by room, and the changes that no test noticed.

mod prepare;
mod report;
mod run;
mod sites;

use std::path::{Path, PathBuf};

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

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let number = |word: &str| word.parse().expect("a number");
    match words[..] {
        ["prepare", folder, count] => prepare::prepare(&absolute(folder), number(count), 1, ""),
        ["prepare", folder, count, seed] => {
            prepare::prepare(&absolute(folder), number(count), number(seed) as u64, "");
        }
        ["prepare", folder, count, seed, room] => {
            prepare::prepare(&absolute(folder), number(count), number(seed) as u64, room);
        }
        ["run", folder] => run::run(&absolute(folder), 0, 1),
        ["run", folder, shard, of] => run::run(&absolute(folder), number(shard), number(of)),
        ["report", folder] => report::report(&absolute(folder)),
        _ => {
            eprintln!("prepare FOLDER COUNT [SEED [ROOM]] | run FOLDER [SHARD OF] | report FOLDER")
        }
    }
}

fn absolute(folder: &str) -> PathBuf {
    std::path::absolute(folder).expect("a path")
}
