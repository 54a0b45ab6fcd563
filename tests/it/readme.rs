//! Measured figures on the pages are those of the newest committed results.
//! `WRITE_README=1 cargo test --release readme` writes them.

use std::path::{Path, PathBuf};

use crate::lab::cases;
use crate::layering::root;
use rapier3d_fields_lab::drawing::work_precision::{OVERVIEW, diagrams};
use rapier3d_fields_lab::study::{Machine, Report, from_csv};

/// The newest results of a program, by the date in the name of the file.
fn newest(ending: &str) -> String {
    let folder = root().join("benches/results");
    let machines = std::fs::read_dir(folder).expect("there are results");
    let files = machines.flat_map(|machine| {
        let machine = machine.expect("readable").path();
        std::fs::read_dir(machine).expect("results of a machine")
    });
    let files = files.map(|file| file.expect("readable").path());
    let found = files.filter(|file| file.to_string_lossy().ends_with(ending));
    let newest: Option<PathBuf> = found.max_by_key(|file| file.file_name().map(ToOwned::to_owned));
    let newest = newest.unwrap_or_else(|| panic!("no results that end in {ending}"));
    read(&newest)
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Whether to write the files instead of comparing them.
fn writes() -> bool {
    std::env::var_os("WRITE_README").is_some()
}

/// Asserts that a page has a text between two marks, or writes it there.
fn has(page: &str, marks: [&str; 2], text: &str) {
    let [start, end] = marks;
    let path = root().join(page);
    let whole = read(&path);
    let (before, rest) = whole.split_once(start).expect("a place for the text");
    let (known, after) = rest.split_once(end).expect("its end");
    if writes() {
        let all = format!("{before}{start}{text}{end}{after}");
        std::fs::write(&path, all).expect("it can be written");
        return;
    }
    assert_eq!(
        known, text,
        "{page}: WRITE_README=1 cargo test --release readme"
    );
}

const RIVALS: [&str; 2] = ["<!-- rivals -->\n", "<!-- end -->"];
const STUDY: [&str; 2] = ["<!-- study -->\n", "<!-- end of study -->"];

/// Rows of the README: scenes that differ the most, with good and bad results.
const SHOWN_RIVALS: [&str; 5] = [
    "| uniform field, 10,000 balls | field, kick-drift-kick |",
    "| wind, 10,000 balls | field, kick-drift-kick |",
    "| 1,000 moving zones, 10,000 balls | field, kick-drift-kick |",
    "| mutual attraction and drag, 2,000 balls | field, kick-drift-kick |",
    "| liquid, 1,000 molecules | field, kick-drift-kick |",
];
const SHOWN_SCENES: [&str; 5] = [
    "spring under gravity",
    "Kepler 0.9",
    "close pass",
    "drag",
    "bound dimer",
];

#[test]
fn rivals_are_those_of_committed_results() {
    let results = newest("-rivals.md");
    let lines = results.lines().filter(|line| line.starts_with('|'));
    let lines: Vec<String> = lines.map(|line| format!("{line}\n")).collect();
    assert!(lines.len() > 10, "{lines:?}");
    has("docs/speed.md", RIVALS, &lines.concat());

    let shown = SHOWN_RIVALS.iter().map(|row| {
        let found = lines.iter().find(|line| line.starts_with(row));
        found.unwrap_or_else(|| panic!("no row {row}")).as_str()
    });
    let head = lines[..2].iter().map(String::as_str);
    has("README.md", RIVALS, &head.chain(shown).collect::<String>());
}

#[test]
fn errors_are_those_of_committed_results() {
    let scenes = cases::all().into_iter().map(|case| case.about().scene());
    let report = Report {
        machine: Machine::here(),
        scenes: scenes.collect(),
        runs: from_csv(&newest("-study.csv")).expect("a table of runs"),
        cells: Vec::new(),
        ablations: Vec::new(),
        ceilings: Vec::new(),
    };
    let all = report.equal_error_table(32, &[]);
    assert!(all.lines().count() > 14, "{all}");
    has("docs/schemes.md", STUDY, &all);
    let shown = report.equal_error_table(32, &SHOWN_SCENES);
    assert_eq!(shown.lines().count(), SHOWN_SCENES.len() + 2, "{shown}");
    has("README.md", STUDY, &shown);

    let picture = diagrams(&report, 32, &OVERVIEW).expect("a picture");
    let path = root().join("assets/error_vs_runtime.svg");
    if writes() {
        std::fs::write(&path, &picture).expect("it can be written");
    }
    // `assert_eq` would print thousands of lines.
    let same = read(&path) == picture;
    assert!(
        same,
        "{}: WRITE_README=1 cargo test --release readme",
        path.display()
    );
}
