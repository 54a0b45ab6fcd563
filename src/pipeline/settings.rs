//! How fields act.

use crate::bridge::WakePolicy;
use crate::contact::{Detection, Responder, Rules};
use crate::cross_check::CrossCheck;
use crate::integrate::{FaultPolicy, Scheme};
use crate::math::ColliderHandle;

/// How fields act: plain data, which may be changed between steps.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let mut fields = Fields::new(Field::uniform(Vector::X))?;
/// fields.settings.scheme = Scheme::Suzuki4;
/// fields.settings.detection = Detection::Swept;
/// # Ok::<(), BuildError>(())
/// ```
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[non_exhaustive]
pub struct FieldSettings {
    /// How wrenches become motion.
    pub scheme: Scheme,
    /// When fields wake sleeping bodies.
    pub wake: WakePolicy,
    /// What is done about a body to which fields give a force that is not finite, or too large.
    pub on_fault: FaultPolicy,
    /// When fields look for contacts.
    pub detection: Detection,
    /// Which contacts of fields are compared with Rapier's.
    pub cross_check: CrossCheck,
    /// Whether account of the energy is kept in every step; see
    /// [`Fields::audit`](crate::Fields::audit).
    pub audit: bool,
    pub(crate) rules: Rules,
}

impl FieldSettings {
    /// Who answers contacts that no rule of [`FieldSettings::set_responder_among`] is for.
    pub fn responder(&self) -> Responder {
        self.rules.everywhere
    }

    /// Sets who answers contacts that fields detect.
    pub fn set_responder(&mut self, responder: Responder) {
        self.rules.everywhere = responder;
    }

    /// Sets who answers contacts between any two of some colliders (of a pair, or of a group). The
    /// last such rule that fits a pair counts.
    pub fn set_responder_among(
        &mut self,
        colliders: impl IntoIterator<Item = ColliderHandle>,
        responder: Responder,
    ) {
        let set = colliders.into_iter().collect();
        self.rules.among.push((set, responder));
    }

    /// The rules so far: sets of colliders, and who answers contacts between any two of a set.
    pub fn responders_among(
        &self,
    ) -> impl Iterator<Item = (impl Iterator<Item = ColliderHandle>, Responder)> {
        let among = self.rules.among.iter();
        among.map(|(set, responder)| (set.iter().copied(), *responder))
    }
}
