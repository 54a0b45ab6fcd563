//! Sums the forces of cells on eight samples at once.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, dispatch, f64x8};

use super::super::quantity::Quantity;
use super::cells::{CellTree, SourceCell};
use crate::field::{Linearised, Profile, Radial};
use crate::math::{DVec3, to_dvec3, to_f64};
use crate::number::{Dual, level};
use crate::sample::SamplePoint;

/// The number of samples that are evaluated together.
pub(super) const WIDTH: usize = 8;

/// Up to eight neighbouring samples.
#[derive(Debug, Default)]
pub(super) struct Block {
    points: [[f64; WIDTH]; 3],
    owners: [f64; WIDTH],
    low: DVec3,
    high: DVec3,
    count: usize,
    sums: [[f64; WIDTH]; 3],
    /// The indices of the sources on the bodies of these samples, sorted.
    own: Vec<u32>,
}

impl Block {
    /// Sets the samples, given by their points and owners.
    fn fill(&mut self, samples: impl Iterator<Item = (DVec3, f64)>, cells: &CellTree) {
        self.owners = [f64::NAN; WIDTH];
        (self.low, self.high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.count = 0;
        self.own.clear();
        for (lane, (point, owner)) in samples.take(WIDTH).enumerate() {
            // Lanes without a sample repeat the last one.
            for (column, x) in self.points.iter_mut().zip(point.to_array()) {
                column[lane..].fill(x);
            }
            if !self.owners[..lane].contains(&owner) {
                self.own.extend(cells.of_body(owner));
            }
            self.owners[lane] = owner;
            self.low = self.low.min(point);
            self.high = self.high.max(point);
            self.count += 1;
        }
        self.own.sort_unstable();
    }

    /// The sum at each sample.
    pub(super) fn sums(&self) -> impl Iterator<Item = DVec3> {
        let [x, y, z] = &self.sums;
        (0..self.count).map(|lane| DVec3::new(x[lane], y[lane], z[lane]))
    }

    /// Returns true if a cell has sources of a sampled body.
    fn has_own(&self, cell: &SourceCell) -> bool {
        let next = self.own.partition_point(|place| *place < cell.start);
        self.own.get(next).is_some_and(|place| *place < cell.end)
    }

    /// A lower bound of the squared distance of a point from the samples.
    fn distance2(&self, point: DVec3) -> f64 {
        let outside = (self.low - point).max(point - self.high).max(DVec3::ZERO);
        outside.length_squared()
    }
}

/// The law F = s d (d² + ε²)ᵖ of sources in cells.
pub(super) struct CellWalk<'a> {
    cells: &'a CellTree,
    law: &'a Radial,
    quantity: Quantity,
    /// p.
    exponent: f64,
    /// ε².
    softening2: f64,
    /// Square of the opening angle, as the ratio of a cell's radius to its distance.
    tangent2: f64,
}

impl<'a> CellWalk<'a> {
    /// `None` for laws of another form, and if the position of a source is not finite.
    pub(super) fn new(cells: &'a CellTree, law: &'a Radial, quantity: Quantity) -> Option<Self> {
        let Profile::Power {
            power, softening, ..
        } = law.profile
        else {
            return None;
        };
        let angle = to_f64(law.opening_angle.filter(|_| cells.are_finite)?);
        let softening = to_f64(softening);
        Some(CellWalk {
            cells,
            law,
            quantity,
            exponent: (to_f64(power) - 1.0) / 2.0,
            softening2: softening * softening,
            tangent2: angle * angle,
        })
    }

    /// Sums over all sources at each of up to eight samples, given by their points and owners. A potential is in
    /// place of the first component of the force.
    pub(super) fn on(&self, samples: impl Iterator<Item = (DVec3, f64)>, block: &mut Block) {
        block.fill(samples, self.cells);
        block.sums = dispatch!(level(), simd => self.sum(simd, block));
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn sum<S: Simd>(&self, simd: S, block: &Block) -> [[f64; WIDTH]; 3] {
        let mut seen = Seen::new(simd, block);
        let mut number = 0;
        while let Some(cell) = self.cells.list.get(number) {
            number += 1;
            let is_far = cell.radius2 < self.tangent2 * block.distance2(cell.centre);
            if is_far && !block.has_own(cell) {
                self.add_cell(&mut seen, cell);
            } else if cell.is_cut {
                continue;
            } else {
                self.add_sources(&mut seen, cell);
            }
            number = cell.next as usize;
        }
        seen.sum.map(|sum| sum.to_array())
    }

    /// Adds the force on one sample, with derivatives. The derivatives treat the sources of a distant cell as if
    /// all were at its centre.
    pub(super) fn linearise(&self, sample: &SamplePoint, weight: f64, sum: &mut Linearised) {
        let (point, owner) = (to_dvec3(sample.world_point), to_f64(sample.owner));
        let is_own = |cell: &SourceCell| {
            let mut own = self.cells.of_body(owner);
            own.any(|place| cell.places().contains(&(place as usize)))
        };
        let slope_at = self.law.slope();
        let mut add = |d: DVec3, strength: f64, cell: Option<&SourceCell>| {
            let factor = slope_at(d.length_squared());
            sum.add_central(d, factor, strength * weight);
            if let Some(cell) = cell {
                sum.force += self.moments(cell, d, factor) * weight;
            }
        };
        let mut number = 0;
        while let Some(cell) = self.cells.list.get(number) {
            number += 1;
            let is_far = cell.radius2 < self.tangent2 * point.distance_squared(cell.centre);
            if is_far && !is_own(cell) {
                add(point - cell.centre, cell.total, Some(cell));
            } else if cell.is_cut {
                continue;
            } else {
                let sources = self.cells.sources[cell.places()].iter();
                for source in sources.filter(|source| source.owner != owner) {
                    add(point - source.point, source.strength, None);
                }
            }
            number = cell.next as usize;
        }
    }

    /// The force of the first and second moments of a cell, at the offset d from its centre; see
    /// [`CellWalk::add_cell`].
    fn moments(&self, cell: &SourceCell, d: DVec3, factor: Dual<1>) -> DVec3 {
        let (g, [slope]) = (factor.re, factor.slopes);
        let bend = slope * (self.exponent - 1.0) / (d.length_squared() + self.softening2);
        let (first, [square, mixed]) = (cell.first, cell.second);
        let turned = DVec3::new(
            square.x * d.x + mixed.z * d.y + mixed.y * d.z,
            mixed.z * d.x + square.y * d.y + mixed.x * d.z,
            mixed.y * d.x + mixed.x * d.y + square.z * d.z,
        );
        let along = (bend * d.dot(turned) - slope * d.dot(first)) * 2.0;
        d * (slope * square.element_sum() + along) - first * g + turned * (slope * 2.0)
    }

    #[inline(always)]
    fn add_sources<S: Simd>(&self, seen: &mut Seen<S>, cell: &SourceCell) {
        for source in &self.cells.sources[cell.places()] {
            let way = seen.way_from(source.point);
            let acts = !seen.owners.simd_eq(source.owner);
            let rho2 = square(way) + self.softening2;
            let zero = f64x8::splat(rho2.simd, 0.0);
            match self.quantity {
                Quantity::Force => {
                    let factor = acts.select(self.factor(rho2) * source.strength, zero);
                    for (sum, way) in seen.sum.iter_mut().zip(way) {
                        *sum += factor * acts.select(way, zero);
                    }
                }
                Quantity::Potential => {
                    let potential = self.potential(rho2) * source.strength;
                    seen.sum[0] += acts.select(potential, zero);
                }
            }
        }
    }

    /// A source at an offset δ from the centre acts by F(d − δ) = F − (δ·∇)F + ½ (δ·∇)²F + …, with derivatives by
    /// those of g(ρ²) = ρ²ᵖ.
    #[inline(always)]
    fn add_cell<S: Simd>(&self, seen: &mut Seen<S>, cell: &SourceCell) {
        let [x, y, z] = seen.way_from(cell.centre);
        let rho2 = square([x, y, z]) + self.softening2;
        let inverse = f64x8::splat(rho2.simd, 1.0) / rho2;
        let g = if self.exponent == -1.5 {
            inverse * inverse.sqrt()
        } else {
            self.factor(rho2)
        };
        let slope = g * inverse * self.exponent;
        let bend = slope * inverse * (self.exponent - 1.0);
        let (first, [square, mixed]) = (cell.first, cell.second);
        let along = x * first.x + y * first.y + z * first.z;
        let turned = [
            x * square.x + y * mixed.z + z * mixed.y,
            x * mixed.z + y * square.y + z * mixed.x,
            x * mixed.y + y * mixed.x + z * square.z,
        ];
        let twice = x * turned[0] + y * turned[1] + z * turned[2];
        let trace = square.element_sum();
        if self.quantity == Quantity::Potential {
            // U(d − δ) = U + δ·F − ½ δδ:∇F + …
            let second = g * trace + twice * slope * 2.0;
            seen.sum[0] += self.potential(rho2) * cell.total + along * g - second * 0.5;
            return;
        }
        let factor = g * cell.total + slope * trace + (bend * twice - slope * along) * 2.0;
        let first = first.to_array();
        for (axis, (sum, way)) in seen.sum.iter_mut().zip([x, y, z]).enumerate() {
            *sum += way * factor - g * first[axis] + turned[axis] * slope * 2.0;
        }
    }

    /// g, from ρ².
    #[inline(always)]
    fn factor<S: Simd>(&self, rho2: f64x8<S>) -> f64x8<S> {
        if self.exponent == -1.5 {
            return f64x8::splat(rho2.simd, 1.0) / (rho2 * rho2.sqrt());
        }
        self.each(rho2, |law, r2| law.factor(r2))
    }

    /// U for a strength of one, from ρ².
    #[inline(always)]
    fn potential<S: Simd>(&self, rho2: f64x8<S>) -> f64x8<S> {
        if self.exponent == -1.5 {
            return f64x8::splat(rho2.simd, 1.0) / rho2.sqrt();
        }
        self.each(rho2, |law, r2| law.potential_at(r2).unwrap_or(f64::NAN))
    }

    // Not inlined: it is compiled once, so its bits do not depend on the caller's instruction set.
    #[inline(never)]
    fn each<S: Simd>(&self, rho2: f64x8<S>, number: fn(&Radial, f64) -> f64) -> f64x8<S> {
        let mut numbers = rho2.to_array();
        for rho2 in &mut numbers {
            *rho2 = number(self.law, *rho2 - self.softening2);
        }
        f64x8::load_array(rho2.simd, numbers)
    }
}

/// Eight samples, and the sums at them so far.
struct Seen<S: Simd> {
    points: [f64x8<S>; 3],
    owners: f64x8<S>,
    sum: [f64x8<S>; 3],
}

impl<S: Simd> Seen<S> {
    #[inline(always)]
    fn new(simd: S, block: &Block) -> Self {
        let load = |column: &[f64; WIDTH]| f64x8::load_array_ref(simd, column);
        let [x, y, z] = &block.points;
        Seen {
            points: [load(x), load(y), load(z)],
            owners: load(&block.owners),
            sum: [f64x8::splat(simd, 0.0); 3],
        }
    }

    #[inline(always)]
    fn way_from(&self, point: DVec3) -> [f64x8<S>; 3] {
        let [x, y, z] = self.points;
        [x - point.x, y - point.y, z - point.z]
    }
}

#[inline(always)]
fn square<S: Simd>([x, y, z]: [f64x8<S>; 3]) -> f64x8<S> {
    x * x + y * y + z * z
}
