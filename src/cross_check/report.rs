//! The report of a cross-check, and its table.

use std::fmt;

use super::answers::Answers;
use super::counts::{ContactCounts, TouchCounts};
use super::disagreement::Disagreement;
use crate::math::{Real, Vector};

/// The largest number of roundings of a coordinate between the poses and a gap, for both sides together.
///
/// For the fields: a product of poses at each part (three roundings: rotation of the arm, sum with the place of the
/// body), over both parts six; difference, square, length, sum of the radii and difference with it, eight more. For
/// Rapier: the same six at the parts, and twelve for the frame of one part, in which it works. Together 32.
const ROUNDINGS: Real = 32.0;

/// Counts and errors of a [cross-check](crate::FieldsBuilder::cross_check) since it began. Its `Display` is a table.
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CrossCheckReport {
    /// The number of steps compared.
    pub steps: u64,
    /// Contacts of all steps.
    pub total: ContactCounts,
    /// Contacts of the last step.
    pub last_step: ContactCounts,
    /// Touches within steps, with swept detection.
    pub touches: TouchCounts,
    /// Touches within the last step.
    pub last_touches: TouchCounts,
    /// The impulses by which each side answered.
    pub answers: Answers,
    /// Largest difference of depth.
    pub depth_error: Real,
    /// Largest angle between normals that were judged, in radians.
    pub normal_error: Real,
    /// Largest distance between points of contact that were judged.
    pub point_error: Real,
    /// The largest difference of depth, normal or point, divided by its band: above one is a disagreement.
    pub worst: Real,
    /// True if Rapier was recycling contacts, which are then up to 0.05 length units out of date. Only with
    /// [`let_recycle`](crate::cross_check::CrossCheck::let_recycle).
    pub recycling: bool,
    /// True if Rapier may have made more than one pass of continuous detection (`max_ccd_substeps` above 1): its
    /// contacts then belong to poses within the step.
    pub ccd_substeps: bool,
    /// The disagreements of the last step outside their bands.
    pub disagreements: Vec<Disagreement>,
    /// The first disagreement since the check began.
    pub first: Option<Disagreement>,
    /// Sums of the differences of depth, normal and point.
    pub(super) sums: [f64; 3],
    /// The number of contacts whose normals and points were judged.
    pub(super) judged: u64,
}

impl CrossCheckReport {
    /// The band for depths of parts with a ball: 32 half units in the last place of a length equal to the contact's
    /// distance from the origin plus `size`, the size of the parts together. The size of a part is the distance from
    /// the body's origin to the farthest point of the collider.
    ///
    /// No coordinate between the poses and the depth is larger than that length, and there are 32 roundings.
    #[must_use]
    pub fn band(world_point: Vector, size: Real) -> Real {
        ROUNDINGS * 0.5 * Real::EPSILON * (world_point.length() + size)
    }

    /// The number of disagreements: of contacts, and of touches within steps.
    #[must_use]
    pub fn disagreed(&self) -> u64 {
        self.total.disagreed() + self.touches.disagreed
    }

    /// Mean differences over the contacts that both sides found: of the depth, of the normal (an
    /// angle, in radians) and of the point. Zero if there was none.
    #[must_use]
    pub fn mean_errors(&self) -> [f64; 3] {
        let [depths, normals, points] = self.sums;
        let [all, judged] = [self.total.both, self.judged].map(|count| count.max(1) as f64);
        [depths / all, normals / judged, points / judged]
    }

    fn write_touches(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let touches = &self.touches;
        let missing = &touches.not_comparable;
        let title = "touches within steps, by Parry's distance at their times";
        writeln!(f, "{title}")?;
        write_count(f, "hold", touches.agreed, "")?;
        write_count(f, "do not", touches.disagreed, "")?;
        write_count(f, "not comparable", missing.total(), "")?;
        write_reasons(f, &missing.reasons())?;
        write_count(f, "missed by sampling", touches.missed_by_sampling, "")?;
        let TouchCounts {
            gap_error,
            normal_error,
            point_error,
            way_error,
            worst,
            ..
        } = touches;
        writeln!(
            f,
            "  largest difference    gap {gap_error:.1e}, point {point_error:.1e}, \
             normal {normal_error:.1e} rad, way {way_error:.1e}; {worst:.2} of its band"
        )
    }
}

fn write_count(f: &mut fmt::Formatter<'_>, name: &str, count: u64, remark: &str) -> fmt::Result {
    writeln!(f, "  {name:<22}{count}{remark}")
}

fn write_reasons(f: &mut fmt::Formatter<'_>, reasons: &[(&str, u64)]) -> fmt::Result {
    let mut some = reasons.iter().filter(|(_, count)| *count > 0);
    some.try_for_each(|(reason, count)| writeln!(f, "    {reason:<20}{count}"))
}

impl fmt::Display for CrossCheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let total = &self.total;
        writeln!(f, "fields beside Rapier, same poses, {} steps", self.steps)?;
        write_count(f, "found by both", total.both, "")?;
        write_count(f, "only by the fields", total.only_field, "")?;
        write_count(f, "only by Rapier", total.only_rapier, "")?;
        write_count(f, "other depth", total.depth, "")?;
        write_count(f, "other normal", total.normal, "")?;
        write_count(f, "other point", total.point, "")?;
        let remark = "   (by one side only, too shallow to tell)";
        write_count(f, "within rounding", total.within_band, remark)?;
        let remark = "   (as deep in another direction: only depths compared)";
        write_count(f, "ambiguous", total.ambiguous, remark)?;
        write_count(f, "not comparable", total.not_comparable.total(), "")?;
        write_reasons(f, &total.not_comparable.reasons())?;
        let CrossCheckReport {
            depth_error,
            normal_error,
            point_error,
            worst,
            ..
        } = self;
        writeln!(
            f,
            "  largest difference    depth {depth_error:.1e}, point {point_error:.1e}, \
             normal {normal_error:.1e} rad; {worst:.2} of its band"
        )?;
        if self.touches.total() > 0 {
            self.write_touches(f)?;
        }
        let Answers {
            by_fields,
            by_rapier,
        } = self.answers;
        if by_fields.contacts > 0 && by_rapier.contacts > 0 {
            for (name, answered) in [
                ("answered by fields", by_fields),
                ("answered by Rapier", by_rapier),
            ] {
                let change = answered.velocity_change;
                let remark = format!("   (velocity changed by {change:.3e} in all)");
                write_count(f, name, answered.contacts, &remark)?;
            }
        }
        match &self.first {
            Some(first) => writeln!(f, "  first disagreement    {first}"),
            None => Ok(()),
        }
    }
}
