//! The README's table of what fields cost is that of the newest committed results:
//! `WRITE_README=1 cargo test --release readme` puts it there.

use std::path::PathBuf;

use crate::layering::root;

/// The newest results of a bench, by the date in the name of the file.
fn newest(bench: &str) -> PathBuf {
    let folder = root().join("benches/results");
    let machines = std::fs::read_dir(folder).expect("there are results");
    let files = machines.flat_map(|machine| {
        let machine = machine.expect("readable").path();
        std::fs::read_dir(machine).expect("results of a machine")
    });
    let files = files.map(|file| file.expect("readable").path());
    let ending = format!("-{bench}.md");
    let of_bench = files.filter(|file| file.to_string_lossy().ends_with(&ending));
    let newest = of_bench.max_by_key(|file| file.file_name().map(ToOwned::to_owned));
    newest.unwrap_or_else(|| panic!("no results of {bench}"))
}

#[test]
fn the_table_is_that_of_committed_results() {
    let (start, end) = ("<!-- rivals -->\n", "<!-- end -->");
    let path = root().join("README.md");
    let readme = std::fs::read_to_string(&path).expect("there is a README");
    let (before, rest) = readme.split_once(start).expect("a place for the table");
    let (known, after) = rest.split_once(end).expect("its end");
    let results = std::fs::read_to_string(newest("rivals")).expect("the results can be read");
    let lines = results.lines().filter(|line| line.starts_with('|'));
    let table: String = lines.flat_map(|line| [line, "\n"]).collect();
    assert!(table.lines().count() > 10, "{table}");
    if std::env::var_os("WRITE_README").is_some() {
        let all = format!("{before}{start}{table}{end}{after}");
        std::fs::write(&path, all).expect("it can be written");
        return;
    }
    assert_eq!(known, table, "WRITE_README=1 cargo test --release readme");
}
