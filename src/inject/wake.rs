//! Which sleeping bodies fields may move.

use super::scheme::WakePolicy;
use crate::math::{RigidBodyHandle, to_dvec3, to_f64};
use crate::rapier::data::Coarena;
use crate::rapier::dynamics::RigidBody;
use crate::rigid::Wrench;

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
                let change = Wrench {
                    force: wrench.force - resting.force,
                    torque: wrench.torque - resting.torque,
                };
                let larger = size(body, wrench).max(size(body, resting));
                size(body, change) > to_f64(fraction) * larger
            }
        }
    }

    /// All sleepers that are known, with what they rest under.
    #[cfg(feature = "serde-serialize")]
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

/// How much a wrench moves a body: the root of twice the energy that a unit of time of it gives the
/// body at rest. It makes force and torque comparable, so that a torque of mere rounding is none.
fn size(body: &RigidBody, wrench: Wrench) -> f64 {
    let properties = body.mass_properties();
    let (force, torque) = (to_dvec3(wrench.force), to_dvec3(wrench.torque));
    let twist = to_dvec3(properties.effective_world_inv_inertia * wrench.torque);
    let linear = (force * force).dot(to_dvec3(properties.effective_inv_mass));
    (linear + torque.dot(twist)).sqrt()
}
