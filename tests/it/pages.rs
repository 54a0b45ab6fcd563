//! Pages in Markdown: their links lead somewhere, and the first page is short.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use crate::layering::root;

/// The pages of the repository, the documentation among them.
fn pages() -> Vec<PathBuf> {
    let folders = ["", "docs", "docs/design", "lab", "tests/data"];
    let files = folders.into_iter().flat_map(|folder| {
        let files = std::fs::read_dir(root().join(folder)).expect("a folder");
        files.map(|file| file.expect("readable").path())
    });
    let pages: Vec<PathBuf> = files
        .filter(|path| path.extension().is_some_and(|it| it == "md"))
        .collect();
    assert!(pages.len() > 12, "{pages:?}");
    pages
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The text of a page without its programs.
fn prose(page: &str) -> String {
    let parts = page.split("\n```").step_by(2);
    parts.collect::<Vec<_>>().join("\n")
}

/// The targets of the links and pictures of a page.
fn links(page: &str) -> Vec<String> {
    let prose = prose(page);
    let after = prose.split("](").skip(1);
    let targets = after.filter_map(|rest| rest.split_once(')'));
    targets.map(|(target, _)| target.to_owned()).collect()
}

/// The anchors of a page's headings, as web hosts make them: lower-case letters, digits, hyphens and underscores;
/// blanks become hyphens.
fn anchors(page: &str) -> HashSet<String> {
    let prose = prose(page);
    let headings = prose.lines().filter(|line| line.starts_with('#'));
    let anchor = |line: &str| -> String {
        let text = line.trim_start_matches('#').trim().to_lowercase();
        let kept = text.chars().filter_map(|it| match it {
            ' ' => Some('-'),
            '-' | '_' => Some(it),
            _ => it.is_alphanumeric().then_some(it),
        });
        kept.collect()
    };
    headings.map(anchor).collect()
}

#[test]
fn links_lead_somewhere() {
    let mut seen = 0;
    for path in pages() {
        let page = read(&path);
        let folder = path.parent().expect("a folder");
        for link in links(&page) {
            // Addresses on the web are not looked up, and rustdoc resolves paths of items.
            if link.contains("://") || link.contains("::") {
                continue;
            }
            seen += 1;
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = match file {
                "" => path.clone(),
                file => folder.join(file),
            };
            let from = path.display();
            assert!(target.exists(), "{from}: nothing is at {link}");
            if !anchor.is_empty() {
                let known = anchors(&read(&target));
                assert!(
                    known.contains(anchor),
                    "{from}: {link} is none of {known:?}"
                );
            }
        }
    }
    assert!(seen > 50, "{seen} links");
}

#[test]
fn every_page_of_the_documentation_is_listed() {
    for list in ["README.md", "docs/README.md"] {
        let listed = links(&read(&root().join(list)));
        for page in pages() {
            let name = page.file_name().expect("a name").to_string_lossy();
            let in_docs = page.parent().is_some_and(|it| it.ends_with("docs"));
            let is_listed = listed.iter().any(|it| it.ends_with(&*name));
            assert!(
                !in_docs || name == "README.md" || is_listed,
                "{list} lacks {name}"
            );
        }
    }
}

/// Readers give up on a longer first page.
#[test]
fn the_first_page_is_short() {
    let size = read(&root().join("README.md")).len();
    assert!(size <= 7168, "{size} bytes");
}
