//! The pairs that a cross-check watches, and the listener that it reports to.

use std::collections::HashSet;
use std::fmt;
use std::sync::Arc;

use super::disagreement::Disagreement;
use crate::math::ColliderHandle;

type Listener = dyn Fn(&Disagreement) + Send + Sync;

/// Settings of a [cross-check](crate::FieldsBuilder::cross_check) between what fields detect and
/// what Rapier's narrow phase finds, at the same poses.
///
/// It costs a detection and a walk over Rapier's contact pairs per step; off, which is the
/// default, nothing but a test of one option.
///
/// Compares pairs of which at least one collider has a detection field, of any shapes.
/// Rapier's contact counts if it overlaps, contact skins included; what it holds ready at a distance
/// (`prediction_distance`) does not. Of several points the deepest counts. Presence, depth, normal
/// and point are each judged against a band derived from rounding
/// ([`CrossCheckReport::band`](crate::CrossCheckReport::band)), and of parts without a ball also from
/// how long Parry keeps their points. What only one side finds, shallower than the band, is counted
/// apart, and so is what cannot be compared ([`NotComparable`](crate::NotComparable)). Pairs that
/// `ActiveCollisionTypes` keep from Rapier are disagreements: fields do not heed these.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// use rapier3d_fields::CrossCheck;
/// let check = CrossCheck::all().on_disagreement(|found| eprintln!("{found:?}"));
/// let fields = Fields::builder(Field::uniform(Vector::X)).cross_check(check).build()?;
/// # Ok::<(), BuildError>(())
/// ```
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Default)]
#[must_use = "setters and operators take the value and return the changed one"]
pub struct CrossCheck {
    pub(crate) on: bool,
    /// In the order of their handles; all if there is no list.
    pairs: Option<HashSet<[ColliderHandle; 2]>>,
    pub(super) lets_recycle: bool,
    #[cfg_attr(feature = "serde-serialize", serde(skip))]
    pub(super) listener: Option<Arc<Listener>>,
}

impl CrossCheck {
    /// Watches every pair that a detection field could find.
    pub fn all() -> Self {
        CrossCheck {
            on: true,
            ..CrossCheck::default()
        }
    }

    /// Watches some pairs of colliders only.
    pub fn pairs(pairs: impl IntoIterator<Item = (ColliderHandle, ColliderHandle)>) -> Self {
        let sorted = |(a, b): (ColliderHandle, ColliderHandle)| {
            let mut pair = [a, b];
            pair.sort_unstable_by_key(|handle| handle.into_raw_parts());
            pair
        };
        CrossCheck {
            pairs: Some(pairs.into_iter().map(sorted).collect()),
            ..CrossCheck::all()
        }
    }

    /// Leaves Rapier's `contact_recycling` as it is. Recycled contacts are up to 0.05 length units
    /// out of date, so contacts that may be are counted as not comparable; the report says so.
    ///
    /// Otherwise the check exempts the colliders it watches, by giving those that have no
    /// `active_hooks` the one that filters contact pairs. Hooks of the user's own will be asked
    /// about them.
    pub fn let_recycle(mut self) -> Self {
        self.lets_recycle = true;
        self
    }

    /// Calls a function with every disagreement outside the band, as it is found.
    pub fn on_disagreement(
        mut self,
        listener: impl Fn(&Disagreement) + Send + Sync + 'static,
    ) -> Self {
        self.listener = Some(Arc::new(listener));
        self
    }

    /// Whether all pairs are compared, and contacts kept fresh, as `true` asks for.
    pub fn is_plain(&self) -> bool {
        self.on && self.pairs.is_none() && !self.lets_recycle
    }

    /// Whether there is a cross-check at all.
    pub fn is_on(&self) -> bool {
        self.on
    }

    pub(crate) fn lets_recycle(&self) -> bool {
        self.lets_recycle
    }

    /// Whether a pair, in the order of its handles, is watched.
    pub(super) fn watches(&self, colliders: [ColliderHandle; 2]) -> bool {
        self.pairs
            .as_ref()
            .is_none_or(|pairs| pairs.contains(&colliders))
    }
}

/// All pairs, or none.
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
