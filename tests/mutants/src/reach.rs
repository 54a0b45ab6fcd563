//! Which tests come to which changes.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use crate::programs::Program;
use crate::run::AT_ONCE;

/// A test, and the changes that it comes to.
pub struct Test {
    pub program: usize,
    pub name: String,
    /// The time that it takes without a change.
    pub seconds: f64,
    pub reached: BTreeSet<usize>,
}

const REACHED: &str = "reached.tsv";

/// The tests that pass without a change, the quickest first; read from the file of an earlier run if there is one.
pub fn tests(folder: &Path, programs: &[Program]) -> Vec<Test> {
    let file = folder.join(REACHED);
    if !file.exists() {
        let tests = trace(folder, programs);
        let lines: String = tests.iter().map(line).collect();
        std::fs::write(&file, lines).expect("a file");
    }
    let text = std::fs::read_to_string(&file).expect("a file that was written");
    let mut tests: Vec<Test> = text.lines().map(read).collect();
    tests.sort_by(|one, other| one.seconds.total_cmp(&other.seconds));
    tests
}

fn line(test: &Test) -> String {
    let ids: Vec<String> = test.reached.iter().map(usize::to_string).collect();
    let ids = ids.join(" ");
    format!("{}\t{}\t{}\t{ids}\n", test.program, test.name, test.seconds)
}

fn read(line: &str) -> Test {
    let mut words = line.split('\t');
    let mut word = || words.next().unwrap_or_default();
    Test {
        program: word().parse().expect("a number"),
        name: word().to_owned(),
        seconds: word().parse().expect("a number"),
        reached: ids(word()),
    }
}

fn ids(text: &str) -> BTreeSet<usize> {
    let ids = text.split_whitespace().map(str::parse);
    ids.map(|id| id.expect("a number")).collect()
}

/// Runs each test by itself.
fn trace(folder: &Path, programs: &[Program]) -> Vec<Test> {
    let names = programs.iter().enumerate().flat_map(|(program, it)| {
        let tests = it.tests().into_iter();
        tests.map(move |name| (program, name))
    });
    // Most tests are in both precisions.
    let mut known = BTreeSet::new();
    let names: Vec<(usize, String)> = names.filter(|it| known.insert(it.1.clone())).collect();
    println!("{} tests to trace", names.len());
    let (found, next) = (Mutex::new(Vec::new()), AtomicUsize::new(0));
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some((program, name)) = names.get(number) else {
                return;
            };
            let file = folder.join(format!("reached-{number}"));
            let start = Instant::now();
            let passes = programs[*program].trace(name, &file);
            let test = Test {
                program: *program,
                name: name.clone(),
                seconds: start.elapsed().as_secs_f64(),
                reached: ids(&std::fs::read_to_string(&file).unwrap_or_default()),
            };
            let _ = std::fs::remove_file(file);
            if passes {
                found.lock().expect("no panic").push(test);
            } else {
                println!("{name} fails without a change, and is left out");
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(work);
        }
    });
    found.into_inner().expect("no panic")
}
