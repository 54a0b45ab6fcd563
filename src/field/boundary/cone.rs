//! Tests whether half-spaces through the sample intersect in a cone that is not flat.
//!
//! The widest round cone in the intersection has its axis along the point of least norm in the convex
//! hull of the inward unit normals, and the norm is the sine of half its opening angle. The point is
//! found by Wolfe's method: P. Wolfe, "Finding the nearest point in a polytope", Mathematical
//! Programming 11 (1976), 128–149.

use super::plane::{Normal, dot};

/// Sine of half the opening at and below which a cone is flat. Two planes that do not count as one make wedges
/// of at least 2.2e-5.
const FLAT: f64 = 2e-5;

/// Sine of the angle to a side above which a direction is clear of it. It is less than [`FLAT`], so that the
/// search ends by one of the two before its vectors depend on each other to within rounding.
const CLEAR: f64 = 1e-5;

/// Limit of the iterations of Wolfe's method, since rounding may keep it from ending.
const MOST_ROUNDS: usize = 1000;

/// Returns true if a unit vector points into a side, and not along its border.
pub(super) fn is_clear_of(side: &Normal, direction: &Normal) -> bool {
    dot(side, direction) > CLEAR
}

/// A unit vector that is clear of all sides, which are given as unit vectors into them; `None` if the cone
/// between them is flat, or empty.
pub(super) fn wide_direction(sides: &[Normal]) -> Option<Normal> {
    let mut hull = Hull {
        sides,
        corners: vec![(0, 1.0)],
    };
    for _ in 0..MOST_ROUNDS {
        let point = hull.point();
        let norm = dot(&point, &point).sqrt();
        if norm <= FLAT {
            return None;
        }
        let direction: Normal = point.iter().map(|x| x / norm).collect();
        let along = sides.iter().map(|side| dot(side, &direction));
        let (worst, least) = along.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        if least > CLEAR {
            return Some(direction);
        }
        hull.corners.push((worst, 0.0));
        hull.approach()?;
    }
    None
}

/// A point of the convex hull, as the mean of some corners with weights.
struct Hull<'a> {
    sides: &'a [Normal],
    /// The numbers of these corners, and their weights, which add up to one.
    corners: Vec<(usize, f64)>,
}

impl Hull<'_> {
    fn point(&self) -> Normal {
        let mut point = vec![0.0; self.sides[0].len()];
        for (corner, weight) in &self.corners {
            let side = &self.sides[*corner];
            point
                .iter_mut()
                .zip(side)
                .for_each(|(x, s)| *x += weight * s);
        }
        point
    }

    /// Moves to the point of least norm among the means of the corners. Removes corners whose weight would
    /// become negative.
    fn approach(&mut self) -> Option<()> {
        loop {
            let wanted = self.least_norm()?;
            let moves = self.corners.iter().zip(&wanted).enumerate();
            let leaving = moves.filter(|(_, (_, wanted))| **wanted <= 0.0);
            let shares = leaving
                .map(|(k, ((_, weight), wanted))| (k, (weight / (weight - wanted)).max(0.0)));
            let first = shares.min_by(|(_, a), (_, b)| a.total_cmp(b));
            let share = first.map_or(1.0, |(_, share)| share);
            for (corner, wanted) in self.corners.iter_mut().zip(&wanted) {
                corner.1 += share * (wanted - corner.1);
            }
            let Some((gone, _)) = first else {
                return Some(());
            };
            self.corners.swap_remove(gone);
        }
    }

    /// The weights, of any sign, of the point of least norm in the plane through the corners: the solution w of
    /// (G + 1) w = 1, divided by its sum, where G holds the dot products of the corners.
    fn least_norm(&self) -> Option<Vec<f64>> {
        let side = |k: usize| &self.sides[self.corners[k].0];
        let count = self.corners.len();
        let row = |i: usize| {
            let products = (0..count).map(|j| dot(side(i), side(j)) + 1.0);
            products.chain([1.0]).collect()
        };
        let weights = solve((0..count).map(row).collect())?;
        let sum: f64 = weights.iter().sum();
        Some(weights.iter().map(|weight| weight / sum).collect())
    }
}

/// Solves linear equations by elimination with pivots. Each row has its right-hand side last.
fn solve(mut rows: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let count = rows.len();
    for k in 0..count {
        let pivot = (k..count).max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs()))?;
        rows.swap(k, pivot);
        let above = rows[k].clone();
        if above[k] == 0.0 {
            return None;
        }
        for row in &mut rows[k + 1..] {
            let share = row[k] / above[k];
            row.iter_mut()
                .zip(&above)
                .for_each(|(x, a)| *x -= share * a);
        }
    }
    let mut solution = vec![0.0; count];
    for k in (0..count).rev() {
        let known = dot(&rows[k][k + 1..count], &solution[k + 1..]);
        solution[k] = (rows[k][count] - known) / rows[k][k];
    }
    Some(solution)
}
