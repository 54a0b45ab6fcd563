//! Which tiles may have sites in range of each other: a list that outlives the step (Verlet, Phys.
//! Rev. 159 (1967) 98).

use std::ops::Range;

use fearless_simd::{Simd, SimdBase, SimdMask, dispatch};

use super::tiles::Tiles;
use crate::eval::lanes::{Eight, Four, Row, level, spread, twice};
use crate::math::{Real, Vector};
use crate::neighbors::{FEWEST_FOR_GRID, PointGrid};
use crate::threads::each_chunk;

/// The list reaches farther than the range by this share of it, and so holds until a site has moved by
/// half of that.
const SKIN: Real = 0.1;

/// Tiles whose neighbours one thread looks for at a time.
const CHUNK: usize = 512;

/// For each tile, later ones of other bodies of which a site may be in range of one of its own.
#[derive(Debug, Default)]
pub(super) struct NearTiles {
    range: Option<Real>,
    bodies: Vec<Row>,
    /// Where the sites were when it was made.
    points: Vec<[Row; 3]>,
    /// Where the others of each tile start; one more for the end. None if there is no range.
    starts: Vec<u32>,
    others: Vec<u32>,
    search: Search,
    /// A buffer for where the next other of each tile goes.
    next: Vec<u32>,
}

impl NearTiles {
    /// Forgets what it knows, unless it is of that range and of the same tiles.
    pub(super) fn keep_if_of(&mut self, range: Option<Real>, tiles: &Tiles) {
        if self.range != range || self.bodies != tiles.bodies {
            self.range = range;
            self.bodies.clone_from(&tiles.bodies);
            self.points.clear();
            self.others.clear();
        }
    }

    /// Brings it up to date; whatever its age, the others in range stand in the same order.
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

    /// Later tiles that may be in range of one. Without a range, all, and itself.
    #[inline(always)]
    pub(super) fn of(&self, tile: usize, count: usize) -> &[u32] {
        match self.range {
            Some(_) => &self.others[self.starts[tile] as usize..self.starts[tile + 1] as usize],
            None => &self.others[tile..count],
        }
    }

    /// Sorts the pairs found, of which the later tiles stand in their order, by the earlier ones.
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

/// Whether no site has moved by half the skin.
#[inline(always)]
fn still_holds<S: Simd>(simd: S, now: &[[Row; 3]], before: &[[Row; 3]], range: Real) -> bool {
    // A hair less: rounding must not lose what is exactly at the range.
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

/// Buffers of the search.
#[derive(Debug, Default)]
struct Search {
    /// Balls that hold the tiles.
    centres: Vec<Vector>,
    radii: Vec<Real>,
    largest: Real,
    grid: PointGrid,
    /// The balls in the order of the grid: x, y, z, radius, and which tile it is.
    sorted: [Vec<Real>; 5],
    /// Earlier tile and later, by chunks of the later ones.
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
        // Half the reach: finer cells fit the ball better than they cost in ranges.
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

    /// Lists the pairs of tiles of which any sites are within reach, the later tiles in their order.
    fn find_all(&mut self, tiles: &Tiles, reach: Real) {
        let mut found = std::mem::take(&mut self.found);
        found.resize_with(tiles.len().div_ceil(CHUNK), Vec::new);
        each_chunk(&mut found, 1, |chunk, found| {
            let Some(pairs) = found.first_mut() else {
                return;
            };
            pairs.clear();
            let later = chunk * CHUNK..tiles.len().min((chunk + 1) * CHUNK);
            dispatch!(level(), simd => self.find(simd, (tiles, later), reach, pairs));
        });
        self.found = found;
    }

    /// Lists the pairs of which the later tile is one of those given.
    #[inline(always)]
    fn find<S: Simd>(
        &self,
        simd: S,
        (tiles, later): (&Tiles, Range<usize>),
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
                        while found != 0 {
                            let other = order[at + found.trailing_zeros() as usize];
                            found &= found - 1;
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

/// Which of eight balls of earlier tiles meet one, as bits.
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

/// Whether any of four sites are within reach of any others.
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
