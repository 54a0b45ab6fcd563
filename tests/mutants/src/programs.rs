//! The test programs of a copy.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// The folders of the programs, their names, and the beginning of the names of the tests to be run. Random worlds are
/// those whose bits are known.
const PROGRAMS: [[&str; 3]; 4] = [
    ["tests", "unit", ""],
    ["tests", "it", ""],
    ["tests", "fuzz", "golden::"],
    // For the tests that only this precision has.
    ["tests/f64", "it", ""],
];

pub struct Program {
    path: PathBuf,
    /// The folder that the tests are run in.
    folder: PathBuf,
    /// The beginning of the names of its tests that are run.
    tests: &'static str,
}

/// The end of a run of tests.
pub enum End {
    Passed,
    Failed(String),
}

/// Builds the programs.
pub fn build(folder: &Path) -> Vec<Program> {
    let built = Command::new("cargo")
        .args(["test", "--release", "--no-run", "--message-format=json"])
        .args([
            "-p",
            "rapier3d-fields-tests",
            "-p",
            "rapier3d-fields-tests-f64",
        ])
        .args(["--features", "enhanced-determinism"])
        .args(PROGRAMS.iter().flat_map(|it| ["--test", it[1]]))
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
        if let Some(path) = message["executable"].as_str() {
            let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
            let manifest = PathBuf::from(text(&message["manifest_path"]));
            let of = manifest.parent().expect("a folder").to_owned();
            paths.insert((of, text(&message["target"]["name"])), path.into());
        }
    }
    let program = |[of, name, tests]: [&'static str; 3]| {
        let folder = folder.join(of);
        let path = paths.remove(&(folder.clone(), name.to_owned()));
        Program {
            path: path.expect("a program of each name"),
            folder,
            tests,
        }
    };
    PROGRAMS.into_iter().map(program).collect()
}

impl Program {
    fn command(&self) -> Command {
        let mut command = Command::new(&self.path);
        command
            .env("PROPTEST_RNG_SEED", "20250")
            .current_dir(&self.folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        command
    }

    /// The names of its tests.
    pub fn tests(&self) -> Vec<String> {
        let listed = self
            .command()
            .args(["--list", "--format", "terse"])
            .output();
        let listed = listed.expect("a program of tests").stdout;
        let listed = String::from_utf8_lossy(&listed);
        let names = listed.lines().filter_map(|it| it.strip_suffix(": test"));
        let names = names.filter(|it| it.starts_with(self.tests));
        names.map(str::to_owned).collect()
    }

    /// Runs one test without a change, and has the changes that it comes to written to the file `reached`. Returns true
    /// if it passes.
    pub fn trace(&self, test: &str, reached: &Path) -> bool {
        let mut command = self.command();
        command
            .args(["--exact", test])
            .env("MUTANT_REACHED", reached);
        let output = command.output().expect("a program of tests");
        output.status.success()
    }

    /// Runs tests with a change until one fails.
    pub fn attempt(&self, mutant: usize, tests: &[&str], longest: Duration) -> End {
        let mut child = self
            .command()
            .args(["--test-threads", "1", "--exact"])
            .args(tests)
            .env("MUTANT", mutant.to_string())
            .spawn()
            .expect("a program of tests");
        let out = BufReader::new(child.stdout.take().expect("piped"));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        let until = Instant::now() + longest;
        let mut last = String::new();
        let end = loop {
            let left = until.saturating_duration_since(Instant::now());
            let line: String = match lines.recv_timeout(left) {
                Ok(line) => line,
                Err(RecvTimeoutError::Timeout) => break Some(format!("{last} takes too long")),
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
}
