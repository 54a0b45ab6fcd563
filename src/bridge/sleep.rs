//! The rule by which fields wake sleeping bodies, and the wrenches under which bodies sleep.

use crate::field::BuildError;
use crate::math::{Real, RigidBodyHandle, Vector, to_dvec3, to_f64};
use crate::rigid::{Body, Wrench, find_next, is_in_order};

/// The rule by which fields wake sleeping bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum WakePolicy {
    /// Never: sleeping bodies are not even sampled.
    Never,
    /// When the wrench on a sleeping body has changed, since it fell asleep or was first seen
    /// asleep, by more than this fraction of the larger of the two; and, unless it was zero, by more
    /// than a thousandth, or the fraction if that is less, of the body's weight with the user's force.
    /// Force and torque are measured together, by how much they move the body. All sleepers are
    /// looked at when a field changed, was moved between steps, or depends on time; those that a
    /// field on an awake body may reach, in every step.
    OnChange {
        /// The fraction.
        fraction: Real,
    },
    /// Whenever the wrench is not zero: bodies in fields never sleep.
    Always,
}

/// The share of its weight by which the wrench on a sleeper may always change: far less than what friction holds.
const WEIGHT_SHARE: f64 = 1e-3;

impl Default for WakePolicy {
    fn default() -> Self {
        WakePolicy::OnChange { fraction: 1e-3 }
    }
}

impl WakePolicy {
    /// Returns an error if the fraction is negative or NaN.
    pub(crate) fn validate(self) -> Result<(), BuildError> {
        match self {
            WakePolicy::OnChange { fraction } if fraction.is_nan() || fraction < 0.0 => {
                Err(BuildError::Parameter {
                    field: "the wake policy".into(),
                    quantity: "the fraction",
                    requirement: "zero or more",
                    value: to_f64(fraction),
                })
            }
            _ => Ok(()),
        }
    }
}

/// A policy, with the gravity in which it applies.
#[derive(Clone, Copy)]
pub(crate) struct WakeRule {
    pub policy: WakePolicy,
    pub gravity: Vector,
}

/// The wrenches that acted on bodies when they fell asleep, in the order of their handles.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Resting(Vec<(RigidBodyHandle, Wrench)>);

impl Resting {
    /// Sets `acting`, by body: false for sleepers that stay asleep. A kick stored in a sleeper would take effect when
    /// it wakes for another reason. `acting` stays empty if nothing sleeps.
    pub(crate) fn decide(
        &mut self,
        bodies: &[Body],
        wrenches: &[Wrench],
        rule: WakeRule,
        decisions: &mut Vec<bool>,
    ) {
        decisions.clear();
        if self.0.is_empty() && !bodies.iter().any(|body| body.sleeping) {
            return;
        }
        let awake = bodies.iter().filter(|body| !body.sleeping);
        self.forget(awake.map(|body| body.handle));
        let mut at = 0;
        for (body, wrench) in bodies.iter().zip(wrenches) {
            decisions.push(!body.sleeping || self.wakes(&mut at, body, *wrench, rule));
        }
    }

    /// Returns true if a wrench wakes a sleeper; `at` as for [`Self::resting_under`].
    fn wakes(&mut self, at: &mut usize, body: &Body, wrench: Wrench, rule: WakeRule) -> bool {
        match rule.policy {
            WakePolicy::Never => false,
            WakePolicy::Always => wrench != Wrench::ZERO,
            WakePolicy::OnChange { fraction } => {
                let resting = self.resting_under(at, body.handle, wrench);
                let change = Wrench {
                    force: wrench.force - resting.force,
                    torque: wrench.torque - resting.torque,
                };
                let fraction = to_f64(fraction);
                let mut allowed = fraction * size(body, wrench).max(size(body, resting));
                if resting != Wrench::ZERO {
                    let share = fraction.min(WEIGHT_SHARE);
                    allowed = allowed.max(share * size(body, weight(body, rule.gravity)));
                }
                size(body, change) > allowed
            }
        }
    }

    /// The wrench under which a sleeper rests; recorded as `wrench` if it was not seen asleep before. For calls in the
    /// order of handles; `at` is the position in the list, zero at first.
    pub(crate) fn resting_under(
        &mut self,
        at: &mut usize,
        handle: RigidBodyHandle,
        wrench: Wrench,
    ) -> Wrench {
        if let Some((_, resting)) = find_next(&self.0, at, handle, |it| it.0) {
            return *resting;
        }
        match self.0.get_mut(*at) {
            // Another body had this index.
            Some(other) if index(other.0) == index(handle) => *other = (handle, wrench),
            _ => self.0.insert(*at, (handle, wrench)),
        }
        wrench
    }

    /// Removes bodies that are awake; they are given in the order of their handles.
    pub(crate) fn forget(&mut self, awake: impl Iterator<Item = RigidBodyHandle>) {
        let mut awake = awake.map(index).peekable();
        self.0.retain(|(body, _)| {
            let body = index(*body);
            while awake.next_if(|next| *next < body).is_some() {}
            awake.peek() != Some(&body)
        });
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns true if the list is sorted and finite, which a deserialized one may not be.
    pub(crate) fn is_sound(&self) -> bool {
        is_in_order(&self.0, |(body, _)| *body)
            && self.0.iter().all(|(_, wrench)| wrench.is_finite())
    }
}

fn index(body: RigidBodyHandle) -> u32 {
    body.into_raw_parts().0
}

/// The wrench on a body without fields: its weight, and the user's force and torque.
fn weight(body: &Body, gravity: Vector) -> Wrench {
    Wrench {
        force: gravity * (body.gravity_scale * body.mass) + body.user_force,
        torque: body.user_torque,
    }
}

/// The strength of a wrench on a body: the square root of twice the energy that it gives the body at rest in a unit of
/// time. It makes force and torque comparable, so that a torque of mere rounding counts as none.
fn size(body: &Body, wrench: Wrench) -> f64 {
    let (force, torque) = (to_dvec3(wrench.force), to_dvec3(wrench.torque));
    let twist = to_dvec3(body.inv_inertia * wrench.torque);
    let linear = (force * force).dot(to_dvec3(body.inv_mass));
    (linear + torque.dot(twist)).sqrt()
}
