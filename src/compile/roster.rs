//! Which programs there are, for those that keep something for each.

use super::ordered::{Key, unique};
use super::program::Program;

/// Followers that are more changes behind than this begin anew.
const LONGEST: usize = 4096;

/// Numbers of programs by what is to be done with them, and which were changed.
#[derive(Debug)]
pub(crate) struct Roster {
    /// Tells this from all others.
    name: u64,
    /// Those that give forces anywhere, by number.
    unbounded: Vec<u32>,
    /// Those that give forces and some of which hang on bodies and colliders, by number.
    moving: Vec<u32>,
    /// How many changes are no longer in the list.
    forgotten: u64,
    /// Programs, and whose instances in them were changed.
    changed: Vec<(u32, Key)>,
}

/// Up to where a roster was followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Followed {
    name: u64,
    changes: u64,
}

impl Default for Roster {
    fn default() -> Self {
        Roster {
            name: unique(),
            unbounded: Vec::new(),
            moving: Vec::new(),
            forgotten: 0,
            changed: Vec::new(),
        }
    }
}

impl Roster {
    /// Notes that a program was changed by a term, or is gone.
    pub(super) fn note(&mut self, number: u32, serial: Key, program: Option<&Program>) {
        let program = program.filter(|program| program.has_force);
        let unbounded = program.is_some_and(|program| program.reach.is_none());
        let moving = program.is_some_and(|program| program.instances.moving > 0);
        list(&mut self.unbounded, number, unbounded);
        list(&mut self.moving, number, moving);
        if self.changed.len() >= 2 * LONGEST {
            self.changed.drain(..LONGEST);
            self.forgotten += LONGEST as u64;
        }
        self.changed.push((number, serial));
    }

    /// Those that give forces anywhere.
    pub(crate) fn unbounded(&self) -> &[u32] {
        &self.unbounded
    }

    /// Those of which some hang on bodies and colliders.
    pub(crate) fn moving(&self) -> &[u32] {
        &self.moving
    }

    /// Which programs were changed since, and by which terms; `None` if all may have been.
    pub(crate) fn since(&self, followed: Followed) -> Option<&[(u32, Key)]> {
        let known = followed.changes.checked_sub(self.forgotten);
        let known = known.filter(|_| followed.name == self.name)?;
        self.changed.get(known as usize..)
    }

    pub(crate) fn now(&self) -> Followed {
        Followed {
            name: self.name,
            changes: self.forgotten + self.changed.len() as u64,
        }
    }
}

/// Puts a number into a sorted list, or takes it out.
fn list(numbers: &mut Vec<u32>, number: u32, there: bool) {
    match numbers.binary_search(&number) {
        Err(place) if there => numbers.insert(place, number),
        Ok(place) if !there => {
            numbers.remove(place);
        }
        _ => {}
    }
}
