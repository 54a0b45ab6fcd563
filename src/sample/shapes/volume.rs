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
    let on_grid = |counts: [usize; 3]| {
        let edges = (high - low) / sizes(counts);
        let points = inside(shape, low, edges, counts);
        let enough = points.len() >= FEWEST;
        let (points, map) = enough.then(|| matched(&points, moments)).flatten()?;
        let edge = DMat3::from_diagonal(edges * edges / 12.0);
        Some(Quadrature::of(points, map * edge * map.transpose()))
    };
    let mut tried = grids(high - low).map(on_grid);
    tried.find_map(|rule| rule).or_else(|| corners(moments))
}

/// The numbers of cells of grids that fill a box of this size, each finer than the one before where cells are longest.
fn grids(size: DVec3) -> impl Iterator<Item = [usize; 3]> {
    std::iter::successors(Some([2; 3]), move |last: &[usize; 3]| {
        let mut counts = *last;
        // In proportion, or the grids of a needle would have millions of cells in sum.
        let longest = &mut counts[(size / sizes(*last)).max_position()];
        *longest += 1 + *longest / 8;
        (last.iter().product::<usize>() <= MOST_TRIED).then_some(counts)
    })
}

fn sizes(counts: [usize; 3]) -> DVec3 {
    DVec3::from_array(counts.map(|count| count as f64))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_have_few_cells_in_sum() {
        for size in [[1.0, 1.0, 1.0], [1.0, 2.0, 1e-4], [3.0, 1e-4, 1e-4]] {
            let cells = grids(size.into()).map(|counts| counts.iter().product());
            let cells: Vec<usize> = cells.collect();
            assert!(cells.is_sorted());
            let [.., before, last] = cells[..] else {
                panic!("{size:?} has few grids");
            };
            assert!(before <= MOST_TRIED && MOST_TRIED < last, "{size:?}");
            let sum: usize = cells.iter().sum();
            // Each grid has at least 9/8 as many cells as the one before.
            assert!(sum < 9 * last, "{size:?}: {sum}, {last}");
        }
    }
}
