//! Sites of bodies in groups of four, in the layout of SIMD registers.

use std::ops::Range;

use crate::eval::lanes::Row;
use crate::math::{Real, Vector};
use crate::sample::{SamplePoint, Samples};
use crate::threads::{self, each_chunk};

/// The smallest number of tiles of a part, and the largest number of parts, when threads share the tiles.
const FEWEST: usize = 128;
const MOST_PARTS: usize = 8;
/// Tiles that one thread adds up at a time.
const CHUNK: usize = 1024;

/// Sites in tiles of four: their positions, their charges in each law, and the sums of forces on them.
///
/// A tile with fewer sites repeats the position of its last one, without charges.
#[derive(Debug, Default)]
pub(super) struct Tiles {
    pub points: Vec<[Row; 3]>,
    pub parts: Vec<Part>,
    /// The strength and the weight of each site, by tile and then by law.
    charges: Vec<[Row; 2]>,
    laws: usize,
    /// The number of each site's body.
    pub bodies: Vec<Row>,
    /// The number of sites in each tile.
    pub counts: Vec<u8>,
    /// The number of each site's sample, four to a tile.
    samples: Vec<u32>,
}

/// A range of tiles, and the forces of their pairs with later tiles.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub tiles: Range<usize>,
    /// The sums on each tile, from the first of the range to the last of all.
    pub sums: Vec<[Row; 3]>,
}

impl Part {
    /// Sets the sums to zero; `count` is the number of all tiles.
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

    /// Adds a site to the last tile, if that has room and is of the same body or `mixed`; otherwise to a new
    /// tile.
    pub(super) fn push(
        &mut self,
        number: usize,
        sample: &SamplePoint,
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

    /// Sets the positions of the sites, and divides the tiles into parts.
    pub(super) fn place(&mut self, samples: &Samples) {
        let numbers = self.samples.chunks_exact(4);
        for (points, numbers) in self.points.iter_mut().zip(numbers) {
            for (lane, number) in numbers.iter().enumerate() {
                let point = samples.sites[*number as usize].world_point;
                for (row, x) in points.iter_mut().zip(point.to_array()) {
                    row[lane] = x;
                }
            }
        }
        let count = self.len();
        let most = if threads::ARE_MANY { MOST_PARTS } else { 1 };
        let parts = (count / FEWEST).clamp(1, most);
        self.parts.resize_with(parts, Part::default);
        for (number, part) in self.parts.iter_mut().enumerate() {
            part.tiles = count * number / parts..count * (number + 1) / parts;
        }
    }

    /// Adds the sums of the other parts to those of the first, which then has the sums of all.
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

    /// Adds the sums on the sites to those of their samples.
    pub(super) fn give(&self, sums: &mut [Vector]) {
        let joined = self.parts.first().map_or(&[][..], |whole| &whole.sums);
        for (tile, [x, y, z]) in joined.iter().enumerate() {
            for lane in 0..self.counts[tile] as usize {
                let sample = self.samples[4 * tile + lane];
                sums[sample as usize] += Vector::new(x[lane], y[lane], z[lane]);
            }
        }
    }

    /// For each law, the strengths and weights of a tile.
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
