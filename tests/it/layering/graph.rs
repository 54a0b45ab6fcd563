//! The files that each file needs, and circles among them.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;

use super::source::{Import, Source};

/// All source files of the crate.
pub struct Sources {
    pub files: Vec<Source>,
    by_module: BTreeMap<Vec<String>, usize>,
}

/// The meaning of a path.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Found {
    Module(Vec<String>),
    /// The number of the file that defines it.
    Item(usize),
}

/// For each file the files that it needs, each with a name for which it does.
pub type Needs = Vec<BTreeMap<usize, String>>;

impl Sources {
    /// Reads a folder and all below it.
    pub fn read(src: &Path) -> Self {
        let mut files = Vec::new();
        let mut open = vec![src.to_owned()];
        while let Some(folder) = open.pop() {
            for entry in std::fs::read_dir(&folder).expect("a readable folder") {
                let path = entry.expect("a readable entry").path();
                if path.is_dir() {
                    open.push(path);
                } else if path.extension().is_some_and(|end| end == "rs") {
                    let text = std::fs::read_to_string(&path).expect("a source file");
                    let path = path.strip_prefix(src).expect("a file below it");
                    files.push((path.to_owned(), text));
                }
            }
        }
        files.sort();
        Self::new(
            files
                .iter()
                .map(|(path, text)| (path.as_path(), text.as_str())),
        )
    }

    pub fn new<'a>(files: impl IntoIterator<Item = (&'a Path, &'a str)>) -> Self {
        let read = |(path, text): (&Path, &str)| Source::new(path, module_of(path), text);
        let mut files: Vec<Source> = files.into_iter().map(read).collect();
        let mut tests = BTreeSet::new();
        for source in &files {
            for test in &source.tests {
                tests.insert([&source.module[..], std::slice::from_ref(test)].concat());
            }
        }
        files.retain(|source| !tests.iter().any(|test| source.module.starts_with(test)));
        let modules = files.iter().enumerate();
        let by_module = modules.map(|(at, source)| (source.module.clone(), at));
        Sources {
            by_module: by_module.collect(),
            files,
        }
    }

    /// The files that each file needs. A file that only passes a name on does not need it.
    pub fn needs(&self) -> Needs {
        let files = self.files.iter().enumerate();
        files
            .map(|(at, source)| self.needs_of(at, source))
            .collect()
    }

    fn needs_of(&self, at: usize, source: &Source) -> BTreeMap<usize, String> {
        let mut needs = BTreeMap::new();
        let mut add = |found: Option<Found>, name: &str| {
            if let Some(Found::Item(file)) = found
                && file != at
            {
                needs.entry(file).or_insert_with(|| name.to_owned());
            }
        };
        for import in &source.imports {
            match &import.name {
                Some(name) if import.public && !source.mentions(name) => {}
                Some(name) => add(self.find(&source.module, &import.path), name),
                None => {
                    let all = self.find(&source.module, &import.path);
                    let Some(Found::Module(module)) = all else {
                        // An enumeration: the star imports its variants.
                        add(all, "*");
                        continue;
                    };
                    let tokens: BTreeSet<&String> = source.tokens.iter().collect();
                    for token in tokens {
                        add(self.look_up(&module, token, &mut Vec::new()), token);
                    }
                }
            }
        }
        for path in &source.paths {
            add(self.find(&source.module, path), &path.join("::"));
        }
        needs
    }

    /// The meaning of a path in a module; `None` for items of other crates.
    fn find(&self, module: &[String], path: &[String]) -> Option<Found> {
        self.find_unless(module, path, &mut Vec::new())
    }

    fn find_unless(
        &self,
        module: &[String],
        path: &[String],
        seen: &mut Vec<(Vec<String>, String)>,
    ) -> Option<Found> {
        let (first, mut rest) = path.split_first()?;
        let mut place = match first.as_str() {
            "crate" => Vec::new(),
            "self" => module.to_vec(),
            "super" => module[..module.len().checked_sub(1)?].to_vec(),
            name => match self.look_up(module, name, seen)? {
                Found::Module(place) => place,
                item => return Some(item),
            },
        };
        while let Some((next, others)) = rest.split_first() {
            if next == "super" {
                place.pop()?;
            } else {
                match self.look_up(&place, next, seen) {
                    Some(Found::Module(inner)) => place = inner,
                    Some(item) => return Some(item),
                    // From another crate, or made by a macro in the file of the module.
                    None if self.passes_on(&place, next) => return None,
                    None => return self.by_module.get(&place).copied().map(Found::Item),
                }
            }
            rest = others;
        }
        Some(Found::Module(place))
    }

    /// The meaning of a name in a module.
    fn look_up(
        &self,
        module: &[String],
        name: &str,
        seen: &mut Vec<(Vec<String>, String)>,
    ) -> Option<Found> {
        let key = (module.to_vec(), name.to_owned());
        if seen.contains(&key) {
            return None;
        }
        let child = [module, &[name.to_owned()]].concat();
        if self.by_module.contains_key(&child) {
            return Some(Found::Module(child));
        }
        let file = *self.by_module.get(module)?;
        let source = &self.files[file];
        if source.defines.iter().any(|item| item == name) {
            return Some(Found::Item(file));
        }
        seen.push(key);
        let named = |import: &&Import| import.name.as_deref() == Some(name);
        let import = source.imports.iter().find(named);
        if let Some(import) = import {
            // `use wide::…` in a module does not mean the module itself.
            return self.find_unless(module, &import.path, seen);
        }
        let stars = source.imports.iter().filter(|import| import.name.is_none());
        for star in stars {
            if let Some(Found::Module(inner)) = self.find_unless(module, &star.path, seen)
                && let Some(found) = self.look_up(&inner, name, seen)
            {
                return Some(found);
            }
        }
        None
    }

    /// Whether a module passes on a name of another crate.
    fn passes_on(&self, module: &[String], name: &str) -> bool {
        let Some(&file) = self.by_module.get(module) else {
            return false;
        };
        let source = &self.files[file];
        let is_external = |import: &Import| self.find(module, &import.path).is_none();
        let mut imports = source.imports.iter();
        let crates = source.tokens.windows(2);
        imports.any(|import| import.name.as_deref() == Some(name) && is_external(import))
            || (module.is_empty() && crates.into_iter().any(|two| two == ["as", name]))
    }
}

fn module_of(path: &Path) -> Vec<String> {
    let mut module: Vec<String> = path
        .with_extension("")
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    if ["mod", "lib"].contains(&module.last().map_or("", String::as_str)) {
        module.pop();
    }
    module
}

/// The shortest circle through each file that is on one, each circle once.
pub fn circles(needs: &Needs) -> Vec<Vec<usize>> {
    let mut found: Vec<Vec<usize>> = Vec::new();
    for start in 0..needs.len() {
        let Some(circle) = circle_through(needs, start) else {
            continue;
        };
        let mut sorted = circle.clone();
        sorted.sort_unstable();
        let is_new = found.iter().all(|known| {
            let mut known = known.clone();
            known.sort_unstable();
            known != sorted
        });
        if is_new {
            found.push(circle);
        }
    }
    found
}

fn circle_through(needs: &Needs, start: usize) -> Option<Vec<usize>> {
    let mut from: BTreeMap<usize, usize> = BTreeMap::new();
    let mut open = VecDeque::from([start]);
    while let Some(file) = open.pop_front() {
        for &next in needs[file].keys() {
            if next == start {
                let mut circle = vec![file];
                while let Some(&before) = from.get(&circle[circle.len() - 1]) {
                    circle.push(before);
                }
                circle.reverse();
                return Some(circle);
            }
            if next != start && !from.contains_key(&next) {
                from.insert(next, file);
                open.push_back(next);
            }
        }
    }
    None
}

/// The files of a circle, each with the name for which it needs the next one.
pub fn describe(sources: &Sources, needs: &Needs, circle: &[usize]) -> String {
    let next = circle.iter().cycle().skip(1);
    let links = circle.iter().zip(next).map(|(file, next)| {
        let path = sources.files[*file].file.display();
        format!("{path} -[{}]-> ", needs[*file][next])
    });
    let first = sources.files[circle[0]].file.display();
    links.chain([first.to_string()]).collect()
}
