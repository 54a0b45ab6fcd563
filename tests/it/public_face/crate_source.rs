//! The parsed files of the crate, and the items that paths in them lead to.

use std::collections::BTreeMap;
use std::path::Path;

use syn::{Attribute, File, Item, UseTree};

/// The modules from the root of the crate down to one.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct ModulePath(Vec<String>);

impl ModulePath {
    pub fn root() -> Self {
        ModulePath(Vec::new())
    }

    pub fn child(&self, name: &str) -> Self {
        let mut path = self.0.clone();
        path.push(name.to_owned());
        ModulePath(path)
    }

    pub fn name(&self) -> &str {
        self.0.last().map_or("", String::as_str)
    }

    fn parent(&self) -> Self {
        ModulePath(self.0[..self.0.len() - 1].to_vec())
    }
}

/// Where a path leads.
pub enum Found<'a> {
    Item(&'a Item),
    Module(ModulePath),
    /// To another crate.
    Elsewhere,
}

pub struct CrateSource(BTreeMap<ModulePath, File>);

impl CrateSource {
    /// Reads `lib.rs` and the modules below it, without those for tests.
    pub fn read(folder: &Path) -> Self {
        let mut files = BTreeMap::new();
        read_module(
            &folder.join("lib.rs"),
            folder,
            ModulePath::root(),
            &mut files,
        );
        CrateSource(files)
    }

    pub fn items(&self, module: &ModulePath) -> &[Item] {
        self.0.get(module).map_or(&[], |file| &file.items)
    }

    /// The files of the crate.
    pub fn files(&self) -> impl Iterator<Item = &File> {
        self.0.values()
    }

    /// The item or module that a path in a module leads to, through imports.
    pub fn find(&self, from: &ModulePath, path: &[String]) -> Found<'_> {
        let (first, rest) = path.split_first().expect("a path");
        let start = match first.as_str() {
            "crate" => Some(ModulePath::root()),
            "self" => Some(from.clone()),
            "super" => Some(from.parent()),
            _ => None,
        };
        if let Some(start) = start {
            return self.find(&start, rest);
        }
        let child = from.child(first);
        if self.0.contains_key(&child) {
            return match rest {
                [] => Found::Module(child),
                _ => self.find(&child, rest),
            };
        }
        let items = self.items(from);
        if let Some(item) = items
            .iter()
            .find(|item| name_of(item).as_ref() == Some(first))
        {
            return Found::Item(item);
        }
        let uses = items.iter().filter_map(|item| match item {
            Item::Use(import) => Some(imports(&import.tree)),
            _ => None,
        });
        let import = uses.flatten().find(|path| path.last() == Some(first));
        match import {
            Some(import) if import.len() > 1 => self.find(from, &import),
            _ => Found::Elsewhere,
        }
    }
}

fn read_module(
    file: &Path,
    folder: &Path,
    path: ModulePath,
    files: &mut BTreeMap<ModulePath, File>,
) {
    let text = std::fs::read_to_string(file).expect("a file of the crate");
    let parsed = syn::parse_file(&text).expect("Rust");
    for item in &parsed.items {
        let Item::Mod(module) = item else { continue };
        if module.content.is_some() || is_for_tests(&module.attrs) {
            continue;
        }
        let name = module.ident.to_string();
        let (alone, inside) = (folder.join(format!("{name}.rs")), folder.join(&name));
        let file = if alone.exists() {
            alone
        } else {
            inside.join("mod.rs")
        };
        read_module(&file, &inside, path.child(&name), files);
    }
    files.insert(path, parsed);
}

pub fn is_for_tests(attributes: &[Attribute]) -> bool {
    let is_test = |text: String| text.contains("test");
    let conditions = attributes.iter().filter(|it| it.path().is_ident("cfg"));
    let texts = conditions.filter_map(|it| it.meta.require_list().ok());
    texts.map(|list| list.tokens.to_string()).any(is_test)
}

/// The paths that an import brings in; a glob ends with `*`.
pub fn imports(tree: &UseTree) -> Vec<Vec<String>> {
    match tree {
        UseTree::Path(path) => {
            let mut inner = imports(&path.tree);
            inner
                .iter_mut()
                .for_each(|it| it.insert(0, path.ident.to_string()));
            inner
        }
        UseTree::Name(name) => vec![vec![name.ident.to_string()]],
        UseTree::Rename(rename) => vec![vec![rename.ident.to_string()]],
        UseTree::Glob(_) => vec![vec!["*".to_owned()]],
        UseTree::Group(group) => group.items.iter().flat_map(imports).collect(),
    }
}

fn name_of(item: &Item) -> Option<String> {
    let name = match item {
        Item::Struct(it) => &it.ident,
        Item::Enum(it) => &it.ident,
        Item::Trait(it) => &it.ident,
        Item::Fn(it) => &it.sig.ident,
        Item::Const(it) => &it.ident,
        Item::Type(it) => &it.ident,
        _ => return None,
    };
    Some(name.to_string())
}
