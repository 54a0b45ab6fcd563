//! A list of pairs of tiles with sites in range of each other. It is made with a margin beyond the range, and reused
//! in later steps until a site has moved by half of the margin (Verlet, Phys. Rev. 159 (1967) 98).

use std::ops::Range;

use fearless_simd::{Simd, SimdBase, SimdMask, dispatch};

use super::tiles::Tiles;
use crate::eval::lanes::{Eight, Four, Row, spread, twice};
use crate::math::{Real, Vector};
use crate::neighbors::{FEWEST_FOR_GRID, PointGrid};
use crate::number::{lanes_of, level};
use crate::threads::each_chunk;

/// Margin of the list, as a share of the range. The list holds until a site has moved by half of it.
const SKIN: Real = 0.1;

/// Tiles for which one thread searches neighbours at a time.
const CHUNK: usize = 512;

/// For each tile, the later tiles of other bodies with a site that may be in range of one of its own.
#[derive(Debug, Default)]
pub(super) struct NearTiles {
    range: Option<Real>,
    bodies: Vec<Row>,
    /// The positions of the sites when the list was made.
    points: Vec<[Row; 3]>,
    /// For each tile, the start of its later tiles in `others`; then the end of the last. Empty if there is no range.
    starts: Vec<u32>,
    others: Vec<u32>,
    search: Search,
    /// A buffer: for each tile, the index in `others` for its next later tile.
    next: Vec<u32>,
}

impl NearTiles {
    /// Discards the list unless it was made for this range and for tiles with the same bodies.
    pub(super) fn keep_if_of(&mut self, range: Option<Real>, tiles: &Tiles) {
        if self.range != range || self.bodies != tiles.bodies {
            self.range = range;
            self.bodies.clone_from(&tiles.bodies);
            self.points.clear();
            self.others.clear();
        }
    }

    /// Brings the list up to date. The order of the tiles in range does not depend on the age of the list.
    pub(super) fn refresh(&mut self, tiles: &Tiles) {
        let Some(range) = self.range else {
            let known = self.others.len() as u32;
            self.others.extend(known..tiles.len() as u32);
            return;
        };
        if dispatch!(level(), simd => still_holds(simd, &tiles.points, &self.points, range)) {
            return;
        }
        self.points.clone_from(&tiles.points);
        let reach = range * (1.0 + SKIN);
        self.search.sort(tiles, reach);
        self.search.find_all(tiles, reach);
        self.order();
    }

    /// The later tiles that may be in range of one. Without a range, all later tiles, and the tile itself.
    #[inline(always)]
    pub(super) fn of(&self, tile: usize, count: usize) -> &[u32] {
        match self.range {
            Some(_) => &self.others[self.starts[tile] as usize..self.starts[tile + 1] as usize],
            None => &self.others[tile..count],
        }
    }

    /// Sorts the pairs found by their earlier tile. The later tiles of each keep their order.
    fn order(&mut self) {
        let count = self.points.len();
        self.starts.clear();
        self.starts.resize(count + 1, 0);
        let found = || self.search.found.iter().flatten();
        for (earlier, _) in found() {
            self.starts[*earlier as usize + 1] += 1;
        }
        for tile in 0..count {
            self.starts[tile + 1] += self.starts[tile];
        }
        self.others.clear();
        self.others.resize(found().count(), 0);
        let next = &mut self.next;
        next.clone_from(&self.starts);
        for (earlier, later) in found() {
            let place = &mut next[*earlier as usize];
            self.others[*place as usize] = *later;
            *place += 1;
        }
    }
}

/// Returns true if no site has moved by half the margin.
#[inline(always)]
fn still_holds<S: Simd>(simd: S, now: &[[Row; 3]], before: &[[Row; 3]], range: Real) -> bool {
    // Slightly less, since rounding must not lose a site at the range exactly.
    let slack = range * SKIN * 0.499;
    let mut all = <Four<S> as SimdBase<S>>::Mask::splat(simd, true);
    for (now, before) in now.iter().zip(before) {
        all &= distance2(simd, now, before).simd_le(slack * slack);
    }
    now.len() == before.len() && all.all_true()
}

/// The squared distances of four points from four others.
#[inline(always)]
fn distance2<S: Simd>(simd: S, a: &[Row; 3], b: &[Row; 3]) -> Four<S> {
    let x = Four::load_array(simd, a[0]) - Four::load_array(simd, b[0]);
    let y = Four::load_array(simd, a[1]) - Four::load_array(simd, b[1]);
    let z = Four::load_array(simd, a[2]) - Four::load_array(simd, b[2]);
    x * x + y * y + z * z
}

/// Search for near tiles by balls around them; keeps its buffers.
#[derive(Debug, Default)]
struct Search {
    /// Balls around the tiles.
    centres: Vec<Vector>,
    radii: Vec<Real>,
    largest: Real,
    grid: PointGrid,
    /// The balls in the order of the grid: x, y, z, radius, and the number of the tile.
    sorted: [Vec<Real>; 5],
    /// Pairs of an earlier and a later tile, in chunks by the later one.
    found: Vec<Vec<(u32, u32)>>,
}

impl Search {
    fn sort(&mut self, tiles: &Tiles, reach: Real) {
        self.centres.clear();
        self.radii.clear();
        for points in &tiles.points {
            let site = |lane| Vector::new(points[0][lane], points[1][lane], points[2][lane]);
            let sites = [0, 1, 2, 3].map(site);
            let low = sites.iter().fold(sites[0], |low, site| low.min(*site));
            let high = sites.iter().fold(sites[0], |high, site| high.max(*site));
            let centre = (low + high) * 0.5;
            let radius2 = sites.map(|site| (site - centre).length_squared());
            self.centres.push(centre);
            self.radii
                .push(radius2.into_iter().fold(0.0, Real::max).sqrt());
        }
        self.largest = self.radii.iter().copied().fold(0.0, Real::max);
        let gridded = tiles.len() >= FEWEST_FOR_GRID;
        // Half the reach: smaller cells exclude more tiles outside of the ball, which pays for the additional ranges.
        let side = (reach + 2.0 * self.largest) * 0.5;
        self.grid
            .build(&self.centres, if gridded { side } else { Real::MAX });
        self.sorted.iter_mut().for_each(Vec::clear);
        for tile in self.grid.order() {
            let (centre, radius) = (self.centres[*tile as usize], self.radii[*tile as usize]);
            let values = centre.to_array().into_iter().chain([radius, *tile as Real]);
            for (column, value) in self.sorted.iter_mut().zip(values) {
                column.push(value);
            }
        }
        for column in &mut self.sorted {
            column.extend([0.0; 8]);
        }
    }

    /// Finds the pairs of tiles with sites within reach of each other, in the order of the later tiles.
    fn find_all(&mut self, tiles: &Tiles, reach: Real) {
        let mut found = std::mem::take(&mut self.found);
        found.resize_with(tiles.len().div_ceil(CHUNK), Vec::new);
        each_chunk(&mut found, 1, |chunk, found| {
            let Some(pairs) = found.first_mut() else {
                return;
            };
            pairs.clear();
            let later = chunk * CHUNK..tiles.len().min((chunk + 1) * CHUNK);
            dispatch!(level(), simd => self.find(simd, tiles, later, reach, pairs));
        });
        self.found = found;
    }

    /// Finds the pairs whose later tile is one of those given.
    #[inline(always)]
    fn find<S: Simd>(
        &self,
        simd: S,
        tiles: &Tiles,
        later: Range<usize>,
        reach: Real,
        pairs: &mut Vec<(u32, u32)>,
    ) {
        let (order, sorted) = (self.grid.order(), &self.sorted);
        for tile in later {
            let (centre, radius) = (&self.centres[tile], &self.radii[tile]);
            let [x, y, z] = centre.to_array();
            let ball = [x, y, z, reach + radius, tile as Real];
            let [px, py, pz] = &tiles.points[tile];
            let sites = [
                [
                    spread(simd, px, 0),
                    spread(simd, py, 0),
                    spread(simd, pz, 0),
                ],
                [
                    spread(simd, px, 2),
                    spread(simd, py, 2),
                    spread(simd, pz, 2),
                ],
            ];
            self.grid.for_each_near(
                *centre,
                reach + radius + self.largest,
                #[inline(always)]
                |run| {
                    for at in run.clone().step_by(8) {
                        let mut found = meets(simd, ball, sorted, at);
                        found &= u64::MAX >> (64 - (run.end - at).min(8));
                        for lane in lanes_of(found) {
                            let other = order[at + lane];
                            let there = &tiles.points[other as usize];
                            let apart = tiles.bodies[tile][0] != tiles.bodies[other as usize][0];
                            if apart && within(simd, &sites, there, reach) {
                                pairs.push((other, tile as u32));
                            }
                        }
                    }
                },
            );
        }
    }
}

/// A bit for each of eight balls, set if it intersects the given one and belongs to an earlier tile.
#[inline(always)]
fn meets<S: Simd>(
    simd: S,
    [x, y, z, radius, tile]: [Real; 5],
    balls: &[Vec<Real>; 5],
    at: usize,
) -> u64 {
    let [dx, dy, dz] = [
        Eight::from_slice(simd, &balls[0][at..at + 8]) - x,
        Eight::from_slice(simd, &balls[1][at..at + 8]) - y,
        Eight::from_slice(simd, &balls[2][at..at + 8]) - z,
    ];
    let reach = (Eight::from_slice(simd, &balls[3][at..at + 8]) + radius) * 1.0001;
    let earlier = Eight::from_slice(simd, &balls[4][at..at + 8]).simd_lt(tile);
    ((dx * dx + dy * dy + dz * dz).simd_le(reach * reach) & earlier).to_bitmask()
}

/// Returns true if any of four sites is within reach of any of four others.
#[inline(always)]
fn within<S: Simd>(simd: S, sites: &[[Eight<S>; 3]; 2], there: &[Row; 3], reach: Real) -> bool {
    let (x, y, z) = (
        twice(simd, &there[0]),
        twice(simd, &there[1]),
        twice(simd, &there[2]),
    );
    let [a, b] = sites;
    let (ax, ay, az) = (a[0] - x, a[1] - y, a[2] - z);
    let (bx, by, bz) = (b[0] - x, b[1] - y, b[2] - z);
    let reach2 = Eight::splat(simd, reach * reach);
    let near = (ax * ax + ay * ay + az * az).simd_le(reach2);
    (near | (bx * bx + by * by + bz * bz).simd_le(reach2)).any_true()
}
