//! Sources of a batch in cells within cells, each with its moments.

use std::ops::Range;

use super::halves::part;
use crate::math::DVec3;

/// Cells of up to this many sources are not divided.
const FEWEST: usize = 8;

/// A source at its place in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    pub point: DVec3,
    pub strength: f64,
    /// The body that carries it; see [`owner`](crate::sample::owner).
    pub owner: f64,
}

/// The sources of a batch, divided into halves of halves.
#[derive(Debug, Default)]
pub(super) struct CellTree {
    /// The stamp of the batch whose sources are sorted here, if they stand still.
    pub made_for: Option<u64>,
    /// True if all sources have finite positions; otherwise there are no cells.
    pub are_finite: bool,
    pub sources: Vec<Source>,
    /// Each cell before those within it.
    pub list: Vec<SourceCell>,
    /// The owner and the index in `sources` of each source on a body, sorted.
    owned: Vec<(f64, u32)>,
}

/// A cell of neighbouring sources, with the moments by which it acts on distant samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct SourceCell {
    /// The mean position of its sources, weighted by the magnitudes of their strengths.
    pub centre: DVec3,
    /// The largest squared distance of a source from the centre.
    pub radius2: f64,
    /// The sum of the strengths s.
    pub total: f64,
    /// The sum of s δ, for the offset δ of each source from the centre.
    pub first: DVec3,
    /// The sum of s δ δᵀ: xx, yy, zz, then yz, xz, xy.
    pub second: [DVec3; 2],
    pub start: u32,
    pub end: u32,
    /// The index of the first cell after those within it.
    pub next: u32,
    pub is_cut: bool,
}

impl SourceCell {
    pub(super) fn places(&self) -> Range<usize> {
        self.start as usize..self.end as usize
    }
}

impl CellTree {
    /// Sorts sources into cells, unless a position is not finite.
    pub(super) fn sort(&mut self, sources: &[Source]) {
        self.list.clear();
        self.sources.clear();
        self.owned.clear();
        self.are_finite = sources.iter().all(|source| source.point.is_finite());
        if !self.are_finite || sources.is_empty() {
            return;
        }
        self.sources.extend_from_slice(sources);
        self.cut(0..sources.len());
        let owned = self.sources.iter().enumerate();
        let owned = owned.map(|(place, source)| (source.owner, place as u32));
        self.owned.extend(owned.filter(|(owner, _)| *owner >= 0.0));
        self.owned
            .sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// Makes a cell of the sources in a range, and the cells within it.
    fn cut(&mut self, places: Range<usize>) {
        let number = self.list.len();
        let is_cut = places.len() > FEWEST;
        let cell = SourceCell::of(&self.sources, places.clone(), is_cut);
        self.list.push(cell);
        if is_cut {
            let half = places.len() / 2;
            part(&mut self.sources[places.clone()], half, |it| it.point);
            let middle = places.start + half;
            self.cut(places.start..middle);
            self.cut(middle..places.end);
        }
        self.list[number].next = self.list.len() as u32;
    }

    /// The indices of the sources of a body.
    pub(super) fn of_body(&self, owner: f64) -> impl Iterator<Item = u32> {
        let start = self.owned.partition_point(|known| known.0 < owner);
        let own = self.owned[start..].iter();
        let own = own.take_while(move |known| known.0 == owner);
        own.map(|known| known.1)
    }
}

impl SourceCell {
    fn of(sources: &[Source], places: Range<usize>, is_cut: bool) -> Self {
        let here = &sources[places.clone()];
        let size: f64 = here.iter().map(|it| it.strength.abs()).sum();
        let centre = if size > 0.0 && size < f64::INFINITY {
            let about = here[0].point;
            let ways = here
                .iter()
                .map(|it| (it.point - about) * (it.strength.abs() / size));
            about + ways.sum::<DVec3>()
        } else {
            here[0].point
        };
        let mut cell = SourceCell {
            centre,
            radius2: 0.0,
            total: 0.0,
            first: DVec3::ZERO,
            second: [DVec3::ZERO; 2],
            start: places.start as u32,
            end: places.end as u32,
            next: 0,
            is_cut,
        };
        for source in here {
            let way = source.point - centre;
            let moment = way * source.strength;
            cell.radius2 = cell.radius2.max(way.length_squared());
            cell.total += source.strength;
            cell.first += moment;
            cell.second[0] += moment * way;
            cell.second[1] += DVec3::new(moment.y * way.z, moment.x * way.z, moment.x * way.y);
        }
        cell
    }
}
