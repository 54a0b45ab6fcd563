//! The walk over the bodies that a step samples.

use std::iter::Peekable;
use std::slice;

use crate::math::{RigidBodyHandle, RigidBodySet};
use crate::rapier::dynamics::{IslandManager, RigidBody};
use crate::rigid::{Body, find_by};

/// Sleepers are skipped only if inactive bodies outnumber the active ones by more than this. A body that the user woke
/// since the last step is not yet active for Rapier: a walk over all bodies finds it, but after a walk over the active
/// ones only [`Reader::late`] does, once Rapier has stepped.
const FEW: usize = 256;

/// Finds the bodies that a step samples; its buffers are reused.
#[derive(Debug, Default)]
pub(crate) struct Reader {
    /// Rapier's active bodies, in its order.
    active: Vec<RigidBodyHandle>,
    /// The same, and [`Wanted::besides`], in the order of their handles.
    sorted: Vec<RigidBodyHandle>,
    /// True if the last walk was over the active bodies.
    skips: bool,
}

/// The choice of bodies for a walk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted<'a> {
    /// True if sleepers are included.
    pub sleepers: bool,
    /// True if bodies may have been added or removed since the last walk.
    pub all: bool,
    /// Sleepers that are included in any case, in the order of their handles.
    pub besides: &'a [Body],
}

/// A walk over bodies, in the order of their handles. It borrows nothing from the set, so each body can be written to
/// before the next one is fetched.
#[derive(Debug)]
pub(crate) struct Walk<'a> {
    handles: Handles<'a>,
    sleepers: bool,
    besides: Peekable<slice::Iter<'a, Body>>,
}

#[derive(Debug)]
enum Handles<'a> {
    /// All bodies from an index on; `left` is the number that remains.
    From {
        index: u32,
        left: usize,
    },
    These(slice::Iter<'a, RigidBodyHandle>),
}

impl Reader {
    /// A walk over all awake bodies that fields can move, and the sleepers that `wanted` includes.
    pub(crate) fn walk<'a>(
        &'a mut self,
        bodies: &RigidBodySet,
        islands: &IslandManager,
        wanted: Wanted<'a>,
    ) -> Walk<'a> {
        self.skips = !wanted.sleepers && !wanted.all && most_sleep(bodies, islands);
        let handles = if !self.skips {
            let (index, left) = (0, bodies.len());
            Handles::From { index, left }
        } else {
            self.sort(islands, wanted.besides);
            Handles::These(self.sorted.iter())
        };
        Walk {
            handles,
            sleepers: wanted.sleepers,
            besides: wanted.besides.iter().peekable(),
        }
    }

    /// If the last walk skipped sleepers: the bodies that have become active since, in the order of their handles.
    pub(crate) fn late(&self, islands: &IslandManager) -> Vec<RigidBodyHandle> {
        if !self.skips || self.knows(islands) {
            return Vec::new();
        }
        let is_new =
            |body: &RigidBodyHandle| find_by(&self.sorted, *body, |known| *known).is_none();
        let mut late: Vec<_> = islands.active_bodies().filter(is_new).collect();
        late.sort_unstable_by_key(|body| body.into_raw_parts().0);
        late
    }

    /// Returns true if the active bodies are those of the last walk.
    fn knows(&self, islands: &IslandManager) -> bool {
        self.active.len() == islands.num_active_bodies()
            && self.active.iter().copied().eq(islands.active_bodies())
    }

    /// Sorts the active bodies by their handles, unless nothing has changed.
    fn sort(&mut self, islands: &IslandManager, besides: &[Body]) {
        let unchanged = self.knows(islands);
        if !unchanged || self.sorted.len() != self.active.len() || !besides.is_empty() {
            self.active.clear();
            self.active.extend(islands.active_bodies());
            self.sorted.clone_from(&self.active);
            self.sorted.extend(besides.iter().map(|body| body.handle));
            self.sorted
                .sort_unstable_by_key(|handle| handle.into_raw_parts().0);
            self.sorted.dedup();
        }
    }
}

impl Walk<'_> {
    /// The next body, or `None` at the end.
    #[inline(always)]
    pub(crate) fn next<'b>(
        &mut self,
        bodies: &'b RigidBodySet,
    ) -> Option<(RigidBodyHandle, &'b RigidBody)> {
        loop {
            let found = match &mut self.handles {
                Handles::These(handles) => {
                    let handle = *handles.next()?;
                    bodies.get(handle).map(|body| (handle, body))
                }
                Handles::From { left: 0, .. } => return None,
                Handles::From { index, left } => {
                    let found = bodies.get_unknown_gen(*index);
                    *index += 1;
                    *left -= usize::from(found.is_some());
                    found.map(|(body, handle)| (handle, body))
                }
            };
            if let Some((handle, body)) = found
                && self.is_wanted(handle, body)
            {
                return Some((handle, body));
            }
        }
    }

    #[inline]
    fn is_wanted(&mut self, handle: RigidBodyHandle, body: &RigidBody) -> bool {
        if !is_movable(body) {
            return false;
        }
        if self.sleepers || !body.is_sleeping() {
            return true;
        }
        let index = handle.into_raw_parts().0;
        let is_before = |it: &&Body| it.handle.into_raw_parts().0 < index;
        while self.besides.next_if(is_before).is_some() {}
        self.besides.peek().is_some_and(|it| it.handle == handle)
    }
}

/// Returns true if enough bodies are inactive that a walk over the active ones is quicker.
pub(crate) fn most_sleep(bodies: &RigidBodySet, islands: &IslandManager) -> bool {
    are_few(islands.num_active_bodies(), bodies)
}

/// Returns true if looking up this number of bodies is quicker than a walk over all of them.
pub(crate) fn are_few(count: usize, bodies: &RigidBodySet) -> bool {
    bodies.len() > 2 * count + FEW
}

/// Returns true if fields can move a body: dynamic, enabled, and not the frame of a soft body.
#[inline]
pub(crate) fn is_movable(body: &RigidBody) -> bool {
    body.is_dynamic() && body.is_enabled() && !body.is_soft_frame()
}
