//! The colliders that were given hook bits, with the bits to restore.

use crate::math::ColliderHandle;
use crate::rapier::pipeline::ActiveHooks;

/// A collider that was given hook bits.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
struct HookedCollider {
    collider: ColliderHandle,
    /// The hook bits that the user had set on it.
    own: ActiveHooks,
    /// True if it needs no hook any more. It keeps the bits for one more step, because Rapier would otherwise reuse
    /// contacts that were lifted off in the last one.
    leaving: bool,
}

/// The colliders that were given hook bits, in the order of their handles.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct HookedColliders(Vec<HookedCollider>);

impl HookedColliders {
    fn place(&self, collider: ColliderHandle) -> Result<usize, usize> {
        let key = collider.into_raw_parts();
        let of = |hooked: &HookedCollider| hooked.collider.into_raw_parts();
        // The entries are usually consecutive indices, so the place is guessed before it is searched.
        let first = self.0.first().map_or(0, |hooked| of(hooked).0);
        let guess = key.0.wrapping_sub(first) as usize;
        if self.0.get(guess).map(of) == Some(key) {
            return Ok(guess);
        }
        self.0.binary_search_by_key(&key, of)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn own(&self, collider: ColliderHandle) -> Option<ActiveHooks> {
        Some(self.0[self.place(collider).ok()?].own)
    }

    /// Records that a collider was given hook bits, and the bits it had before.
    pub(crate) fn add(&mut self, collider: ColliderHandle, own: ActiveHooks) {
        let hooked = HookedCollider {
            collider,
            own,
            leaving: false,
        };
        match self.place(collider) {
            // The recorded bits stay those from before the fields were added, unless the user has set them anew.
            Ok(place) => self.0[place].leaving = false,
            Err(place) => self.0.insert(place, hooked),
        }
    }

    /// Keeps the bits of all colliders for one more step, because Rapier made no step since they were marked as
    /// leaving.
    pub(crate) fn stay(&mut self) {
        self.0.iter_mut().for_each(|hooked| hooked.leaving = false);
    }

    /// Removes the colliders that have needed no hook for two calls in a row, and returns them with the bits to
    /// restore.
    pub(crate) fn release(
        &mut self,
        wanted: impl Fn(ColliderHandle) -> ActiveHooks,
    ) -> Vec<(ColliderHandle, ActiveHooks)> {
        let mut free = Vec::new();
        self.0.retain_mut(|hooked| {
            let left = std::mem::replace(&mut hooked.leaving, wanted(hooked.collider).is_empty());
            let go = left && hooked.leaving;
            if go {
                free.push((hooked.collider, hooked.own));
            }
            !go
        });
        free
    }

    /// Returns true if [`Self::release`] would change anything.
    pub(crate) fn any_free(&self, wanted: impl Fn(ColliderHandle) -> ActiveHooks) -> bool {
        let free = |hooked: &HookedCollider| hooked.leaving || wanted(hooked.collider).is_empty();
        self.0.iter().any(free)
    }
}
