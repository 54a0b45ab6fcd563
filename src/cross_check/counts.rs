//! What a cross-check counts.

use crate::math::Real;

/// Contacts of which one side at least saw an overlap, by what came of comparing them.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ContactCounts {
    /// Found by both sides.
    pub both: u64,
    /// Found by the fields only.
    pub only_field: u64,
    /// Found by Rapier only.
    pub only_rapier: u64,
    /// Found by one side only, and too shallow to be told from rounding.
    pub within_band: u64,
    /// Found by both, with depths that differ by more than the band.
    pub depth: u64,
    /// Found by both, with normals that differ by more than the band.
    pub normal: u64,
    /// Found by both, at points that are apart by more than the band.
    pub point: u64,
    /// Found by both, and overlapping as deep in another direction: their depths are compared, and
    /// their normals and points, of which neither side's is the right one, are not.
    pub ambiguous: u64,
    /// Contacts that cannot be compared, which says nothing for either side.
    pub not_comparable: NotComparable,
}

impl ContactCounts {
    /// Disagreements outside the band. A contact of which both depth and normal differ is two.
    #[must_use]
    pub fn disagreed(&self) -> u64 {
        self.only_field + self.only_rapier + self.depth + self.normal + self.point
    }

    pub(super) fn add(&mut self, other: ContactCounts) {
        self.both += other.both;
        self.only_field += other.only_field;
        self.only_rapier += other.only_rapier;
        self.within_band += other.within_band;
        self.depth += other.depth;
        self.normal += other.normal;
        self.point += other.point;
        self.ambiguous += other.ambiguous;
        self.not_comparable.add(other.not_comparable);
    }
}

/// Contacts that cannot be compared, by the first reason that holds.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct NotComparable {
    /// A collider, or its body, was removed while the step was open.
    pub removed: u64,
    /// Rapier looked more than once in the step (`max_ccd_substeps` above 1), at poses within it.
    pub ccd_substeps: u64,
    /// Rapier may have kept the contact of an earlier step, as the check was told to
    /// [let it](crate::CrossCheck::let_recycle).
    pub recycled: u64,
    /// No body that moves was awake: Rapier keeps what it found before they fell asleep.
    pub asleep: u64,
    /// What Rapier holds does not fit the poses at which the fields looked: a body was moved while
    /// the step was open.
    pub moved: u64,
    /// Hooks of the user's own hid the pair from Rapier.
    pub hidden: u64,
    /// A joint, or the multibody of both, keeps Rapier from looking.
    pub jointed: u64,
    /// The field acts in a part of space only, and may not have looked there.
    pub masked: u64,
    /// Neither body can be pushed: fields do not look.
    pub immovable: u64,
    /// A side is a soft body, whose surface fields do not know.
    pub soft: u64,
    /// A side is a sensor: Rapier finds that it overlaps, but no contact, and fields nothing.
    pub sensor: u64,
}

impl NotComparable {
    /// All of them.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.reasons().iter().map(|(_, count)| count).sum()
    }

    /// Each reason, in words, with its count.
    #[must_use]
    pub fn reasons(&self) -> [(&'static str, u64); 11] {
        [
            ("removed meanwhile", self.removed),
            ("several passes of continuous detection", self.ccd_substeps),
            ("recycled", self.recycled),
            ("asleep", self.asleep),
            ("moved meanwhile", self.moved),
            ("hidden by hooks", self.hidden),
            ("jointed", self.jointed),
            ("field masked", self.masked),
            ("immovable", self.immovable),
            ("soft", self.soft),
            ("sensor", self.sensor),
        ]
    }

    fn add(&mut self, other: NotComparable) {
        self.removed += other.removed;
        self.ccd_substeps += other.ccd_substeps;
        self.recycled += other.recycled;
        self.asleep += other.asleep;
        self.moved += other.moved;
        self.hidden += other.hidden;
        self.jointed += other.jointed;
        self.masked += other.masked;
        self.immovable += other.immovable;
        self.soft += other.soft;
        self.sensor += other.sensor;
    }
}

/// Touches that swept detection found within steps, beside Parry's cast of the same shapes along
/// the same ways.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TouchCounts {
    /// Times that agree to the band.
    pub agreed: u64,
    /// Times that differ by more than the band, or touches that the cast does not find.
    pub disagreed: u64,
    /// Touches that the cast cannot tell the time of.
    pub not_comparable: TouchesNotComparable,
    /// Touches of parts that would not have overlapped at the end of the step, had they gone on:
    /// detection that samples steps at their ends misses these.
    pub missed_by_sampling: u64,
    /// Largest difference of times that were judged, as a share of the step.
    pub time_error: Real,
}

impl TouchCounts {
    /// All touches.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.agreed + self.disagreed + self.not_comparable.total()
    }

    pub(super) fn add(&mut self, other: TouchCounts) {
        self.agreed += other.agreed;
        self.disagreed += other.disagreed;
        self.not_comparable.add(other.not_comparable);
        self.missed_by_sampling += other.missed_by_sampling;
        self.time_error = self.time_error.max(other.time_error);
    }
}

/// Touches whose time a cast cannot tell, by the first reason that holds.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct TouchesNotComparable {
    /// The two have touched before in the same step, and begin in touch.
    pub again: u64,
    /// They overlapped, or as good as touched, when the ways began.
    pub overlapping: u64,
    /// A way is bent, by gravity or by fields.
    pub bent: u64,
    /// A body tumbles: its rotation is not steady.
    pub tumbling: u64,
    /// They approach so slowly that rounding decides when, or whether in this step, they touch.
    pub graze: u64,
    /// They touch when the fields say, and Parry's cast has missed it or ended before.
    pub unsettled: u64,
    /// Parry has no cast of such shapes, or none of contact skins.
    pub no_cast: u64,
}

impl TouchesNotComparable {
    /// All of them.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.reasons().iter().map(|(_, count)| count).sum()
    }

    /// Each reason, in words, with its count.
    #[must_use]
    pub fn reasons(&self) -> [(&'static str, u64); 7] {
        [
            ("touched before", self.again),
            ("overlapping", self.overlapping),
            ("bent way", self.bent),
            ("tumbling", self.tumbling),
            ("graze", self.graze),
            ("cast unsettled", self.unsettled),
            ("no cast", self.no_cast),
        ]
    }

    fn add(&mut self, other: TouchesNotComparable) {
        self.again += other.again;
        self.overlapping += other.overlapping;
        self.bent += other.bent;
        self.tumbling += other.tumbling;
        self.graze += other.graze;
        self.unsettled += other.unsettled;
        self.no_cast += other.no_cast;
    }
}
