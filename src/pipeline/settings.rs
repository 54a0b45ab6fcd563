//! The settings of the fields of a world.

use crate::bridge::WakePolicy;
use crate::contact::{Detection, Responder, ResponderRules};
use crate::cross_check::CrossCheck;
use crate::field::BuildError;
use crate::integrate::{FaultPolicy, MOST_AUTO, Scheme};
use crate::math::ColliderHandle;

/// The settings of the fields of a world: plain data, which may be changed between steps.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let mut fields = Fields::new(Field::uniform(Vector::X))?;
/// fields.settings.scheme = Scheme::Forward4;
/// fields.settings.detection = Detection::Swept;
/// # Ok::<(), BuildError>(())
/// ```
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[non_exhaustive]
pub struct FieldSettings {
    /// The rule by which wrenches become motion.
    pub scheme: Scheme,
    /// The largest number of substeps that [`Scheme::Auto`] and [`Substeps::PerBody`](crate::Substeps::PerBody) choose
    /// for a body, from 1 to 4096, which is the default; `PerBody` chooses 256 at most. Parts of unequal lengths may be
    /// four times as many, and all attempts together evaluate fields some ten times as often. Where the motion would
    /// need more, the step warns, as `Auto` says.
    pub max_substeps: u32,
    /// The rule by which fields wake sleeping bodies.
    pub wake: WakePolicy,
    /// The treatment of bodies to which fields give a force that is not finite, or too large.
    pub on_fault: FaultPolicy,
    /// The time at which fields detect contacts.
    pub detection: Detection,
    /// The largest work of [swept detection](Detection::Swept) in a step: this number of looks at the gap between two
    /// colliders for each collider, and for twenty more; 5,000 by default. A look at a shape made of pieces, such as a
    /// mesh, counts as 16, an impact as four; the first prediction of a step does not count. Beyond that, bodies stay
    /// where they touch, and the step [warns](crate::StepWarning::SweptWork).
    pub swept_work: u32,
    /// The contacts of fields that are compared with Rapier's.
    pub cross_check: CrossCheck,
    /// True to audit the energy in each step; see [`Fields::audit`](crate::Fields::audit).
    pub audit: bool,
    pub(crate) rules: ResponderRules,
}

impl Default for FieldSettings {
    fn default() -> Self {
        FieldSettings {
            scheme: Scheme::default(),
            max_substeps: MOST_AUTO,
            wake: WakePolicy::default(),
            on_fault: FaultPolicy::default(),
            detection: Detection::default(),
            swept_work: 5_000,
            cross_check: CrossCheck::default(),
            audit: false,
            rules: ResponderRules::default(),
        }
    }
}

impl FieldSettings {
    /// An error if a setting is out of its range.
    pub(crate) fn validate(&self) -> Result<(), BuildError> {
        self.scheme.validate()?;
        let bad = |quantity, requirement, value| BuildError::Parameter {
            field: "the settings".into(),
            quantity,
            requirement,
            value: f64::from(value),
        };
        if !(1..=MOST_AUTO).contains(&self.max_substeps) {
            let quantity = "the largest number of substeps";
            return Err(bad(quantity, "from 1 to 4096", self.max_substeps));
        }
        // Without any work, bodies that touch would stay there for ever.
        if self.swept_work == 0 {
            return Err(bad("the work of swept detection", "at least 1", 0));
        }
        self.wake.validate()
    }

    /// The side that answers contacts for which there is no rule by [`FieldSettings::set_responder_among`].
    pub fn responder(&self) -> Responder {
        self.rules.everywhere
    }

    /// Sets the side that answers contacts that fields detect.
    pub fn set_responder(&mut self, responder: Responder) {
        self.rules.everywhere = responder;
    }

    /// Sets the side that answers contacts between any two of these colliders. Of several such rules, the last one that
    /// fits a pair counts.
    pub fn set_responder_among(
        &mut self,
        colliders: impl IntoIterator<Item = ColliderHandle>,
        responder: Responder,
    ) {
        let set = colliders.into_iter().collect();
        self.rules.among.push((set, responder));
    }

    /// The rules so far: sets of colliders, each with the side that answers contacts between any two of the set.
    pub fn responders_among(
        &self,
    ) -> impl Iterator<Item = (impl Iterator<Item = ColliderHandle>, Responder)> {
        let among = self.rules.among.iter();
        among.map(|(set, responder)| (set.iter().copied(), *responder))
    }
}
