//! The public names of the crate, with their signatures, are those of `tests/public-api.txt`.
//!
//! `WRITE_API=1 cargo test --test it public_face::` writes the file anew. A line that is new is an addition; one that
//! is gone or changed breaks programs, and belongs into CHANGELOG.md as **breaking**.

mod crate_source;
mod describe;

use std::collections::BTreeSet;

use crate::layering::root;
use crate_source::{CrateSource, Found, ModulePath};
use describe::{implementations, item_lines};
use syn::{Item, Visibility};

/// All lines of the public face, in the order of their text.
fn face() -> BTreeSet<String> {
    let source = CrateSource::read(&root().join("src"));
    let mut lines = BTreeSet::new();
    list(&source, &ModulePath::root(), "rapier3d_fields", &mut lines);
    lines
}

/// The public items of a module, under the path by which users find it.
fn list(
    source: &CrateSource,
    module: &ModulePath,
    public_path: &str,
    lines: &mut BTreeSet<String>,
) {
    for item in source.items(module) {
        match item {
            Item::Mod(inner) if is_public(&inner.vis) => {
                let name = inner.ident.to_string();
                let public_path = format!("{public_path}::{name}");
                lines.insert(format!("mod {public_path}"));
                list(source, &module.child(&name), &public_path, lines);
            }
            Item::Use(import) if is_public(&import.vis) => {
                for name in crate_source::imports(&import.tree) {
                    list_import(source, module, public_path, &name, lines);
                }
            }
            item => lines.extend(item_lines(public_path, item, source)),
        }
    }
}

fn list_import(
    source: &CrateSource,
    module: &ModulePath,
    public_path: &str,
    name: &[String],
    lines: &mut BTreeSet<String>,
) {
    // The prelude repeats names that have a path already.
    if public_path.ends_with("::prelude") {
        lines.insert(format!(
            "use {public_path}::{}",
            name.last().expect("a name")
        ));
        return;
    }
    match source.find(module, name) {
        Found::Item(item) => lines.extend(item_lines(public_path, item, source)),
        Found::Module(path) => {
            let public_path = format!("{public_path}::{}", path.name());
            lines.insert(format!("mod {public_path}"));
            list(source, &path, &public_path, lines);
        }
        Found::Elsewhere => {
            lines.insert(format!("use {public_path}::{}", name.join("::")));
        }
    }
}

fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

#[test]
fn the_public_names_are_those_of_the_file() {
    let path = root().join("tests/public-api.txt");
    let lines: Vec<String> = face().into_iter().collect();
    let text = lines.join("\n") + "\n";
    if std::env::var_os("WRITE_API").is_some() {
        std::fs::write(&path, &text).expect("a folder that can be written to");
    }
    let known = std::fs::read_to_string(&path).expect("the file of public names");
    let known: BTreeSet<&str> = known.lines().collect();
    let now: BTreeSet<&str> = text.lines().collect();
    let gone: Vec<_> = known.difference(&now).collect();
    let added: Vec<_> = now.difference(&known).collect();
    assert!(
        gone.is_empty() && added.is_empty(),
        "gone or changed, which is breaking:\n{gone:#?}\nadded:\n{added:#?}\n\
         WRITE_API=1 cargo test --release --test it public_face:: writes the file anew"
    );
}

#[test]
fn each_type_has_one_path() {
    let mut names = BTreeSet::new();
    for line in face() {
        let mut words = line.split_whitespace();
        let Some("struct" | "enum" | "trait") = words.next() else {
            continue;
        };
        let path = words.next().expect("a path");
        let name = path.split(['<', ',']).next().expect("a name");
        let name = name.rsplit("::").next().expect("a name").to_owned();
        assert!(
            names.insert(name.clone()),
            "{name} has several public paths"
        );
    }
    assert!(names.len() > 60, "the names were not found: {names:?}");
}

#[test]
fn a_public_type_has_its_methods_and_traits_listed() {
    let source = CrateSource::read(&root().join("src"));
    let of_tree = implementations("Tree", "rapier3d_fields::Tree", &source);
    // One written by hand, one by a macro, one of a trait.
    for start in [
        "fn rapier3d_fields::Tree::fold<",
        "fn rapier3d_fields::Tree::sum_union(",
        "impl From<Field> for",
    ] {
        assert!(
            of_tree.iter().any(|line| line.starts_with(start)),
            "{start}: {of_tree:#?}"
        );
    }
    assert!(
        of_tree.iter().all(|line| !line.contains("::nodes(")),
        "private methods: {of_tree:#?}"
    );
}
