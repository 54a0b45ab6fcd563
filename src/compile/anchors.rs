//! Numbers for the frames that fields are anchored to. Equal anchors share a number, so that a frame is looked
//! up once in an evaluation.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::ops::Deref;

use super::ordered::set_member;
use crate::field::{Anchor, Fingerprint};
use crate::math::{Pose, to_f64};

/// The number of an anchor in [`Anchors`].
pub(crate) type AnchorId = u32;

/// Stands for the anchor of a modifier that has none.
pub(crate) const NO_ANCHOR: AnchorId = AnchorId::MAX;

/// Anchors are equal if they have the same carrier and the same bits in their pose.
type AnchorKey = (u8, (u32, u32), [u64; 7]);

/// Anchors by number. A number that is not in use has the world's own frame.
#[derive(Debug, Default)]
pub(crate) struct Anchors {
    list: Vec<Anchor>,
    /// The number of uses of each.
    uses: Vec<u32>,
    free: Vec<AnchorId>,
    /// Anchors on bodies and colliders, in order.
    moving: Vec<AnchorId>,
    ids: HashMap<AnchorKey, AnchorId, BuildHasherDefault<Fingerprint>>,
}

impl Anchors {
    /// The number of anchors in use.
    pub(crate) fn count(&self) -> usize {
        self.list.len() - self.free.len()
    }

    /// Anchors on bodies and colliders.
    pub(crate) fn moving(&self) -> impl Iterator<Item = (AnchorId, &Anchor)> {
        let moving = self.moving.iter();
        moving.map(|id| (*id, &self.list[*id as usize]))
    }

    /// Returns true if an anchor stands still in the world.
    pub(crate) fn stands_still(&self, id: AnchorId) -> bool {
        matches!(self.list[id as usize], Anchor::World { .. })
    }

    /// The number of an anchor, a new one if the anchor has none. Adds one use.
    pub(super) fn hold(&mut self, anchor: &Anchor) -> AnchorId {
        let (list, uses, free) = (&mut self.list, &mut self.uses, &mut self.free);
        let id = *self.ids.entry(anchor_key(anchor)).or_insert_with(|| {
            let id = free.pop().unwrap_or(list.len() as AnchorId);
            if id as usize == list.len() {
                list.push(*anchor);
                uses.push(0);
            }
            list[id as usize] = *anchor;
            id
        });
        self.uses[id as usize] += 1;
        if self.uses[id as usize] == 1 && !self.stands_still(id) {
            set_member(&mut self.moving, id, true);
        }
        id
    }

    /// Removes one use of an anchor. Without uses its number is free.
    pub(super) fn release(&mut self, id: AnchorId) {
        let Some(uses) = self.uses.get_mut(id as usize) else {
            return;
        };
        *uses -= 1;
        if *uses == 0 {
            let anchor = std::mem::replace(&mut self.list[id as usize], Anchor::WORLD);
            self.ids.remove(&anchor_key(&anchor));
            set_member(&mut self.moving, id, false);
            self.free.push(id);
        }
    }
}

/// The anchors by number.
impl Deref for Anchors {
    type Target = [Anchor];

    fn deref(&self) -> &[Anchor] {
        &self.list
    }
}

fn anchor_key(anchor: &Anchor) -> AnchorKey {
    let (kind, handle) = match anchor {
        Anchor::World { .. } => (0, (0, 0)),
        Anchor::Body { handle, .. } => (1, handle.into_raw_parts()),
        Anchor::Collider { handle, .. } => (2, handle.into_raw_parts()),
    };
    (kind, handle, pose_bits(anchor.local_pose()))
}

fn pose_bits(pose: &Pose) -> [u64; 7] {
    let (t, r) = (pose.translation, pose.rotation);
    [t.x, t.y, t.z, r.x, r.y, r.z, r.w].map(|x| to_f64(x).to_bits())
}
