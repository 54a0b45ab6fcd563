//! Runs the tests once for each change.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use crate::read_list;

pub const RESULTS: &str = "results.tsv";

/// Changes that are tried at the same time.
const AT_ONCE: usize = 2;

/// The packages of the tests, and their programs in the order in which they are run.
const PROGRAMS: [(&str, &str); 4] = [
    ("rapier3d-fields-tests", "unit"),
    ("rapier3d-fields-tests", "it"),
    ("rapier3d-fields-tests-f64", "unit"),
    ("rapier3d-fields-tests-f64", "it"),
];

struct Program {
    path: PathBuf,
    /// The folder that the tests are run in.
    folder: PathBuf,
    /// Tests that fail without a change: those that read the sources.
    skipped: Vec<String>,
    longest: Duration,
}

/// The end of a run of the tests.
enum End {
    Passed,
    Failed(String),
}

pub fn run(folder: &Path, shard: usize, of: usize) {
    let programs: Vec<Program> = build(folder).into_iter().map(known).collect();
    let done = finished(folder);
    let left: Vec<_> = read_list(folder)
        .into_iter()
        .filter(|it| it.id % of == shard && !done.contains(&it.id))
        .collect();
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
            let ends = programs.iter().map(|it| attempt(it, mutant.id));
            let noticed = ends.into_iter().find_map(|end| match end {
                End::Passed => None,
                End::Failed(test) => Some(test),
            });
            let took = start.elapsed().as_secs();
            let verdict = noticed.unwrap_or_else(|| "SURVIVED".to_owned());
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

/// Builds the tests; returns the paths of their programs.
fn build(folder: &Path) -> Vec<Program> {
    let built = Command::new("cargo")
        .args(["test", "--release", "--no-run", "--message-format=json"])
        .args([
            "-p",
            "rapier3d-fields-tests",
            "-p",
            "rapier3d-fields-tests-f64",
        ])
        .args(["--test", "unit", "--test", "it"])
        .env("RUSTFLAGS", "--cap-lints=allow")
        .current_dir(folder)
        .stderr(Stdio::inherit())
        .output()
        .expect("cargo");
    assert!(built.status.success(), "the tests do not compile");
    let mut paths = BTreeMap::new();
    for line in String::from_utf8_lossy(&built.stdout).lines() {
        let Ok(message) = serde_json::from_str::<serde_json::Value>(line) else {
            continue;
        };
        let Some(path) = message["executable"].as_str() else {
            continue;
        };
        let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
        let manifest = PathBuf::from(text(&message["manifest_path"]));
        let package = if manifest.parent().is_some_and(|it| it.ends_with("f64")) {
            "rapier3d-fields-tests-f64"
        } else {
            "rapier3d-fields-tests"
        };
        let name = text(&message["target"]["name"]);
        paths.insert((package.to_owned(), name), (PathBuf::from(path), manifest));
    }
    let program = |(package, name): (&str, &str)| {
        let (path, manifest) = &paths[&(package.to_owned(), name.to_owned())];
        Program {
            path: path.clone(),
            folder: manifest.parent().expect("a folder").to_owned(),
            skipped: Vec::new(),
            longest: Duration::from_secs(3600),
        }
    };
    PROGRAMS.into_iter().map(program).collect()
}

/// The program, after a run without a change.
fn known(mut program: Program) -> Program {
    let start = Instant::now();
    while let End::Failed(test) = attempt(&program, 0) {
        println!("{test} fails without a change, and is left out");
        program.skipped.push(test);
    }
    program.longest = 5 * start.elapsed() + Duration::from_secs(60);
    program
}

fn start(program: &Program, mutant: usize) -> Child {
    let skips = program.skipped.iter().flat_map(|it| ["--skip", it]);
    Command::new(&program.path)
        .args(["--test-threads", "1", "--exact"])
        .args(skips)
        .env("MUTANT", mutant.to_string())
        .env("PROPTEST_RNG_SEED", "20250")
        .current_dir(&program.folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("a program of tests")
}

/// Runs the tests of a program until one fails.
fn attempt(program: &Program, mutant: usize) -> End {
    let mut child = start(program, mutant);
    let out = BufReader::new(child.stdout.take().expect("piped"));
    let (sender, lines) = channel();
    std::thread::spawn(move || {
        for line in out.lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    let until = Instant::now() + program.longest;
    let mut last = String::new();
    let end = loop {
        let left = until.saturating_duration_since(Instant::now());
        let line: String = match lines.recv_timeout(left) {
            Ok(line) => line,
            Err(RecvTimeoutError::Timeout) => break Some("TOO LONG".to_owned()),
            Err(RecvTimeoutError::Disconnected) => break None,
        };
        // With one thread, the name comes first, and the end of the line after the test.
        if let Some(test) = line.strip_prefix("test ")
            && let Some((name, _)) = test.split_once(" ...")
        {
            name.clone_into(&mut last);
        }
        if line.ends_with("FAILED") && !last.is_empty() {
            break Some(last.clone());
        }
    };
    if end.is_some() {
        let _ = child.kill();
    }
    let status = child.wait().expect("a child");
    match end {
        Some(test) => End::Failed(test),
        None if status.success() => End::Passed,
        None => End::Failed(format!("{last} ended the program")),
    }
}
