//! The import table of ARCHITECTURE.md holds for the code, the code fills the table, and no files
//! need each other in a circle.
//!
//! A file needs the files that define the names it uses, whichever modules re-export them. Methods are not seen, only
//! imports and paths.

mod graph;
mod habits;
mod source;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use graph::{Sources, circles, describe};
use source::Source;

/// The crates that the table's last column is about; `std` and macros of tests are not.
const OUTSIDE: [&str; 6] = [
    "rapier",
    "thiserror",
    "fearless_simd",
    "glamx",
    "rayon",
    "tracing",
];

pub fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let is_root = |folder: &&Path| folder.join("ARCHITECTURE.md").exists();
    let root = package.ancestors().find(is_root);
    root.expect("a folder above the package").to_owned()
}

fn sources() -> Sources {
    let sources = Sources::read(&root().join("src"));
    assert!(sources.files.len() > 50, "the sources were not found");
    sources
}

/// The rows of the first table of ARCHITECTURE.md.
fn rows() -> Vec<[String; 3]> {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("the table's file");
    let lines = text.lines().skip_while(|line| !line.starts_with('|'));
    let rows = lines.take_while(|line| line.starts_with('|')).skip(2);
    let cells = rows.map(|row| cells(row).try_into().expect("three cells in a row"));
    cells.collect()
}

/// For each module: the modules of the crate that it may use, and the other crates that it may name. Data flows down
/// the rows: no module uses one below it.
fn table() -> BTreeMap<String, [BTreeSet<String>; 2]> {
    let rows = rows();
    assert!(rows.len() >= 10, "the table was not found");
    let mut above: BTreeSet<String> = BTreeSet::new();
    let mut table = BTreeMap::new();
    for [module, inside, outside] in rows {
        let inside = match inside.strip_prefix("all but ") {
            Some(but) => &above - &names(but),
            None => names(&inside),
        };
        assert!(inside.is_subset(&above), "{module} uses what is below it");
        above.insert(module.clone());
        table.insert(module, [inside, names(&outside)]);
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

/// The crates of [`OUTSIDE`] that a file names.
fn outside(source: &Source) -> BTreeSet<&'static str> {
    let imports = source.imports.iter().map(|import| &import.path);
    let paths = imports.chain(&source.paths);
    let mut found: BTreeSet<&str> = BTreeSet::new();
    for path in paths {
        // `lib.rs` re-exports the Rapier of either precision as `rapier`.
        let path = path.strip_prefix(&["crate".to_owned()]).unwrap_or(path);
        found.extend(
            OUTSIDE
                .iter()
                .find(|name| path.first().is_some_and(|p| p == *name)),
        );
    }
    if source
        .tokens
        .windows(3)
        .any(|three| three == ["#", "[", "error"])
    {
        found.insert("thiserror");
    }
    found
}

/// The top-level modules (rooms) that a file names after `crate::`, or by enough of `super::`; and names of `lib.rs`.
fn rooms_named(source: &Source) -> BTreeSet<&str> {
    let imports = source.imports.iter().map(|import| &import.path);
    let mut found = BTreeSet::new();
    for path in imports.chain(&source.paths) {
        let up = path.iter().take_while(|part| *part == "super").count();
        let at = match path[0].as_str() {
            "crate" => 1,
            "super" if up == source.module.len() => up,
            _ => continue,
        };
        found.extend(path.get(at).map(String::as_str));
    }
    found
}

#[test]
fn modules_use_only_what_the_table_allows() {
    let table = table();
    let sources = sources();
    let needs = sources.needs();
    let mut wrong = BTreeSet::new();
    for (source, needs) in sources.files.iter().zip(&needs) {
        let file = source.file.display();
        let Some(room) = source.module.first() else {
            continue;
        };
        let Some([may_use, may_name]) = table.get(room) else {
            // The prelude has no row; `the_table_lists_the_modules_of_the_crate` checks that all other modules have.
            assert_eq!(room, "prelude", "{file} is in no room of the table");
            continue;
        };
        for named in rooms_named(source) {
            // Re-exports of `lib.rs` must be imported from the module that defines them.
            if named != room && !may_use.contains(named) && named != "rapier" {
                wrong.insert(format!("{file} uses crate::{named}"));
            }
        }
        for (used, name) in needs {
            let used = &sources.files[*used];
            let is_own = |used: &String| used == room || may_use.contains(used);
            if !used.module.first().is_none_or(is_own) {
                wrong.insert(format!("{file} uses {name} of {}", used.file.display()));
            }
        }
        for named in outside(source) {
            if !may_name.contains(named) {
                wrong.insert(format!("{file} names {named}"));
            }
        }
    }
    let wrong: Vec<String> = wrong.into_iter().collect();
    assert!(
        wrong.is_empty(),
        "against ARCHITECTURE.md:\n{}",
        wrong.join("\n")
    );
}

#[test]
fn only_the_bridge_writes_into_rapiers_sets() {
    let writes = [
        ["bodies", ".", "get_mut"],
        ["bodies", ".", "iter_mut"],
        ["colliders", ".", "get_mut"],
        ["&", "mut", "RigidBodySet"],
        ["&", "mut", "ColliderSet"],
    ];
    let sources = sources();
    let writers = sources.files.iter().filter(|source| {
        let mut triples = source.tokens.windows(3);
        triples.any(|triple| writes.iter().any(|write| triple == write))
    });
    let rooms: BTreeSet<_> = writers.map(|source| source.module[0].as_str()).collect();
    assert_eq!(rooms, BTreeSet::from(["bridge"]));
}

#[test]
fn no_files_need_each_other_in_a_circle() {
    let sources = sources();
    let needs = sources.needs();
    let links: usize = needs.iter().map(|needs| needs.len()).sum();
    assert!(links > 3 * sources.files.len(), "only {links} links found");
    let found = circles(&needs);
    let found = found
        .iter()
        .map(|circle| describe(&sources, &needs, circle));
    let found: Vec<String> = found.collect();
    assert!(
        found.is_empty(),
        "{} circles:\n{}",
        found.len(),
        found.join("\n")
    );
}

/// Top-level modules without tuples as arguments, `match` on a bool and vague comments; the list may only grow.
const TIDY: [&str; 18] = [
    "bridge",
    "compile",
    "contact",
    "cross_check",
    "debug_render",
    "diagnose",
    "eval",
    "field",
    "fields",
    "integrate",
    "math",
    "neighbors",
    "pipeline",
    "prelude",
    "reference",
    "rigid",
    "sample",
    "threads",
];

#[test]
fn tidy_modules_stay_tidy() {
    let sources = sources();
    let is_tidy = |source: &&Source| {
        let room = source.module.first();
        room.is_some_and(|room| TIDY.contains(&room.as_str()))
    };
    let mut wrong = Vec::new();
    for source in sources.files.iter().filter(is_tidy) {
        let file = source.file.display();
        let text = std::fs::read_to_string(root().join("src").join(&source.file));
        let found = habits::of(source, &text.expect("a source file")).into_iter();
        wrong.extend(found.map(|habit| format!("{file}: {habit}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The structs, enums and traits that several files define, each with two of these files.
fn shared_type_names(sources: &Sources) -> Vec<String> {
    let mut known: BTreeMap<&str, &Source> = BTreeMap::new();
    let mut shared = Vec::new();
    for source in &sources.files {
        for pair in source.tokens.windows(2) {
            let [kind, name] = [&pair[0], &pair[1]].map(String::as_str);
            if !["struct", "enum", "trait"].contains(&kind) {
                continue;
            }
            if let Some(other) = known.insert(name, source) {
                let files = [other, source].map(|it| it.file.display());
                shared.push(format!("{name}: {}, {}", files[0], files[1]));
            }
        }
    }
    shared
}

#[test]
fn no_type_name_is_used_twice() {
    let shared = shared_type_names(&sources());
    assert!(shared.is_empty(), "{}", shared.join("\n"));
}

#[test]
fn the_check_notices_a_type_name_used_twice() {
    let files = [
        ("a.rs", "struct One; fn one() {} const LIMIT: u8 = 1;"),
        (
            "b.rs",
            "enum One {} trait Two {} fn one() {} const LIMIT: u8 = 2;",
        ),
        ("c.rs", "#[cfg(test)] mod tests { struct Two; }"),
    ];
    assert_eq!(shared_type_names(&small(&files)), ["One: a.rs, b.rs"]);
}

#[test]
fn the_check_notices_habits() {
    let text = "fn a<F: Fn(u8) -> u8>((one, two): (u8, u8), f: F) {}\n\
                fn b(pair: &'a mut (u8, u8), unit: (), list: Vec<(u8, u8)>) {}\n\
                fn c([x, y]: [u8; 2], f: impl Fn((u8, u8)) -> u8, g: fn((u8, u8))) {}\n\
                fn d() { match flag { true => 1, false => 2 } }\n\
                // What is it?\n\
                /// What it is.\n\
                // Of so many.";
    let sources = small(&[("a.rs", text)]);
    let expected = [
        "fn a takes a tuple",
        "fn b takes a tuple",
        "`/// What it is.`",
        "`// Of so many.`",
        "2 arms match on a bool",
    ];
    assert_eq!(habits::of(&sources.files[0], text), expected);
}

/// The order of `lib.rs` is that of the table, and no module is missing from it.
#[test]
fn the_table_lists_the_modules_of_the_crate() {
    let lib = std::fs::read_to_string(root().join("src/lib.rs")).expect("lib.rs");
    let declared: Vec<String> = lib
        .lines()
        .filter_map(|line| {
            let line = line.strip_prefix("pub ").unwrap_or(line);
            line.strip_prefix("mod ")?
                .strip_suffix(';')
                .map(str::to_owned)
        })
        .filter(|module| module != "prelude")
        .collect();
    let listed: Vec<String> = rows().into_iter().map(|[module, ..]| module).collect();
    assert_eq!(declared, listed);
}

/// A crate of a few files, by their texts.
fn small(files: &[(&str, &str)]) -> Sources {
    Sources::new(files.iter().map(|(path, text)| (Path::new(*path), *text)))
}

fn circles_of(files: &[(&str, &str)]) -> Vec<String> {
    let sources = small(files);
    let needs = sources.needs();
    let found = circles(&needs);
    let found = found
        .iter()
        .map(|circle| describe(&sources, &needs, circle));
    found.collect()
}

#[test]
fn the_check_notices_a_circle() {
    // Through a folder's re-export, and back through `super`.
    let found = circles_of(&[
        ("lib.rs", "mod a; mod b;"),
        ("a/mod.rs", "mod inner; pub use inner::Thing;"),
        (
            "a/inner.rs",
            "pub struct Thing; fn f() { super::super::b::g() }",
        ),
        ("b.rs", "use crate::a::Thing; pub fn g() {}"),
    ]);
    let circle = "a/inner.rs -[super::super::b::g]-> b.rs -[Thing]-> a/inner.rs";
    assert_eq!(found, [circle]);
    // Through a glob import, and through the name of a module.
    let found = circles_of(&[
        (
            "a.rs",
            "mod inner; use inner::*; const SIZE: usize = 1; fn f() { g() }",
        ),
        ("a/inner.rs", "use crate::a; pub fn g() { a::SIZE; }"),
    ]);
    assert_eq!(found, ["a.rs -[g]-> a/inner.rs -[a::SIZE]-> a.rs"]);
}

#[test]
fn passing_a_name_on_is_no_circle() {
    let found = circles_of(&[
        (
            "a.rs",
            "mod one; mod two; pub use one::One; pub(crate) use two::Two;",
        ),
        ("a/one.rs", "use super::Two; pub struct One;"),
        (
            "a/two.rs",
            "pub struct Two; #[cfg(test)] mod tests { use super::super::One; }",
        ),
    ]);
    assert!(found.is_empty(), "{found:?}");
}

/// A table that allowed everything would prove nothing.
#[test]
fn the_check_notices_a_forbidden_import() {
    let text = "use crate::{eval::Grid, math::{Real, Vector}}; use fearless_simd::f32x8;\n\
                fn f() { super::super::field::Tree::new() }";
    let sources = small(&[("here/deep.rs", text)]);
    let expected = ["eval", "field", "math"];
    assert_eq!(rooms_named(&sources.files[0]), expected.into());
    assert_eq!(outside(&sources.files[0]), ["fearless_simd"].into());
    assert!(!table()["reference"][0].contains("eval"));
}
