//! Which sleeping bodies fields may move.

use super::scheme::WakePolicy;
use crate::eval::Wrench;
use crate::math::{RigidBodyHandle, Vector};
use crate::rapier::data::Coarena;
use crate::rapier::dynamics::RigidBody;

/// What acted on bodies when they fell asleep.
#[derive(Default)]
pub(super) struct Sleepers {
    resting: Coarena<Option<Wrench>>,
    any: bool,
}

impl Sleepers {
    /// Whether a wrench acts on a body: always while it is awake, and on a sleeper if the policy
    /// wants it woken. A kick stored in a sleeper would fire when it wakes for another reason.
    pub(super) fn acts(
        &mut self,
        handle: RigidBodyHandle,
        body: &RigidBody,
        wrench: Wrench,
        policy: WakePolicy,
    ) -> bool {
        if !body.is_sleeping() {
            if self.any {
                self.resting.insert(handle.0, None);
            }
            return true;
        }
        match policy {
            WakePolicy::Never => false,
            WakePolicy::Always => wrench != Wrench::ZERO,
            WakePolicy::OnChange { fraction } => {
                let resting = self.resting_under(handle, wrench);
                let changed = |is: Vector, was: Vector| {
                    (is - was).length() > fraction * is.length().max(was.length())
                };
                changed(wrench.force, resting.force) || changed(wrench.torque, resting.torque)
            }
        }
    }

    /// All sleepers that are known, with what they rest under.
    #[cfg(feature = "serde")]
    pub(super) fn iter(&self) -> impl Iterator<Item = (RigidBodyHandle, Wrench)> + '_ {
        let known = self.resting.iter();
        known.filter_map(|(index, wrench)| Some((RigidBodyHandle(index), (*wrench)?)))
    }

    /// What a sleeper rests under: `wrench`, if it was not seen asleep before.
    pub(super) fn resting_under(&mut self, handle: RigidBodyHandle, wrench: Wrench) -> Wrench {
        if let Some(Some(resting)) = self.resting.get(handle.0) {
            return *resting;
        }
        self.resting.insert(handle.0, Some(wrench));
        self.any = true;
        wrench
    }
}
