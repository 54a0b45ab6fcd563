//! Sites by fours, as registers want them.

use std::ops::Range;

use crate::eval::lanes::Row;
use crate::math::{Real, Vector};
use crate::sample::{SamplePoint, Samples};
use crate::threads::{self, each_chunk};

/// Where there are threads, tiles are shared out to them in parts of at least so many, and no more parts.
const FEWEST: usize = 128;
const MOST_PARTS: usize = 8;
/// Tiles that one thread sums up at a time.
const CHUNK: usize = 1024;

/// Sites in tiles of four: where they are, what they are to the laws, and what acts on them.
///
/// Where a tile is not full, sites without charges stand in the place of the last one.
#[derive(Debug, Default)]
pub(super) struct Tiles {
    pub points: Vec<[Row; 3]>,
    pub parts: Vec<Part>,
    /// Tile by tile and law by law, the strength and the weight of each site.
    charges: Vec<[Row; 2]>,
    laws: usize,
    /// Which body each site is of.
    pub bodies: Vec<Row>,
    /// How many sites each tile has.
    pub counts: Vec<u8>,
    /// Which sample each site is, four to a tile.
    samples: Vec<u32>,
}

/// What comes of some tiles that meet others, all of which come later.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub tiles: Range<usize>,
    /// What acts on each tile from the first of them on.
    pub sums: Vec<[Row; 3]>,
}

impl Part {
    /// Nothing acts on the tiles yet; `count`: of all.
    pub(super) fn clear(&mut self, count: usize) {
        self.sums.clear();
        self.sums.resize(count - self.tiles.start, [[0.0; 4]; 3]);
    }
}

impl Tiles {
    pub(super) fn clear(&mut self, laws: usize) {
        self.points.clear();
        self.charges.clear();
        self.laws = laws;
        self.bodies.clear();
        self.counts.clear();
        self.samples.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.counts.len()
    }

    /// Adds a site: to the last tile, if that has room and is of the same body or `mixed`.
    pub(super) fn push(
        &mut self,
        (number, sample): (usize, &SamplePoint),
        mixed: bool,
        charges: impl Iterator<Item = [Real; 2]>,
    ) {
        let body = sample.body as Real;
        let joins = |count: &u8, bodies: &Row| *count < 4 && (mixed || bodies[0] == body);
        let room = self.counts.last().zip(self.bodies.last());
        if !room.is_some_and(|(count, bodies)| joins(count, bodies)) {
            self.counts.push(0);
            self.bodies.push([body; 4]);
            self.points.push([[0.0; 4]; 3]);
            self.samples.extend([number as u32; 4]);
            let laws = self.charges.len() + self.laws;
            self.charges.resize(laws, [[0.0; 4]; 2]);
        }
        let tile = self.counts.len() - 1;
        let lane = self.counts[tile] as usize;
        self.counts[tile] += 1;
        self.bodies[tile][lane..].fill(body);
        self.samples[4 * tile + lane..].fill(number as u32);
        for (law, [strength, weight]) in charges.enumerate() {
            let known = &mut self.charges[tile * self.laws + law];
            (known[0][lane], known[1][lane]) = (strength, weight);
        }
    }

    /// Takes up where the sites are, and shares out the tiles.
    pub(super) fn place(&mut self, samples: &Samples) {
        let numbers = self.samples.chunks_exact(4);
        for (points, numbers) in self.points.iter_mut().zip(numbers) {
            for (lane, number) in numbers.iter().enumerate() {
                let point = samples.list[*number as usize].world_point;
                for (row, x) in points.iter_mut().zip(point.to_array()) {
                    row[lane] = x;
                }
            }
        }
        let count = self.len();
        let parts = match threads::ARE_MANY {
            true => (count / FEWEST).clamp(1, MOST_PARTS),
            false => 1,
        };
        self.parts.resize_with(parts, Part::default);
        for (number, part) in self.parts.iter_mut().enumerate() {
            part.tiles = count * number / parts..count * (number + 1) / parts;
        }
    }

    /// Adds what came of the other parts to that of the first, which is the sum for all tiles then.
    pub(super) fn join(&mut self) {
        let Some((whole, others)) = self.parts.split_first_mut() else {
            return;
        };
        each_chunk(&mut whole.sums, CHUNK, |first, sums| {
            for part in &*others {
                let start = part.tiles.start.max(first);
                let later = sums.iter_mut().skip(start - first);
                let parts = part.sums.iter().skip(start - part.tiles.start);
                for (sum, part) in later.flatten().flatten().zip(parts.flatten().flatten()) {
                    *sum += part;
                }
            }
        });
    }

    /// Adds what acts on the sites to the sums of their samples.
    pub(super) fn give(&self, sums: &mut [Vector]) {
        let joined = self.parts.first().map_or(&[][..], |whole| &whole.sums);
        for (tile, [x, y, z]) in joined.iter().enumerate() {
            for lane in 0..self.counts[tile] as usize {
                let sample = self.samples[4 * tile + lane];
                sums[sample as usize] += Vector::new(x[lane], y[lane], z[lane]);
            }
        }
    }

    /// Of each law, the strengths and weights of a tile.
    #[inline(always)]
    pub(super) fn charges(&self, tile: usize) -> &[[Row; 2]] {
        &self.charges[tile * self.laws..(tile + 1) * self.laws]
    }

    /// The strength and weight of every site in one law.
    pub(super) fn sides(&self, law: usize) -> impl Iterator<Item = [Real; 2]> + Clone {
        let tiles = self.charges.iter().skip(law).step_by(self.laws.max(1));
        tiles.flat_map(|[strengths, weights]| (0..4).map(|lane| [strengths[lane], weights[lane]]))
    }
}
