//! A copy of the repository with changes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::sites::{Site, sites};
use crate::{Mutant, write_list};

/// The switch, as a module of the copy. With `MUTANT_REACHED`, it appends the numbers of the changes that a program
/// comes to to the file of this name, and makes none.
const SWITCH: &str = r#"
/// The change that is switched on.
pub(crate) mod mutants {
    use std::io::Write;
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

    const ALL: u32 = u32::MAX;
    static CHOSEN: OnceLock<u32> = OnceLock::new();
    static REACHED: [AtomicBool; 1 << 16] = [const { AtomicBool::new(false) }; 1 << 16];

    #[inline]
    pub(crate) fn on(id: u32) -> bool {
        let chosen = *CHOSEN.get_or_init(chosen);
        if chosen == ALL && !REACHED[id as usize].swap(true, Relaxed) {
            note(id);
        }
        chosen == id
    }

    fn chosen() -> u32 {
        if std::env::var_os("MUTANT_REACHED").is_some() {
            return ALL;
        }
        let read = std::env::var("MUTANT").ok().and_then(|it| it.parse().ok());
        read.unwrap_or(0)
    }

    #[cold]
    fn note(id: u32) {
        let path = std::env::var_os("MUTANT_REACHED").expect("the name of a file");
        let file = std::fs::File::options().create(true).append(true).open(path);
        writeln!(file.expect("a file"), "{id}").expect("a line");
    }
}
"#;

/// A change in a file.
struct Chosen {
    id: usize,
    file: String,
    site: Site,
}

pub fn prepare(folder: &Path, count: usize, seed: u64, room: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    copy(&root, folder);
    let sources = sources(&root, room);
    let mut chosen = choose(&sources, count, seed);
    println!("{} changes", chosen.len());
    loop {
        write(folder, &sources, &chosen);
        let wrong = wrong(folder);
        if wrong.is_empty() {
            break;
        }
        let lines = Lines::of(&sources, &chosen);
        let guilty = lines.guilty(&wrong, &chosen);
        assert!(
            !guilty.is_empty(),
            "errors that no change explains: {wrong:?}"
        );
        println!("{} do not compile", guilty.len());
        chosen.retain(|it| !guilty.contains(&it.id));
    }
    let mutants = chosen.iter().map(|it| Mutant {
        id: it.id,
        file: it.file.clone(),
        line: it.site.line,
        change: it.site.change.clone(),
    });
    write_list(folder, &mutants.collect::<Vec<_>>());
}

fn copy(root: &Path, folder: &Path) {
    let listed = Command::new("git")
        .args([
            "ls-files",
            "-z",
            "--cached",
            "--others",
            "--exclude-standard",
        ])
        .current_dir(root)
        .output()
        .expect("git");
    let listed = String::from_utf8(listed.stdout).expect("names in UTF-8");
    for name in listed.split('\0').filter(|it| root.join(it).is_file()) {
        let to = folder.join(name);
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("a folder");
        std::fs::copy(root.join(name), to).expect("a file");
    }
}

/// The sources without tests, by their names.
fn sources(root: &Path, room: &str) -> BTreeMap<String, String> {
    let mut folders = vec![PathBuf::from("src")];
    let mut sources = BTreeMap::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root.join(&folder)).expect("a folder") {
            let entry = entry.expect("an entry").path();
            let name = folder.join(entry.file_name().expect("a name"));
            if name.file_stem().is_some_and(|it| it == "tests") {
                continue;
            }
            if entry.is_dir() {
                folders.push(name);
            } else if name.extension().is_some_and(|it| it == "rs") {
                let name = name.to_string_lossy().into_owned();
                let text = std::fs::read_to_string(&entry).expect("a text");
                sources.insert(name, text);
            }
        }
    }
    let inside = format!("src/{room}");
    let of_tests: Vec<String> = sources
        .iter()
        .flat_map(|(name, text)| test_modules(name, text))
        .collect();
    sources.retain(|name, _| name.starts_with(&inside) && !of_tests.contains(name));
    sources
}

/// The files of the modules that a file declares for tests only.
fn test_modules(name: &str, text: &str) -> Vec<String> {
    let folder = name
        .trim_end_matches("/mod.rs")
        .trim_end_matches("/lib.rs")
        .trim_end_matches(".rs");
    let after = text.split("#[cfg(test)]\nmod ").skip(1);
    let names = after.filter_map(|it| it.split_once(';'));
    names
        .map(|(module, _)| format!("{folder}/{module}.rs"))
        .collect()
}

/// A SplitMix64 generator.
struct Random(u64);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % count as u64) as usize
    }
}

/// Random changes that do not overlap.
fn choose(sources: &BTreeMap<String, String>, count: usize, seed: u64) -> Vec<Chosen> {
    let of_file = |(file, text): (&String, &String)| {
        let file = file.clone();
        sites(text)
            .into_iter()
            .map(move |site| (file.clone(), site))
    };
    let mut all: Vec<(String, Site)> = sources.iter().flat_map(of_file).collect();
    println!("{} possible changes", all.len());
    let mut random = Random(seed);
    let mut chosen: Vec<Chosen> = Vec::new();
    while chosen.len() < count && !all.is_empty() {
        let (file, site) = all.swap_remove(random.below(all.len()));
        let apart = |it: &Chosen| {
            it.file != file
                || it.site.bytes.end <= site.bytes.start
                || site.bytes.end <= it.site.bytes.start
        };
        if chosen.iter().all(apart) {
            let id = chosen.len() + 1;
            chosen.push(Chosen { id, file, site });
        }
    }
    chosen.sort_by(|a, b| (&a.file, a.site.bytes.start).cmp(&(&b.file, b.site.bytes.start)));
    chosen
}

fn switched(it: &Chosen) -> String {
    it.site
        .text
        .replace("SWITCH", &format!("crate::mutants::on({})", it.id))
}

/// The text of a file with its changes.
fn changed(text: &str, changes: &[&Chosen]) -> String {
    let mut new = String::new();
    let mut at = 0;
    for it in changes {
        new += &text[at..it.site.bytes.start];
        new += &switched(it);
        at = it.site.bytes.end;
    }
    new + &text[at..]
}

fn write(folder: &Path, sources: &BTreeMap<String, String>, chosen: &[Chosen]) {
    for (file, text) in sources {
        let changes: Vec<&Chosen> = chosen.iter().filter(|it| it.file == *file).collect();
        let mut text = changed(text, &changes);
        if file == "src/lib.rs" {
            text += SWITCH;
        }
        std::fs::write(folder.join(file), text).expect("a file");
    }
    let lib = folder.join("src/lib.rs");
    let text = std::fs::read_to_string(&lib).expect("a text");
    if !text.contains(SWITCH) {
        std::fs::write(lib, text + SWITCH).expect("a file");
    }
}

/// The lines of the changed files on which changes are.
struct Lines(BTreeMap<usize, std::ops::RangeInclusive<usize>>);

impl Lines {
    fn of(sources: &BTreeMap<String, String>, chosen: &[Chosen]) -> Self {
        let mut lines = BTreeMap::new();
        for (file, text) in sources {
            let changes: Vec<&Chosen> = chosen.iter().filter(|it| it.file == *file).collect();
            for (n, it) in changes.iter().enumerate() {
                let before = changed(&text[..it.site.bytes.start], &changes[..n]);
                let first = 1 + before.matches('\n').count();
                let last = first + switched(it).matches('\n').count();
                lines.insert(it.id, first..=last);
            }
        }
        Lines(lines)
    }

    /// The changes on lines with errors; if there are none, the nearest to an error in its file.
    fn guilty(&self, wrong: &BTreeSet<(String, usize)>, chosen: &[Chosen]) -> BTreeSet<usize> {
        let distance = |it: &Chosen, line: usize| {
            let own = &self.0[&it.id];
            own.start()
                .saturating_sub(line)
                .max(line.saturating_sub(*own.end()))
        };
        let all = wrong.iter().flat_map(|(file, line)| {
            let same_file = chosen.iter().filter(move |it| it.file == *file);
            same_file.map(move |it| (distance(it, *line), it.id))
        });
        let all: Vec<(usize, usize)> = all.collect();
        let nearest = all.iter().map(|it| it.0).min();
        let guilty = all.iter().filter(|it| Some(it.0) == nearest);
        guilty.map(|it| it.1).collect()
    }
}

/// The places of the compiler's errors, in both precisions.
fn wrong(folder: &Path) -> BTreeSet<(String, usize)> {
    let checked = Command::new("cargo")
        .args(["check", "--message-format=json", "--keep-going"])
        .args([
            "-p",
            "rapier3d-fields",
            "-p",
            "rapier3d-fields-f64",
            "--lib",
        ])
        .env("RUSTFLAGS", "--cap-lints=allow")
        .current_dir(folder)
        .stderr(Stdio::null())
        .output()
        .expect("cargo");
    let mut places = BTreeSet::new();
    for line in String::from_utf8_lossy(&checked.stdout).lines() {
        let Ok(message) = serde_json::from_str::<serde_json::Value>(line) else {
            continue;
        };
        let message = &message["message"];
        if message["level"] != "error" {
            continue;
        }
        for span in message["spans"].as_array().into_iter().flatten() {
            let file = span["file_name"].as_str().unwrap_or_default();
            let file = file.trim_start_matches("f64/../").to_owned();
            let number = |name: &str| span[name].as_u64().unwrap_or(0) as usize;
            places.extend((number("line_start")..=number("line_end")).map(|it| (file.clone(), it)));
        }
        if message["spans"].as_array().is_some_and(Vec::is_empty) && places.is_empty() {
            println!("{}", message["message"]);
        }
    }
    places
}
