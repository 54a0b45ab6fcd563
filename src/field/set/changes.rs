//! What has changed in a set, for those that follow it.

use std::hash::{BuildHasher, RandomState};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::math::ColliderHandle;

/// One change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// The term of this serial was inserted, changed or removed.
    Term(u64),
    /// Axes were declared or set.
    Axes,
    /// The properties of a collider were set.
    Collider(ColliderHandle),
    /// What bodies ask for was set.
    Samplings,
}

/// Followers that are more changes behind than this, or than there are terms, begin anew.
const LONGEST: usize = 4096;

/// The last changes of a set.
///
/// Each is marked with a number that is given to no other change of any set: who has followed one
/// set up to such a number finds it again in that set, and in clones that were made later, but not
/// in one that went another way.
#[derive(Clone, Debug)]
pub(super) struct Changes {
    /// In ascending order. The first stands for all that was before.
    list: Vec<(u64, Change)>,
    /// Tells this state of the set from all others, in other runs of the program, too.
    mark: u64,
}

/// The next number; zero is given to none.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// Makes marks of numbers, others in every run.
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

    /// Takes up the mark of a set that was saved in this state.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn go_on_from(&mut self, mark: u64) {
        self.mark = mark;
    }

    pub(super) fn last(&self) -> u64 {
        self.list.last().map_or(0, |(number, _)| *number)
    }

    /// The changes after a number, if that is known.
    pub(super) fn since(&self, number: u64) -> Option<impl Iterator<Item = Change> + Clone> {
        let place = self.list.binary_search_by_key(&number, |(known, _)| *known);
        let after = &self.list[place.ok()? + 1..];
        Some(after.iter().map(|(_, change)| *change))
    }
}

/// A set begins with a number of its own, as nobody has seen it before.
impl Default for Changes {
    fn default() -> Self {
        let mut changes = Changes {
            list: Vec::new(),
            mark: 0,
        };
        changes.push(Change::Axes);
        changes
    }
}
