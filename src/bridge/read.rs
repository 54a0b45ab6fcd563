//! Which bodies a step samples, copied.

use super::world::View;
use crate::math::RigidBodyHandle;
use crate::rapier::dynamics::{IslandManager, RigidBody};
use crate::rigid::{Body, Lookup};

/// Beside as many as are awake, so many sleepers are looked at in any case: bodies that users woke
/// since the last step are not among Rapier's active ones yet.
const FEW: usize = 256;

/// Finds the bodies that a step samples; keeps its buffers.
#[derive(Debug, Default)]
pub(crate) struct Reader {
    /// Rapier's active bodies, in its order, and in that of their handles.
    active: Vec<RigidBodyHandle>,
    sorted: Vec<RigidBodyHandle>,
}

/// Which of the bodies are asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted<'a> {
    /// Whether sleepers are, too.
    pub sleepers: bool,
    /// Whether bodies may have been added or removed.
    pub all: bool,
    /// Sleepers that are in any case, in the order of their handles.
    pub besides: &'a [Body],
}

impl Reader {
    /// Visits all bodies that fields can move and that are awake, in the order of their handles;
    /// with the others that are asked for. Stops where `visit` says so.
    pub(crate) fn visit(
        &mut self,
        view: &View<'_>,
        islands: &IslandManager,
        wanted: Wanted<'_>,
        mut visit: impl FnMut(RigidBodyHandle, &RigidBody) -> bool,
    ) {
        let awake = islands.num_active_bodies();
        let mut besides = wanted.besides.iter().peekable();
        let mut is_wanted = |handle: RigidBodyHandle, body: &RigidBody| {
            if !is_movable(body) {
                return false;
            }
            if wanted.sleepers || !body.is_sleeping() {
                return true;
            }
            let index = handle.into_raw_parts().0;
            while besides
                .next_if(|b| b.handle.into_raw_parts().0 < index)
                .is_some()
            {}
            besides.peek().is_some_and(|b| b.handle == handle)
        };
        if wanted.sleepers || wanted.all || view.body_count() <= 2 * awake + FEW {
            for (handle, body) in view.bodies() {
                if is_wanted(handle, body) && !visit(handle, body) {
                    return;
                }
            }
            return;
        }
        self.sort(islands, wanted.besides);
        for handle in &self.sorted {
            if let Some(body) = view.body(*handle)
                && is_wanted(*handle, body)
                && !visit(*handle, body)
            {
                return;
            }
        }
    }

    /// Brings the active bodies into the order of their handles, unless they still are.
    fn sort(&mut self, islands: &IslandManager, besides: &[Body]) {
        let unchanged = self.active.len() == islands.num_active_bodies()
            && self.active.iter().copied().eq(islands.active_bodies());
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

/// Whether fields can move a body at all.
#[inline]
pub(crate) fn is_movable(body: &RigidBody) -> bool {
    body.is_dynamic() && body.is_enabled() && !body.is_soft_frame()
}
