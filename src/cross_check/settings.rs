//! The settings of a cross-check: the pairs that it compares, and the listener that it calls.

use std::collections::HashSet;
use std::fmt;
use std::sync::Arc;

use super::disagreement::Disagreement;
use crate::contact::in_order;
use crate::math::ColliderHandle;

type Listener = dyn Fn(&Disagreement) + Send + Sync;

/// Settings of a [cross-check](crate::FieldsBuilder::cross_check): it compares the contacts of detection fields with
/// those of Rapier's narrow phase at the same poses.
///
/// It costs a detection and a walk over Rapier's contact pairs per step. Rapier then recycles no contacts of the
/// watched colliders, unless [`let_recycle`](Self::let_recycle) is set, so resting bodies differ by roundings from a
/// world without the check. If it is off, which is the default, it costs the test of one option.
///
/// It compares pairs of which at least one collider has a detection field, of any shapes. A contact of Rapier's counts
/// if it overlaps, contact skins included; contacts that Rapier holds ready at a distance (`prediction_distance`) do
/// not. Of several points the deepest counts. Presence, depth, normal and point are each judged against a band derived
/// from rounding ([`CrossCheckReport::band`](crate::cross_check::CrossCheckReport::band)), and for parts without a ball also from
/// the time for which Parry keeps their points. Contacts of one side only that are shallower than the band are counted
/// separately, and so are pairs that cannot be compared ([`NotComparable`](crate::cross_check::NotComparable)). Pairs that
/// `ActiveCollisionTypes` keep from Rapier are disagreements, because fields ignore that setting.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// use rapier3d_fields::cross_check::CrossCheck;
/// let check = CrossCheck::all().on_disagreement(|found| eprintln!("{found:?}"));
/// let fields = Fields::builder(Field::uniform(Vector::X)).cross_check(check).build()?;
/// # Ok::<(), BuildError>(())
/// ```
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Default)]
#[must_use = "setters and operators take the value and return the changed one"]
pub struct CrossCheck {
    pub(crate) on: bool,
    /// Each in the order of its handles; `None` for all pairs.
    pairs: Option<HashSet<[ColliderHandle; 2]>>,
    pub(crate) lets_recycle: bool,
    #[cfg_attr(feature = "serde-serialize", serde(skip))]
    pub(super) listener: Option<Arc<Listener>>,
}

impl CrossCheck {
    /// Watches all pairs that a detection field could find.
    pub fn all() -> Self {
        CrossCheck {
            on: true,
            ..CrossCheck::default()
        }
    }

    /// Watches some pairs of colliders only.
    pub fn pairs(pairs: impl IntoIterator<Item = (ColliderHandle, ColliderHandle)>) -> Self {
        let pairs = pairs.into_iter().map(|(a, b)| in_order([a, b]));
        CrossCheck {
            pairs: Some(pairs.collect()),
            ..CrossCheck::all()
        }
    }

    /// Leaves Rapier's `contact_recycling` as it is. Recycled contacts are up to 0.05 length units out of date, so
    /// contacts that may be recycled are counted as not comparable, and the report says so.
    ///
    /// Otherwise the check keeps the contacts of the watched colliders from being recycled: each gets the bit of
    /// `active_hooks` that filters contact pairs. The user's hooks are called only for the bits that the user has set.
    pub fn let_recycle(mut self) -> Self {
        self.lets_recycle = true;
        self
    }

    /// Calls a function with each disagreement outside its band, as it is found.
    pub fn on_disagreement(
        mut self,
        listener: impl Fn(&Disagreement) + Send + Sync + 'static,
    ) -> Self {
        self.listener = Some(Arc::new(listener));
        self
    }

    /// Returns true if all pairs are compared and contacts are kept from being recycled, as with
    /// `CrossCheck::from(true)`.
    pub fn is_plain(&self) -> bool {
        self.on && self.pairs.is_none() && !self.lets_recycle
    }

    /// Returns true if the cross-check is on.
    pub fn is_on(&self) -> bool {
        self.on
    }

    /// Returns true if a pair, in the order of its handles, is watched.
    pub(super) fn watches(&self, colliders: [ColliderHandle; 2]) -> bool {
        self.pairs
            .as_ref()
            .is_none_or(|pairs| pairs.contains(&colliders))
    }
}

/// `true` compares all pairs, `false` none.
impl From<bool> for CrossCheck {
    fn from(on: bool) -> Self {
        CrossCheck {
            on,
            ..CrossCheck::default()
        }
    }
}

impl fmt::Debug for CrossCheck {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CrossCheck")
            .field("on", &self.on)
            .field("pairs", &self.pairs)
            .field("lets_recycle", &self.lets_recycle)
            .finish_non_exhaustive()
    }
}
