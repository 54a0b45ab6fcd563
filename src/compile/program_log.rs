//! A list of programs and of their changes, for caches that keep something for each program.

use super::ordered::{Key, set_member, unique};
use super::program::Program;

/// A follower that is behind by more changes than this may have to start over.
const LONGEST: usize = 4096;

/// The numbers of the programs that have certain properties, and the latest changes of programs.
#[derive(Debug)]
pub(crate) struct ProgramLog {
    /// A number that no other log has.
    name: u64,
    /// Programs with forces of unbounded reach, by number.
    unbounded: Vec<u32>,
    /// Programs with forces and with an instance that is anchored to a body or collider, by number.
    moving: Vec<u32>,
    /// The number of changes that were dropped from the list.
    forgotten: u64,
    /// The number of each changed program, and the term whose instances in it were changed.
    changed: Vec<(u32, Key)>,
}

/// The state of a log up to which a follower has seen its changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Followed {
    name: u64,
    changes: u64,
}

impl Default for ProgramLog {
    fn default() -> Self {
        ProgramLog {
            name: unique(),
            unbounded: Vec::new(),
            moving: Vec::new(),
            forgotten: 0,
            changed: Vec::new(),
        }
    }
}

impl ProgramLog {
    /// Notes that a term has changed a program, or that the program is gone.
    pub(super) fn note(&mut self, number: u32, serial: Key, program: Option<&Program>) {
        let program = program.filter(|program| program.has_force);
        let unbounded = program.is_some_and(|program| program.reach.is_none());
        let moving = program.is_some_and(|program| program.instances.moving > 0);
        set_member(&mut self.unbounded, number, unbounded);
        set_member(&mut self.moving, number, moving);
        if self.changed.len() >= 2 * LONGEST {
            self.changed.drain(..LONGEST);
            self.forgotten += LONGEST as u64;
        }
        self.changed.push((number, serial));
    }

    /// Programs with forces of unbounded reach.
    pub(crate) fn unbounded(&self) -> &[u32] {
        &self.unbounded
    }

    /// Programs with forces and with an instance that is anchored to a body or collider.
    pub(crate) fn moving(&self) -> &[u32] {
        &self.moving
    }

    /// The changes since `followed`, as program and term; `None` if the list does not reach back that far.
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
