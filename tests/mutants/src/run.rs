//! Runs the tests for each change.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::programs::{End, Program, build};
use crate::reach::{Test, tests};
use crate::read_list;

pub const RESULTS: &str = "results.tsv";

/// The verdict on a change that no test notices.
pub const SURVIVED: &str = "SURVIVED";
/// The verdict on a change that no test comes to.
pub const UNREACHED: &str = "UNREACHED";

/// Changes that are tried at the same time.
pub const AT_ONCE: usize = 2;

/// The time that the first tests of a change take together; that of the next ones is four times as long, and so on.
const FIRST_SECONDS: f64 = 0.5;

pub fn run(folder: &Path, seconds: f64, shard: usize, of: usize) {
    let programs = build(folder);
    let tests = tests(folder, &programs);
    let done = finished(folder);
    let mut left: Vec<_> = read_list(folder)
        .into_iter()
        .filter(|it| it.id % of == shard && !done.contains(&it.id))
        .collect();
    // Numbers are in a random order, so that a run that is stopped has tried some of each file.
    left.sort_by_key(|it| it.id);
    println!("{} changes to try", left.len());
    let results = std::fs::File::options()
        .create(true)
        .append(true)
        .open(folder.join(RESULTS))
        .expect("a file");
    let (results, next) = (Mutex::new(results), AtomicUsize::new(0));
    let work = || {
        while let Some(mutant) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
            let start = Instant::now();
            let verdict = verdict(&programs, &tests, mutant.id, seconds);
            let took = start.elapsed().as_secs();
            println!(
                "{} {}:{} {verdict} ({took} s)",
                mutant.id, mutant.file, mutant.line
            );
            let mut results = results.lock().expect("no panic");
            writeln!(results, "{}\t{verdict}\t{took}", mutant.id).expect("a line");
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(work);
        }
    });
}

fn finished(folder: &Path) -> BTreeSet<usize> {
    let text = std::fs::read_to_string(folder.join(RESULTS)).unwrap_or_default();
    let id = |line: &str| line.split('\t').next()?.parse().ok();
    text.lines().filter_map(id).collect()
}

/// The name of a test that notices a change, or another verdict on it.
fn verdict(programs: &[Program], tests: &[Test], mutant: usize, seconds: f64) -> String {
    let mut left: Vec<&Test> = tests
        .iter()
        .filter(|it| it.reached.contains(&mutant))
        .collect();
    if left.is_empty() {
        return UNREACHED.to_owned();
    }
    let (mut budget, mut spent) = (FIRST_SECONDS, 0.0);
    while !left.is_empty() && spent < seconds {
        let mut sum = 0.0;
        let count = left.iter().take_while(|it| {
            sum += it.seconds;
            sum <= budget.min(seconds - spent)
        });
        let batch: Vec<&Test> = left.drain(..count.count().max(1)).collect();
        if let Some(test) = noticed(programs, &batch, mutant) {
            return test;
        }
        spent += batch.iter().map(|it| it.seconds).sum::<f64>();
        budget *= 4.0;
    }
    SURVIVED.to_owned()
}

/// The first of some tests that notices a change.
fn noticed(programs: &[Program], batch: &[&Test], mutant: usize) -> Option<String> {
    programs.iter().enumerate().find_map(|(number, program)| {
        let own: Vec<&Test> = batch
            .iter()
            .filter(|it| it.program == number)
            .copied()
            .collect();
        if own.is_empty() {
            return None;
        }
        let names: Vec<&str> = own.iter().map(|it| it.name.as_str()).collect();
        let seconds = own.iter().map(|it| it.seconds).sum::<f64>();
        let longest = Duration::from_secs_f64(20.0 + 5.0 * seconds);
        match program.attempt(mutant, &names, longest) {
            End::Passed => None,
            End::Failed(test) => Some(test),
        }
    })
}
