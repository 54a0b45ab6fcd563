//! The comparison of the two sides of one pair.

#[cfg(test)]
mod mutants;

use super::bands::Bands;
use super::disagreement::Difference;
use super::sighting::{RapierPoint, angle};
use crate::contact::FieldContact;
use crate::math::{Pose, Real, Vector};
use crate::rapier::geometry::Collider;

/// The result of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Verdict {
    pub found: FoundBy,
    /// The differences that exceed their bands, each with its band.
    pub differences: Vec<(Difference, Real)>,
    /// The differences of depth, normal and point; `None` for those that were not judged.
    pub errors: [Option<Real>; 3],
    /// The largest of these differences divided by its band.
    pub worst: Real,
}

/// The sides that found an overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FoundBy {
    Neither,
    /// Found by one side only, with a depth within rounding.
    WithinBand,
    OnlyField,
    OnlyRapier,
    Both,
    /// Found by both, at a contact for which another normal is valid as well.
    Ambiguous,
}

/// The two colliders of a pair at the poses compared.
#[derive(Clone, Copy)]
pub(super) struct Placed<'a> {
    pub colliders: [&'a Collider; 2],
    pub poses: [Pose; 2],
}

impl Verdict {
    fn new(found: FoundBy) -> Self {
        Verdict {
            found,
            differences: Vec::new(),
            errors: [None; 3],
            worst: 0.0,
        }
    }

    fn one_sided(difference: Difference, depth: Real, other: Real, band: Real) -> Self {
        // A gap that the other side found is part of the difference.
        if depth - other.min(0.0) <= band {
            return Verdict::new(FoundBy::WithinBand);
        }
        let found = match difference {
            Difference::OnlyField { .. } => FoundBy::OnlyField,
            _ => FoundBy::OnlyRapier,
        };
        Verdict {
            differences: vec![(difference, band)],
            ..Verdict::new(found)
        }
    }

    /// Records an error, and a difference if it exceeds its band.
    fn judge(&mut self, which: usize, error: Real, band: Real, difference: Difference) {
        self.errors[which] = Some(error);
        self.worst = self.worst.max(error / band);
        if error > band || error.is_nan() {
            self.differences.push((difference, band));
        }
    }
}

/// Compares the fields' contact, if they found one, with the contact points that Rapier holds.
pub(super) fn judge(
    our: Option<&FieldContact>,
    spots: &[RapierPoint],
    bands: &Bands,
    placed: &Placed<'_>,
) -> Verdict {
    let deepest = spots.iter().map(|spot| spot.depth).reduce(Real::max);
    let their = deepest.filter(|depth| *depth > 0.0);
    match (our, their) {
        (None, None) => Verdict::new(FoundBy::Neither),
        (Some(our), None) => {
            // Without a point, Rapier either found the parts far apart or did not test the pair.
            let gap = deepest.unwrap_or(0.0);
            let difference = Difference::OnlyField { depth: our.depth };
            Verdict::one_sided(difference, our.depth, gap, bands.depth)
        }
        (None, Some(depth)) => {
            Verdict::one_sided(Difference::OnlyRapier { depth }, depth, 0.0, bands.depth)
        }
        (Some(our), Some(depth)) => both(our, spots, depth, bands, placed),
    }
}

fn both(
    our: &FieldContact,
    spots: &[RapierPoint],
    depth: Real,
    bands: &Bands,
    placed: &Placed<'_>,
) -> Verdict {
    let mut verdict = Verdict::new(FoundBy::Both);
    let difference = Difference::Depth {
        field: our.depth,
        rapier: depth,
    };
    verdict.judge(0, (our.depth - depth).abs(), bands.depth, difference);
    // Rounding decides which of several points is the deepest.
    let as_deep = |spot: &&RapierPoint| spot.depth >= depth - 2.0 * bands.depth;
    let nearest = |off: &dyn Fn(&RapierPoint) -> Real| {
        let about = spots.iter().filter(as_deep);
        about.min_by(|a, b| off(a).total_cmp(&off(b))).copied()
    };
    let turned = |spot: &RapierPoint| angle(our.world_normal, spot.world_normal);
    let apart = |spot: &RapierPoint| our.world_point.distance(spot.world_point);
    let (Some(by_normal), Some(by_point)) = (nearest(&turned), nearest(&apart)) else {
        return verdict;
    };
    let other_way = turned(&by_normal) > bands.normal;
    // Two different normals may both be valid.
    let either_will_do = |their: Vector| {
        let mut both = [our.world_normal, their].into_iter();
        both.all(|normal| placed.is_as_shallow(normal, depth, bands))
    };
    if !bands.knows_normal() || other_way && either_will_do(by_normal.world_normal) {
        verdict.found = FoundBy::Ambiguous;
        return verdict;
    }
    let difference = Difference::Normal {
        field: our.world_normal,
        rapier: by_normal.world_normal,
    };
    verdict.judge(1, turned(&by_normal), bands.normal, difference);
    let difference = Difference::Point {
        field: our.world_point,
        rapier: by_point.world_point,
    };
    // On an edge or a face any point of the same depth is valid. Rapier keeps points while the parts hardly turn, and
    // may lack one that has become as deep.
    let mut error = apart(&by_point);
    if error > bands.point {
        error = error.min(placed.off_surfaces(our));
    }
    verdict.judge(2, error, bands.point, difference);
    verdict
}

impl Placed<'_> {
    /// The distance of the two ends of the overlap from the surfaces on which they should lie.
    fn off_surfaces(&self, our: &FieldContact) -> Real {
        let off = |which: usize, outward: Vector| {
            let collider = self.colliders[which];
            let above = our.depth * 0.5 - collider.contact_skin();
            let end = our.world_point + outward * above;
            let local = self.poses[which].inverse_transform_point(end);
            let surface = collider.shape().project_local_point(local, false);
            surface.point.distance(local)
        };
        off(0, our.world_normal).max(off(1, -our.world_normal))
    }

    /// Returns true if the overlap along a direction is no deeper than `depth`, to the band, so that the direction may
    /// be the normal. It is computed from the farthest points of the shapes, independently of both sides. False for
    /// shapes that are not convex.
    fn is_as_shallow(&self, direction: Vector, depth: Real, bands: &Bands) -> bool {
        let farthest = |which: usize, towards: Vector| {
            let map = self.colliders[which].shape().as_support_map()?;
            // In the frame of the first part, so that rounding is that of the parts' sizes.
            let pose = self.poses[0].inv_mul(&self.poses[which]);
            let towards = self.poses[0].rotation.inverse() * towards;
            let point = map.support_point(&pose, towards);
            Some(point.dot(towards) + self.colliders[which].contact_skin())
        };
        let ends = farthest(0, direction).zip(farthest(1, -direction));
        ends.is_some_and(|(one, two)| one + two <= depth + 2.0 * bands.depth)
    }
}
