//! The latest changes of a set, for caches that follow it.

use std::hash::{BuildHasher, RandomState};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// A change of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// The term of this serial was inserted, changed or removed.
    Term(u64),
    /// Axes were declared or set, or the properties of a collider.
    Properties,
    /// The samplings of bodies were set.
    Samplings,
}

/// The number of changes that remain when the list is cut. A cache that is behind by more may have to be built anew.
const LONGEST: usize = 4096;

/// The latest changes of a set.
///
/// Each has a number that no other change of any set has. So a cache finds the number of the last change that it
/// contains in its set and in later clones of it, but not in a clone that has changed in another way.
#[derive(Clone, Debug)]
pub(super) struct Changes {
    /// In ascending order of numbers. The first stands for all changes before it, too.
    list: Vec<(u64, Change)>,
    /// A number that no other state of a set has, also in other runs of the program.
    mark: u64,
}

/// The next number. Zero is not used.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// Turns numbers into marks that differ from run to run.
static KEYS: OnceLock<RandomState> = OnceLock::new();

impl Changes {
    pub(super) fn push(&mut self, change: Change) {
        if self.list.len() >= 2 * LONGEST {
            self.list.drain(..LONGEST);
        }
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        self.list.push((number, change));
        self.mark = KEYS.get_or_init(RandomState::new).hash_one(number);
    }

    pub(super) fn mark(&self) -> u64 {
        self.mark
    }

    /// Restores the mark of a set that was saved in this state.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn go_on_from(&mut self, mark: u64) {
        self.mark = mark;
    }

    pub(super) fn last(&self) -> u64 {
        self.list.last().map_or(0, |(number, _)| *number)
    }

    /// The changes after a number; `None` if the number is not in the list.
    pub(super) fn since(&self, number: u64) -> Option<impl Iterator<Item = Change> + Clone> {
        let place = self.list.binary_search_by_key(&number, |(known, _)| *known);
        let after = &self.list[place.ok()? + 1..];
        Some(after.iter().map(|(_, change)| *change))
    }
}

/// A new set begins with a change of its own, which no cache contains.
impl Default for Changes {
    fn default() -> Self {
        let mut changes = Changes {
            list: Vec::new(),
            mark: 0,
        };
        changes.push(Change::Properties);
        changes
    }
}
