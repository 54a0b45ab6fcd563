//! What the tests noticed, by room.

use std::collections::BTreeMap;
use std::path::Path;

use crate::run::{RESULTS, SURVIVED, UNREACHED};
use crate::{Mutant, read_list};

/// Changes that do no harm, each with its file and the reason. A change is known by its text, since lines shift, so the
/// list has none that may stand twice in a file, such as another number.
const HARMLESS: &str = include_str!("../harmless.tsv");

#[derive(Default)]
struct Tally {
    tried: usize,
    harmless: usize,
    survived: usize,
}

impl Tally {
    fn share(&self) -> f64 {
        100.0 * self.survived as f64 / self.tried.max(1) as f64
    }
}

/// The reason why a change does no harm, if it is one of those that were looked into.
fn harmless(mutant: &Mutant) -> Option<&'static str> {
    let reason = |line: &'static str| {
        let (change, reason) = line.rsplit_once('\t')?;
        let (file, change) = change.split_once('\t')?;
        (file == mutant.file && change == mutant.change).then_some(reason)
    };
    HARMLESS.lines().find_map(reason)
}

/// Prints the table; returns the percentage that survived in all rooms, without those that do no harm.
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
        let reason = harmless(mutant);
        for tally in [rooms.entry(mutant.room()).or_default(), &mut all] {
            tally.tried += 1;
            tally.harmless += usize::from(survived && reason.is_some());
            tally.survived += usize::from(survived && reason.is_none());
        }
        if survived {
            survivors.push((mutant, verdict, reason));
        } else if reason.is_some() {
            println!(
                "noticed, though listed as harmless: {} {}",
                mutant.file, mutant.change
            );
        }
    }
    println!("| room | changes | harmless | survived | % |\n|---|---|---|---|---|");
    for (room, tally) in rooms.iter().chain([(&"all", &all)]) {
        println!(
            "| {room} | {} | {} | {} | {:.1} |",
            tally.tried,
            tally.harmless,
            tally.survived,
            tally.share()
        );
    }
    println!();
    for (it, verdict, reason) in survivors {
        let note = match reason {
            Some(reason) => format!(" (harmless: {reason})"),
            None if verdict == UNREACHED => " (no test comes to it)".to_owned(),
            None => String::new(),
        };
        println!("- {} {}:{}: {}{note}", it.id, it.file, it.line, it.change);
    }
    all.share()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmless_changes_can_be_made_in_one_place_each() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        for line in HARMLESS.lines() {
            let [file, change, reason] = line.split('\t').collect::<Vec<_>>()[..] else {
                panic!("{line}: not three columns");
            };
            assert!(!reason.is_empty(), "{line}");
            let text = std::fs::read_to_string(root.join(file)).expect(line);
            let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            let place = match change.split_once(" returns ") {
                Some((function, _)) => format!("fn {function}("),
                None => {
                    let change = change.strip_prefix("without ").unwrap_or(change);
                    let before = change.split_once(" -> ").map_or(change, |it| it.0);
                    before.to_owned()
                }
            };
            assert_eq!(text.matches(&place).count(), 1, "{line}");
        }
    }
}
