//! The scene files that can be chosen.

use std::path::{Path, PathBuf};

use rapier_testbed3d::ExampleEntry;

/// A scene file, under the name that the testbed lists it by.
pub struct Entry {
    pub name: &'static str,
    pub path: PathBuf,
}

pub struct Catalogue(Vec<Entry>);

impl Catalogue {
    /// The given files, or those of `examples/scenes` if there are none.
    ///
    /// # Errors
    /// The folder cannot be read, or has no scene.
    pub fn new(mut paths: Vec<PathBuf>) -> Result<Self, String> {
        if paths.is_empty() {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
            let place = folder.display().to_string();
            let files = std::fs::read_dir(folder).map_err(|error| format!("{place}: {error}"))?;
            paths = files.flatten().map(|file| file.path()).collect();
            paths.retain(|path| path.extension().is_some_and(|end| end == "json"));
            paths.sort();
            if paths.is_empty() {
                return Err(format!("{place} has no scene files"));
            }
        }
        let entry = |path: PathBuf| {
            let name = path.file_stem().unwrap_or(path.as_os_str());
            // The testbed keeps names for the whole run of the program.
            let name = name.to_string_lossy().into_owned().leak();
            Entry { name, path }
        };
        Ok(Catalogue(paths.into_iter().map(entry).collect()))
    }

    /// The list in the testbed's panel.
    pub fn examples(&self) -> Vec<ExampleEntry> {
        let entries = self.0.iter();
        entries
            .map(|it| ExampleEntry::new("Scenes", it.name))
            .collect()
    }

    pub fn first(&self) -> &Entry {
        &self.0[0]
    }

    /// The entry of this name, or the first one.
    pub fn get(&self, name: Option<&str>) -> &Entry {
        let found = self.0.iter().find(|entry| Some(entry.name) == name);
        found.unwrap_or(self.first())
    }
}
