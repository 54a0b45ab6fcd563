//! The counts of a cross-check, public as part of its report.

use crate::math::Real;

/// Contacts of which at least one side found an overlap, by the result of the comparison.
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ContactCounts {
    /// Found by both sides.
    pub both: u64,
    /// Found by the fields only.
    pub only_field: u64,
    /// Found by Rapier only.
    pub only_rapier: u64,
    /// Found by one side only, with a depth within rounding.
    pub within_band: u64,
    /// Found by both, with depths that differ by more than the band.
    pub depth: u64,
    /// Found by both, with normals that differ by more than the band.
    pub normal: u64,
    /// Found by both, at points whose distance exceeds the band.
    pub point: u64,
    /// Found by both, with an overlap as deep in another direction. Their depths are compared; their normals and points
    /// are not, because several are right.
    pub ambiguous: u64,
    /// Contacts that cannot be compared; they count for neither side.
    pub not_comparable: NotComparable,
}

impl ContactCounts {
    /// The number of disagreements outside the band. A contact whose depth and normal both differ counts twice.
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
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct NotComparable {
    /// A collider, or its body, was removed while the step was open.
    pub removed: u64,
    /// Rapier updated contacts more than once in the step (`max_ccd_substeps` above 1), at poses within it.
    pub ccd_substeps: u64,
    /// Rapier may have reused the contact of an earlier step, because of
    /// [`let_recycle`](crate::cross_check::CrossCheck::let_recycle).
    pub recycled: u64,
    /// No movable body of the pair was awake: Rapier keeps the contacts from before they fell asleep.
    pub asleep: u64,
    /// Rapier's contact does not fit the poses at which the fields detected: a body was moved while the step was open.
    pub moved: u64,
    /// The user's hooks hid the pair from Rapier.
    pub hidden: u64,
    /// A joint, or the multibody of both bodies, disables their contacts in Rapier.
    pub jointed: u64,
    /// The field acts in a part of space only, which may not contain the contact.
    pub masked: u64,
    /// Neither body is dynamic, so fields do not detect.
    pub immovable: u64,
    /// A side is a soft body, whose surface fields do not detect.
    pub soft: u64,
    /// A side is a sensor: Rapier reports its overlap without a contact, and fields report nothing.
    pub sensor: u64,
}

impl NotComparable {
    /// The sum of all reasons.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.reasons().iter().map(|(_, count)| count).sum()
    }

    /// Each reason with its count.
    #[must_use]
    pub fn reasons(&self) -> [(&'static str, u64); 11] {
        let mut counts = *self;
        REASONS.map(|(name, counter)| (name, *counter(&mut counts)))
    }

    fn add(&mut self, mut other: NotComparable) {
        for (_, counter) in REASONS {
            *counter(self) += *counter(&mut other);
        }
    }
}

/// The counter of a reason in [`NotComparable`].
pub(super) type Reason = fn(&mut NotComparable) -> &mut u64;

/// The name of each reason, and its counter.
const REASONS: [(&str, Reason); 11] = [
    ("removed meanwhile", |it| &mut it.removed),
    ("several passes of continuous detection", |it| {
        &mut it.ccd_substeps
    }),
    ("recycled", |it| &mut it.recycled),
    ("asleep", |it| &mut it.asleep),
    ("moved meanwhile", |it| &mut it.moved),
    ("hidden by hooks", |it| &mut it.hidden),
    ("jointed", |it| &mut it.jointed),
    ("field masked", |it| &mut it.masked),
    ("immovable", |it| &mut it.immovable),
    ("soft", |it| &mut it.soft),
    ("sensor", |it| &mut it.sensor),
];

/// Touches that swept detection found within steps, judged by Parry's distance between the parts at their poses at that
/// time.
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TouchCounts {
    /// Touches whose gap, normal, point and paths are within their bands.
    pub agreed: u64,
    /// Touches of which at least one of these is not.
    pub disagreed: u64,
    /// Touches that cannot be judged.
    pub not_comparable: TouchesNotComparable,
    /// Touches of parts that, without an answer, would not have overlapped at the end of the step: detection that
    /// samples only the ends of steps misses these.
    pub missed_by_sampling: u64,
    /// Largest gap or overlap at the time of a touch.
    pub gap_error: Real,
    /// Largest angle between a normal and the nearest true one, in radians.
    pub normal_error: Real,
    /// Largest distance of a point of contact from a surface.
    pub point_error: Real,
    /// Largest distance between the beginning or end of a path and the place of the body at that time.
    pub way_error: Real,
    /// The largest of these errors divided by its band: above one is a disagreement.
    pub worst: Real,
}

impl TouchCounts {
    /// The number of touches.
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
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct TouchesNotComparable {
    /// A collider was removed while the step was open.
    pub removed: u64,
    /// The parts have overlapped since the step began, or since their paths after an impact began.
    pub overlapping: u64,
    /// Parry has no distance between such shapes.
    pub no_distance: u64,
}

impl TouchesNotComparable {
    /// The sum of all reasons.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.reasons().iter().map(|(_, count)| count).sum()
    }

    /// Each reason with its count.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Different numbers in all counts, times a factor.
    fn contacts(factor: u64) -> ContactCounts {
        let mut not_comparable = NotComparable::default();
        for (number, (_, counter)) in REASONS.iter().enumerate() {
            *counter(&mut not_comparable) = factor * (number as u64 + 10);
        }
        ContactCounts {
            both: factor,
            only_field: 2 * factor,
            only_rapier: 3 * factor,
            within_band: 4 * factor,
            depth: 5 * factor,
            normal: 6 * factor,
            point: 7 * factor,
            ambiguous: 8 * factor,
            not_comparable,
        }
    }

    fn touches(factor: u64, errors: [Real; 5]) -> TouchCounts {
        let [gap_error, normal_error, point_error, way_error, worst] = errors;
        TouchCounts {
            agreed: factor,
            disagreed: 2 * factor,
            not_comparable: TouchesNotComparable {
                removed: 3 * factor,
                overlapping: 4 * factor,
                no_distance: 5 * factor,
            },
            missed_by_sampling: 6 * factor,
            gap_error,
            normal_error,
            point_error,
            way_error,
            worst,
        }
    }

    #[test]
    fn counts_add_up_and_the_largest_errors_stay() {
        let mut sum = contacts(1);
        sum.add(contacts(3));
        assert_eq!(sum, contacts(4));
        assert_eq!(sum.disagreed(), 4 * (2 + 3 + 5 + 6 + 7));
        assert_eq!(sum.not_comparable.total(), 4 * (10..=20).sum::<u64>());
        let mut sum = touches(1, [1.0, 5.0, 2.0, 6.0, 3.0]);
        sum.add(touches(2, [4.0, 2.0, 5.0, 3.0, 6.0]));
        assert_eq!(sum, touches(3, [4.0, 5.0, 5.0, 6.0, 6.0]));
        assert_eq!(sum.total(), 3 * (1 + 2 + 3 + 4 + 5));
    }
}
