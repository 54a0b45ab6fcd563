//! The frames that fields are anchored to, each once.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::ops::Deref;

use crate::field::{Anchor, Fingerprint};
use crate::math::{Pose, to_f64};

/// Number of an anchor in [`Anchors`].
pub(crate) type AnchorId = u32;

/// In place of the anchor of a modifier that has none.
pub(crate) const NO_ANCHOR: AnchorId = AnchorId::MAX;

/// Anchors are told apart by what they hang on and by the bits of their pose.
type AnchorKey = (u8, (u32, u32), [u64; 7]);

/// Anchors by number. A number that is not in use stands for the world's own frame.
#[derive(Debug, Default)]
pub(crate) struct Anchors {
    list: Vec<Anchor>,
    /// How often each is used.
    uses: Vec<u32>,
    free: Vec<AnchorId>,
    /// Those on bodies and colliders, in order.
    moving: Vec<AnchorId>,
    ids: HashMap<AnchorKey, AnchorId, BuildHasherDefault<Fingerprint>>,
}

impl Anchors {
    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.list.len() - self.free.len()
    }

    /// Those on bodies and colliders.
    pub(crate) fn moving(&self) -> impl Iterator<Item = (AnchorId, &Anchor)> {
        let moving = self.moving.iter();
        moving.map(|id| (*id, &self.list[*id as usize]))
    }

    /// Whether an anchor stands still.
    pub(crate) fn stands_still(&self, id: AnchorId) -> bool {
        matches!(self.list[id as usize], Anchor::World { .. })
    }

    /// The number of an anchor that is used once more.
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
        if self.uses[id as usize] == 1
            && !self.stands_still(id)
            && let Err(place) = self.moving.binary_search(&id)
        {
            self.moving.insert(place, id);
        }
        id
    }

    /// Uses an anchor once less.
    pub(super) fn release(&mut self, id: AnchorId) {
        let Some(uses) = self.uses.get_mut(id as usize) else {
            return;
        };
        *uses -= 1;
        if *uses == 0 {
            let anchor = std::mem::replace(&mut self.list[id as usize], Anchor::WORLD);
            self.ids.remove(&anchor_key(&anchor));
            if let Ok(place) = self.moving.binary_search(&id) {
                self.moving.remove(place);
            }
            self.free.push(id);
        }
    }
}

/// By number.
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
