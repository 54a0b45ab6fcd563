//! What the tests noticed, by room.

use std::collections::BTreeMap;
use std::path::Path;

use crate::read_list;
use crate::run::{RESULTS, SURVIVED, UNREACHED};

#[derive(Default)]
struct Tally {
    tried: usize,
    survived: usize,
}

impl Tally {
    fn share(&self) -> f64 {
        100.0 * self.survived as f64 / self.tried.max(1) as f64
    }
}

/// Prints the table; returns the percentage that survived in all rooms.
pub fn report(folder: &Path) -> f64 {
    let mutants: BTreeMap<usize, _> = read_list(folder)
        .into_iter()
        .map(|it| (it.id, it))
        .collect();
    let text = std::fs::read_to_string(folder.join(RESULTS)).expect("results");
    let mut rooms: BTreeMap<&str, Tally> = BTreeMap::new();
    let mut all = Tally::default();
    let mut survivors = Vec::new();
    for line in text.lines() {
        let mut words = line.split('\t');
        let id: usize = words
            .next()
            .and_then(|it| it.parse().ok())
            .expect("a number");
        let verdict = words.next().unwrap_or_default();
        let survived = [SURVIVED, UNREACHED].contains(&verdict);
        let mutant = &mutants[&id];
        for tally in [rooms.entry(mutant.room()).or_default(), &mut all] {
            tally.tried += 1;
            tally.survived += usize::from(survived);
        }
        if survived {
            survivors.push((mutant, verdict));
        }
    }
    println!("| room | changes | survived | % |\n|---|---|---|---|");
    for (room, tally) in rooms.iter().chain([(&"all", &all)]) {
        println!(
            "| {room} | {} | {} | {:.1} |",
            tally.tried,
            tally.survived,
            tally.share()
        );
    }
    println!();
    for (it, verdict) in survivors {
        let note = if verdict == UNREACHED {
            " (no test comes to it)"
        } else {
            ""
        };
        println!("- {} {}:{}: {}{note}", it.id, it.file, it.line, it.change);
    }
    all.share()
}
