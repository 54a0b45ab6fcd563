//! The differences that rounding and kept manifolds allow between the two sides of a contact.
//!
//! **Parts with a ball** are computed anew by both sides in each step, so the two differ by rounding only:
//! [`CrossCheckReport::band`] for lengths, and that divided by the length of the line that gives the normal for angles.
//!
//! **Other parts** have manifolds, of which Parry keeps the points while the parts have turned by less than 1° and
//! shifted by less than 1e-3 relative to each other. Rapier keeps its manifolds, the fields make theirs anew. How far a
//! manifold is out of date shows in itself: its normals on the two parts differ by the turn, and its points on the two
//! parts by the shift. A depth changes by no more than the surfaces move, so the band grows by the shift, and by
//! the turn times the largest distance between two points of the overlap, which is the size of the smaller part. Beyond
//! Parry's limits the band does not grow.
//!
//! For polyhedra Parry's search for the distance ends at a relative error of √(10 ε), 1e-3 in 32 bits; the distance of
//! cuboids is computed directly. Its search for the depth ends at 100 ε, times their size if that is above one. A
//! direction along which the distance is too short by a share s is off by an angle of √(2 s).

use super::report::CrossCheckReport;
use super::sighting::RapierPoint;
use crate::math::{Real, Vector};
use crate::rapier::geometry::Collider;
use crate::rigid::local_pose;

/// Parry's limits for kept points: the shift, and the turn of 1°, in radians.
const MOST_SHIFT: Real = 1.001e-3;
const MOST_TURN: Real = 0.0175;
/// The number of units in the last place at which Parry's search for the depth of polyhedra ends.
const SEARCH: Real = 100.0;

/// The largest differences at a contact that are not disagreements.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bands {
    pub depth: Real,
    /// For points of contact.
    pub point: Real,
    /// For normals, in radians.
    pub normal: Real,
    /// The error of a length by rounding alone.
    pub rounding: Real,
}

/// The sizes of two colliders on which bands depend.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    /// The sum over both sides of the distance from the body's origin to the farthest point of the part.
    pub reach: Real,
    /// The same from the origins of the parts, without their arms.
    pub own: Real,
    /// True if both are cuboids.
    cuboids: bool,
    /// True if Parry computes their distance directly, without a search.
    worked_out: bool,
    /// The largest distance between two points of the smaller part.
    across: Real,
    /// The radii of parts that are balls.
    radii: [Option<Real>; 2],
    pub skins: Real,
}

impl Sizes {
    pub(super) fn of_colliders(colliders: [&Collider; 2]) -> Self {
        let extent = colliders.map(|collider| {
            if collider.shape().as_halfspace().is_some() {
                return Real::INFINITY;
            }
            let sphere = collider.shape().compute_local_bounding_sphere();
            sphere.center.length() + sphere.radius
        });
        let arm = |collider: &Collider| local_pose(collider).translation.length();
        // An unbounded part counts by its arm only: a plane has no farthest point.
        let bounded = extent.map(|extent| if extent.is_finite() { extent } else { 0.0 });
        let radius = |collider: &Collider| Some(collider.shape().as_ball()?.radius);
        let arms = arm(colliders[0]) + arm(colliders[1]);
        Sizes {
            reach: bounded[0] + bounded[1] + arms,
            own: bounded[0] + bounded[1],
            worked_out: colliders.iter().any(|it| it.shape().as_ball().is_some())
                && colliders
                    .iter()
                    .all(|it| it.shape().as_ball().is_some() || it.shape().as_cuboid().is_some()),
            cuboids: colliders.iter().all(|it| it.shape().as_cuboid().is_some()),
            across: 2.0 * extent[0].min(extent[1]),
            radii: colliders.map(radius),
            skins: colliders[0].contact_skin() + colliders[1].contact_skin(),
        }
    }

    /// The relative error at which Parry's search for distances ends. Zero where it does not search: between balls, and
    /// between balls and cuboids.
    pub(super) fn search(&self) -> Real {
        if self.worked_out {
            0.0
        } else {
            (10.0 * Real::EPSILON).sqrt()
        }
    }
}

impl Bands {
    /// The bands at a contact of a given depth; `spots` are the contact points that Rapier holds for the pair.
    pub(super) fn at(
        sizes: &Sizes,
        world_point: Vector,
        depth: Real,
        spots: &[RapierPoint],
    ) -> Self {
        let rounding = CrossCheckReport::band(world_point, sizes.reach + sizes.skins);
        match sizes.radii {
            [None, None] => Self::of_manifolds(sizes, rounding, depth, spots),
            radii => Self::of_balls(radii, sizes.skins, rounding, depth),
        }
    }

    fn of_balls(radii: [Option<Real>; 2], skins: Real, rounding: Real, depth: Real) -> Self {
        let [one, two] = radii.map(Option::unwrap_or_default);
        let reach = one + two + skins;
        // The distance between the centres, or from the centre to the other's surface.
        let line = (reach - depth).abs();
        let normal = rounding / line.max(Real::MIN_POSITIVE);
        let turned = normal.min(2.0);
        Bands {
            depth: rounding,
            // The point lies along the normal from a centre.
            point: rounding + turned * reach,
            normal,
            rounding,
        }
    }

    fn of_manifolds(sizes: &Sizes, rounding: Real, depth: Real, spots: &[RapierPoint]) -> Self {
        let most = |value: fn(&RapierPoint) -> Real| spots.iter().map(value).fold(0.0, Real::max);
        let turn = most(|spot| spot.turn).min(MOST_TURN);
        let shift = most(|spot| spot.shift).min(MOST_SHIFT);
        let share = if sizes.cuboids { 0.0 } else { sizes.search() };
        let search = SEARCH * Real::EPSILON * sizes.reach.max(1.0) + share * depth.abs();
        let rounding = rounding + search;
        let direction = (2.0 * share).sqrt();
        let length = rounding + shift + turn * sizes.across;
        Bands {
            depth: length,
            point: length,
            normal: turn + direction + rounding / (0.5 * sizes.across).max(Real::MIN_POSITIVE),
            rounding,
        }
    }

    /// Returns true if the normal is determined at all.
    pub(super) fn knows_normal(&self) -> bool {
        self.normal < std::f64::consts::FRAC_PI_2 as Real
    }
}
