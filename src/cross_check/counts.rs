//! The counts of a cross-check.

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
    /// Rapier's contact does not fit the poses at which the fields looked: a body was moved while
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

/// Touches that swept detection found within steps, by what Parry says of the gap between the parts where
/// they were then.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TouchCounts {
    /// Touches of which gap, normal, point and ways hold to their bands.
    pub agreed: u64,
    /// Touches of which one at least does not.
    pub disagreed: u64,
    /// Touches that cannot be judged.
    pub not_comparable: TouchesNotComparable,
    /// Touches of parts that would not have overlapped at the end of the step, had they gone on:
    /// detection that samples steps at their ends misses these.
    pub missed_by_sampling: u64,
    /// Largest gap, or overlap, at the time of a touch.
    pub gap_error: Real,
    /// Largest angle between a normal and the true one nearest to it, in radians.
    pub normal_error: Real,
    /// Largest distance of a point of contact from a surface.
    pub point_error: Real,
    /// Largest distance between where a way begins or ends and where the body was.
    pub way_error: Real,
    /// The largest of these in units of its band: above one is a disagreement.
    pub worst: Real,
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
        self.gap_error = self.gap_error.max(other.gap_error);
        self.normal_error = self.normal_error.max(other.normal_error);
        self.point_error = self.point_error.max(other.point_error);
        self.way_error = self.way_error.max(other.way_error);
        self.worst = self.worst.max(other.worst);
    }
}

/// Touches that cannot be judged, by the first reason that holds.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct TouchesNotComparable {
    /// A collider was removed while the step was open.
    pub removed: u64,
    /// The parts have overlapped since the step, or their ways after an impact, began.
    pub overlapping: u64,
    /// Parry does not know how far such shapes are apart.
    pub no_distance: u64,
}

impl TouchesNotComparable {
    /// All of them.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.reasons().iter().map(|(_, count)| count).sum()
    }

    /// Each reason, in words, with its count.
    #[must_use]
    pub fn reasons(&self) -> [(&'static str, u64); 3] {
        [
            ("removed meanwhile", self.removed),
            ("overlapping", self.overlapping),
            ("no distance", self.no_distance),
        ]
    }

    fn add(&mut self, other: TouchesNotComparable) {
        self.removed += other.removed;
        self.overlapping += other.overlapping;
        self.no_distance += other.no_distance;
    }
}
