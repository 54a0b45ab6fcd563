//! Samples of the volumes of shapes.

use super::moments::{Moments, cholesky, matched};
use super::rule::{Quadrature, bounds};
use crate::math::{DMat3, DVec3, SharedShape, from_dvec3};

/// Fewest samples of a volume: the 3 × 3 × 3 of a cube.
const FEWEST: usize = 27;

/// A grid of more cells is not refined any further: thin, slanted shapes fill few of them.
const MOST_TRIED: usize = 4096;

/// Points that share the volume equally: grid points in the shape, moved (by little) so that their moments up
/// to the second are those of the shape. If no grid has enough points in the shape, eight points with these moments.
pub(super) fn rule(shape: &SharedShape, moments: &Moments) -> Option<Quadrature> {
    let (low, high) = bounds(shape)?;
    let mut counts = [2_usize; 3];
    loop {
        let size = DVec3::new(counts[0] as f64, counts[1] as f64, counts[2] as f64);
        let edges = (high - low) / size;
        let points = inside(shape, low, edges, counts);
        if points.len() >= FEWEST
            && let Some((points, map)) = matched(&points, moments)
        {
            let edge = DMat3::from_diagonal(edges * edges / 12.0);
            return Some(Quadrature::of(points, map * edge * map.transpose()));
        }
        if counts.iter().product::<usize>() > MOST_TRIED {
            break;
        }
        counts[edges.max_position()] += 1;
    }
    corners(moments)
}

/// The centres of those cells of the grid that lie in the shape.
fn inside(shape: &SharedShape, low: DVec3, edges: DVec3, counts: [usize; 3]) -> Vec<(DVec3, f64)> {
    let mut points = Vec::new();
    for x in 0..counts[0] {
        for y in 0..counts[1] {
            for z in 0..counts[2] {
                let middle = DVec3::new(x as f64, y as f64, z as f64) + 0.5;
                let point = low + middle * edges;
                if shape.contains_local_point(from_dvec3(point)) {
                    points.push((point, 1.0));
                }
            }
        }
    }
    points
}

/// Eight points with these moments, which may lie outside of the shape.
fn corners(moments: &Moments) -> Option<Quadrature> {
    let root = cholesky(moments.second)?;
    let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
    let point = |corner: usize| {
        let offset = DVec3::new(sign(corner, 0), sign(corner, 1), sign(corner, 2));
        (moments.centre + root * offset, 0.125)
    };
    // Each point stands for an eighth of the volume: a copy of the shape that is half as wide.
    Some(Quadrature::of((0..8).map(point), moments.second * 0.25))
}
