//! Pairs of tiles: all laws of one range on sixteen pairs of sites at once.

use std::ops::Range;

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdSplit, dispatch};

use super::near::NearTiles;
use super::tiles::{Part, Tiles};
use crate::eval::kernel::{InverseSquare, Kernel, KernelLaw, LennardJones};
use crate::eval::lanes::{Eight, Four, Row, spread, total, twice};
use crate::eval::quantity::Quantity;
use crate::math::Real;
use crate::number::level;
use crate::threads::each_chunk;

/// The laws that act within one range. Tiles have the charges of the first Lennard-Jones law, then those of the
/// first inverse square law, which share their square roots, and then those of the others.
#[derive(Debug, Default)]
pub(super) struct Laws {
    range: Option<Real>,
    lennard_jones: LennardJones,
    inverse_square: InverseSquare,
    rest: Vec<KernelLaw>,
    /// Bits of [`LENNARD_JONES`], [`INVERSE_SQUARE`] and [`REST`] for the laws that are present.
    there: u32,
    /// True if in every law the two forces of a pair are opposite.
    pub mutual: bool,
}

/// Bits of the form that a loop over pairs is compiled for.
const LENNARD_JONES: u32 = 1;
const INVERSE_SQUARE: u32 = 2;
const REST: u32 = 4;
/// The two forces of a pair may not be opposite.
const ONE_SIDED: u32 = 8;
/// Tiles may have sites of the same body.
const SHARED: u32 = 16;
const ALL: u32 = 31;
const POTENTIAL: u32 = 32;

impl Laws {
    pub(super) fn clear(&mut self, range: Option<Real>) {
        self.range = range;
        self.rest.clear();
        self.there = 0;
    }

    /// Adds a law. Returns its slot if it is one of the first two; `None` if it goes to the others.
    pub(super) fn put(&mut self, law: KernelLaw) -> Option<usize> {
        let (slot, kind) = match law {
            KernelLaw::LennardJones(law) if self.there & LENNARD_JONES == 0 => {
                self.lennard_jones = law;
                (Some(0), LENNARD_JONES)
            }
            KernelLaw::InverseSquare(law) if self.there & INVERSE_SQUARE == 0 => {
                self.inverse_square = law;
                (Some(1), INVERSE_SQUARE)
            }
            law => {
                self.rest.push(law);
                (None, REST)
            }
        };
        self.there |= kind;
        slot
    }

    /// Adds the forces, or potentials, between all pairs of sites to the sums of the tiles.
    pub(super) fn meet(&self, tiles: &mut Tiles, near: &NearTiles, quantity: Quantity) {
        const BOTH: u32 = LENNARD_JONES | INVERSE_SQUARE;
        const GRAVITY: u32 = INVERSE_SQUARE | SHARED;
        let mut form = self.there;
        form |= if self.mutual { 0 } else { ONE_SIDED };
        form |= if self.range.is_some() { 0 } else { SHARED };
        let mut parts = std::mem::take(&mut tiles.parts);
        let known = &*tiles;
        each_chunk(&mut parts, 1, |_, parts| {
            let Some(on) = parts.first_mut() else { return };
            on.clear(known.len());
            // The most common forms have loops of their own.
            dispatch!(level(), simd => match (quantity, form) {
                (Quantity::Potential, _) => self.meet_all::<_, { ALL | POTENTIAL }>(simd, known, near, on),
                (_, BOTH) => self.meet_all::<_, BOTH>(simd, known, near, on),
                (_, LENNARD_JONES) => self.meet_all::<_, LENNARD_JONES>(simd, known, near, on),
                (_, INVERSE_SQUARE) => self.meet_all::<_, INVERSE_SQUARE>(simd, known, near, on),
                (_, GRAVITY) => self.meet_all::<_, GRAVITY>(simd, known, near, on),
                _ => self.meet_all::<_, ALL>(simd, known, near, on),
            });
        });
        tiles.parts = parts;
        tiles.join();
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn meet_all<S: Simd, const FORM: u32>(
        &self,
        simd: S,
        tiles: &Tiles,
        near: &NearTiles,
        Part { tiles: own, sums }: &mut Part,
    ) {
        let zero = Eight::splat(simd, 0.0);
        let range = self.range.unwrap_or(Real::INFINITY);
        let laws = LawRegisters {
            range2: Eight::splat(simd, range * range),
            lennard_jones: self.lennard_jones,
            inverse_square: self.inverse_square,
            rest: &self.rest,
        };
        let (Range { start, end }, sums) = (own.clone(), &mut sums[..]);
        for tile in start..end {
            let [mut on, mut on_later] = [[zero; 3]; 2];
            let half = TileHalf::new(simd, tiles, tile, 0);
            let later_half = TileHalf::new(simd, tiles, tile, 2);
            let both = tiles.counts[tile] > 2;
            for other in near.of(tile, tiles.len()) {
                let other = *other as usize;
                let there = There::new(simd, tiles, tile, other);
                let mut back = half.meet::<FORM>(&laws, &there, &mut on);
                if both {
                    let more = later_half.meet::<FORM>(&laws, &there, &mut on_later);
                    for (back, more) in back.iter_mut().zip(more) {
                        *back += more;
                    }
                }
                // In a tile with itself each pair is visited from both sides, so there is no reaction to add.
                if FORM & POTENTIAL == 0 && tile != other {
                    subtract(simd, &mut sums[other - start], back);
                }
            }
            for axis in 0..3 {
                let [(a, b), (c, d)] = [on[axis].split(), on_later[axis].split()];
                for (lane, row) in [a, b, c, d].into_iter().enumerate() {
                    sums[tile - start][axis][lane] += total(row);
                }
            }
        }
    }
}

/// A copy of the laws that no write can alias, so that they stay in registers.
struct LawRegisters<'a, S: Simd> {
    range2: Eight<S>,
    lennard_jones: LennardJones,
    inverse_square: InverseSquare,
    rest: &'a [KernelLaw],
}

/// Subtracts from the sums of four sites the reactions of two sites of another tile.
#[cfg_attr(not(debug_assertions), inline(always))]
fn subtract<S: Simd>(simd: S, sums: &mut [Row; 3], back: [Eight<S>; 3]) {
    for (sum, back) in sums.iter_mut().zip(back) {
        let (a, b) = back.split();
        *sum = (Four::load_array(simd, *sum) - (a + b)).to_array();
    }
}

/// Returns true if any of two sites of a tile has a strength or weight in a law.
fn is_charged(charges: &[Row; 2], first: usize) -> bool {
    charges.iter().any(|row| row[first..first + 2] != [0.0; 2])
}

/// Strengths and weights of sites in one law.
type Charges<S> = [Eight<S>; 2];

/// The second tile of a pair.
struct There<'a, S: Simd> {
    point: [Eight<S>; 3],
    charges: [Charges<S>; 2],
    rest: &'a [[Row; 2]],
    bodies: Eight<S>,
    /// True if it may have sites of the same body as the first tile.
    may_share: bool,
    /// The factor of each pair in a potential: one half for a tile with itself, where pairs are visited twice.
    share: Real,
}

impl<'a, S: Simd> There<'a, S> {
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn new(simd: S, tiles: &'a Tiles, tile: usize, other: usize) -> Self {
        let [x, y, z] = &tiles.points[other];
        let charges = tiles.charges(other);
        There {
            point: [twice(simd, x), twice(simd, y), twice(simd, z)],
            charges: [
                [twice(simd, &charges[0][0]), twice(simd, &charges[0][1])],
                [twice(simd, &charges[1][0]), twice(simd, &charges[1][1])],
            ],
            rest: &charges[2..],
            bodies: twice(simd, &tiles.bodies[other]),
            may_share: tiles.bodies[tile][3] >= tiles.bodies[other][0],
            share: if tile == other { 0.5 } else { 1.0 },
        }
    }
}

/// Two sites of the first tile of a pair.
struct TileHalf<'a, S: Simd> {
    simd: S,
    point: [Eight<S>; 3],
    charges: [Charges<S>; 2],
    /// For each of the first two laws, true if a site has a charge in it. A hydrogen atom may have no charge in one
    /// of them.
    charged: [bool; 2],
    rest: &'a [[Row; 2]],
    bodies: Eight<S>,
    first: usize,
}

impl<S: Simd> TileHalf<'_, S> {
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn new(simd: S, tiles: &Tiles, tile: usize, first: usize) -> TileHalf<'_, S> {
        let [x, y, z] = &tiles.points[tile];
        let charges = tiles.charges(tile);
        TileHalf {
            simd,
            point: [
                spread(simd, x, first),
                spread(simd, y, first),
                spread(simd, z, first),
            ],
            charges: [
                [
                    spread(simd, &charges[0][0], first),
                    spread(simd, &charges[0][1], first),
                ],
                [
                    spread(simd, &charges[1][0], first),
                    spread(simd, &charges[1][1], first),
                ],
            ],
            charged: [
                is_charged(&charges[0], first),
                is_charged(&charges[1], first),
            ],
            rest: &charges[2..],
            bodies: spread(simd, &tiles.bodies[tile], first),
            first,
        }
    }

    /// Adds the forces of the other tile's sites to `on`, and returns the reactions on these sites, with the
    /// opposite sign.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn meet<const FORM: u32>(
        &self,
        laws: &LawRegisters<'_, S>,
        there: &There<'_, S>,
        on: &mut [Eight<S>; 3],
    ) -> [Eight<S>; 3] {
        let simd = self.simd;
        let dx = self.point[0] - there.point[0];
        let dy = self.point[1] - there.point[1];
        let dz = self.point[2] - there.point[2];
        let r2 = dx * dx + dy * dy + dz * dz;
        let mut acts = r2.simd_le(laws.range2);
        if FORM & SHARED != 0 && there.may_share {
            acts &= !there.bodies.simd_eq(self.bodies);
        }
        let zero = Eight::splat(simd, 0.0);
        let mut pull = PairPull::<S, FORM> {
            own: zero,
            other: zero,
            share: there.share,
        };
        let inverse = Eight::splat(simd, 1.0) / r2.sqrt();
        let inverse2 = inverse * inverse;
        if FORM & LENNARD_JONES != 0 && self.charged[0] {
            let value = if FORM & POTENTIAL != 0 {
                laws.lennard_jones.potential(r2, acts)
            } else {
                laws.lennard_jones.factor_of(inverse, inverse2)
            };
            pull.add(value, self.charges[0], there.charges[0]);
        }
        if FORM & INVERSE_SQUARE != 0 && self.charged[1] {
            let value = if FORM & POTENTIAL != 0 {
                laws.inverse_square.potential(r2, acts)
            } else {
                laws.inverse_square.factor_of(inverse, inverse2)
            };
            pull.add(value, self.charges[1], there.charges[1]);
        }
        if FORM & REST != 0 {
            for (law, (own, other)) in laws.rest.iter().zip(self.rest.iter().zip(there.rest)) {
                let value = if FORM & POTENTIAL != 0 {
                    law.potential(r2, acts)
                } else {
                    law.factor(r2, acts)
                };
                let own = [
                    spread(simd, &own[0], self.first),
                    spread(simd, &own[1], self.first),
                ];
                pull.add(value, own, [twice(simd, &other[0]), twice(simd, &other[1])]);
            }
        }
        let own = acts.select(pull.own, zero);
        if FORM & POTENTIAL != 0 {
            on[0] += own;
            return [zero; 3];
        }
        let other = if FORM & ONE_SIDED != 0 {
            acts.select(pull.other, zero)
        } else {
            own
        };
        on[0] += own * dx;
        on[1] += own * dy;
        on[2] += own * dz;
        [other * dx, other * dy, other * dz]
    }
}

/// The sums over laws of the factors of both sites of a pair. A factor times the offset between the sites is a force.
struct PairPull<S: Simd, const FORM: u32> {
    own: Eight<S>,
    other: Eight<S>,
    share: Real,
}

impl<S: Simd, const FORM: u32> PairPull<S, FORM> {
    /// Adds the value of a law. Selected, since it may be infinite where the pair is not coupled.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn add(&mut self, value: Eight<S>, own: Charges<S>, other: Charges<S>) {
        let zero = Eight::splat(value.simd, 0.0);
        let ([strength, weight], [their_strength, their_weight]) = (own, other);
        let mut on_own = weight * their_strength;
        if FORM & POTENTIAL != 0 {
            on_own = (on_own + strength * their_weight) * (0.5 * self.share);
        }
        self.own += on_own.simd_eq(zero).select(zero, value * on_own);
        if FORM & ONE_SIDED != 0 && FORM & POTENTIAL == 0 {
            let on_other = strength * their_weight;
            self.other += on_other.simd_eq(zero).select(zero, value * on_other);
        }
    }
}
