//! What the README says that programs have found out is that of the newest committed results:
//! `WRITE_README=1 cargo test --release readme` puts it there.

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

/// Whether files are to be made what they should be.
fn writes() -> bool {
    std::env::var_os("WRITE_README").is_some()
}

/// Has a text between two marks of the README.
fn has((start, end): (&str, &str), text: &str) {
    let path = root().join("README.md");
    let readme = read(&path);
    let (before, rest) = readme.split_once(start).expect("a place for the text");
    let (known, after) = rest.split_once(end).expect("its end");
    if writes() {
        let all = format!("{before}{start}{text}{end}{after}");
        std::fs::write(&path, all).expect("it can be written");
        return;
    }
    assert_eq!(known, text, "WRITE_README=1 cargo test --release readme");
}

#[test]
fn all_is_that_of_committed_results() {
    let results = newest("-rivals.md");
    let lines = results.lines().filter(|line| line.starts_with('|'));
    let table: String = lines.flat_map(|line| [line, "\n"]).collect();
    assert!(table.lines().count() > 10, "{table}");
    has(("<!-- rivals -->\n", "<!-- end -->"), &table);

    let scenes = cases::all().into_iter().map(|case| case.about().scene());
    let report = Report {
        machine: Machine::here(),
        scenes: scenes.collect(),
        runs: from_csv(&newest("-study.csv")).expect("a table of runs"),
        cells: Vec::new(),
        ablations: Vec::new(),
        ceilings: Vec::new(),
    };
    let said = [32, 64].into_iter().flat_map(|bits| report.overall(bits));
    let said: String = said.map(|sentence| format!("- {sentence}\n")).collect();
    assert!(said.lines().count() >= 6, "{said}");
    has(("<!-- study -->\n", "<!-- end of study -->"), &said);
    let picture = diagrams(&report, 32, &OVERVIEW).expect("a picture");
    let path = root().join("assets/error_vs_runtime.svg");
    if writes() {
        std::fs::write(&path, &picture).expect("it can be written");
    }
    // As text, a difference is thousands of lines.
    let same = read(&path) == picture;
    assert!(
        same,
        "{}: WRITE_README=1 cargo test --release readme",
        path.display()
    );
}
