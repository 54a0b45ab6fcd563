//! The import table of ARCHITECTURE.md holds for the code, and the code fills the table.

#[cfg(feature = "f64")]
extern crate rapier3d_fields_f64 as rapier3d_fields;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The crates that the table's last column is about; `std` and macros of tests are not.
const OUTSIDE: [&str; 7] = [
    "rapier",
    "thiserror",
    "wide",
    "glamx",
    "nalgebra",
    "num_dual",
    "exmex",
];

fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let here = package.join("ARCHITECTURE.md").exists();
    if here {
        package.to_owned()
    } else {
        package.join("..")
    }
}

/// For each module: what it may use from the crate, and which other crates it may name.
fn table() -> BTreeMap<String, [BTreeSet<String>; 2]> {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("the table's file");
    // The first table of the file.
    let lines = text.lines().skip_while(|line| !line.starts_with('|'));
    let rows = lines.take_while(|line| line.starts_with('|')).skip(2);
    let mut table = BTreeMap::new();
    for row in rows {
        let [module, inside, outside] = &cells(row)[..] else {
            panic!("three cells in: {row}")
        };
        table.insert(module.clone(), [names(inside), names(outside)]);
    }
    table
}

fn cells(row: &str) -> Vec<String> {
    let cells = row.trim_matches('|').split('|');
    cells.map(|cell| cell.trim().to_owned()).collect()
}

fn names(list: &str) -> BTreeSet<String> {
    let names = list.split(',').map(str::trim);
    names
        .filter(|name| *name != "nothing")
        .map(str::to_owned)
        .collect()
}

/// The source files of a module: its own, or those of its folder.
fn files(module: &str) -> Vec<PathBuf> {
    let src = root().join("src");
    let mut open = vec![src.join(module)];
    let mut found: Vec<PathBuf> = vec![src.join(format!("{module}.rs"))];
    while let Some(folder) = open.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            continue;
        };
        for entry in entries {
            let path = entry.expect("a readable folder").path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.push(path);
            }
        }
    }
    found.retain(|path| path.exists());
    found
}

/// The code of a file, without comments and unit tests (which may use what they like).
fn code(path: &Path) -> String {
    let text = std::fs::read_to_string(path).expect("a source file");
    let body = text.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = body
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

/// The first segments of all paths that start with `crate::` or in a `use crate::{…}` list.
fn inside(code: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        let list = match rest.strip_prefix('{') {
            Some(list) => top_level(list),
            None => vec![rest],
        };
        let first = |path: &str| -> String {
            let path = path.trim_start();
            path.chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect()
        };
        found.extend(list.into_iter().map(first).filter(|name| !name.is_empty()));
    }
    found
}

/// The items of a braced list, up to its closing brace.
fn top_level(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut items) = (0, 0, Vec::new());
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => {
                items.push(&list[start..at]);
                break;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                items.push(&list[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    items
}

fn outside(code: &str) -> BTreeSet<String> {
    // Rapier's re-export is Rapier.
    let code = code.replace("rapier::glamx", "rapier");
    let is_named = |name: &str| {
        let by_attribute = name == "thiserror" && code.contains("#[error(");
        by_attribute
            || code.contains(&format!("{name}::"))
            || code.contains(&format!("use {name};"))
    };
    let named = OUTSIDE.into_iter().filter(|name| is_named(name));
    named.map(str::to_owned).collect()
}

#[test]
fn modules_use_what_the_table_allows() {
    let table = table();
    assert!(table.len() >= 10, "the table was not found");
    let mut wrong = Vec::new();
    for (module, [may_use, may_name]) in &table {
        for path in files(module) {
            let code = code(&path);
            for used in inside(&code) {
                let allowed = used == *module
                    || may_use.contains(&used)
                    || (used == "rapier" && may_name.contains("rapier"));
                if !allowed {
                    wrong.push(format!("{} uses crate::{used}", path.display()));
                }
            }
            for named in outside(&code) {
                if !may_name.contains(&named) {
                    wrong.push(format!("{} names {named}", path.display()));
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "against ARCHITECTURE.md:\n{}",
        wrong.join("\n")
    );
}

/// The order of `lib.rs` is that of the table, and no module is missing from it.
#[test]
fn the_table_lists_the_modules_of_the_crate() {
    let lib = std::fs::read_to_string(root().join("src/lib.rs")).expect("lib.rs");
    let declared: BTreeSet<String> = lib
        .lines()
        .filter_map(|line| {
            let line = line.strip_prefix("pub ").unwrap_or(line);
            line.strip_prefix("mod ")?
                .strip_suffix(';')
                .map(str::to_owned)
        })
        .filter(|module| module != "prelude")
        .collect();
    let listed: BTreeSet<String> = table().into_keys().collect();
    assert_eq!(declared, listed);
}

/// A table that allowed everything would prove nothing.
#[test]
fn the_check_notices_a_forbidden_import() {
    let used =
        inside("use crate::{eval::Grid, math::{Real, Vector}};\nlet x = crate::field::Tree;");
    let expected = ["eval", "field", "math"].map(str::to_owned);
    assert_eq!(used, expected.into_iter().collect());
    assert!(!table()["reference"][0].contains("eval"));
    assert_eq!(outside("use wide::f32x8;").len(), 1);
}
