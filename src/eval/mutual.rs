//! Radial fields of bodies on bodies: every pair of parts once, both ways.
//!
//! Most sources of a many-body scene sit where a probe sits: the field of an atom, sampled at
//! atoms. Then the law of a pair is worked out once and acts on both. Parts of one body, a clump,
//! never act on each other, so pairs are sought between clumps. Each clump fills whole lanes, so
//! that it can meet another where it stands; copying neighbours together to save lanes cost more
//! than it saved.

use std::ops::Range;

use super::kernel::Kernel;
use super::lanes::{Lanes, WIDTH, load, subtract};
use super::pairs::{Clump, PairList};
use super::probe::Probes;
use crate::math::{Real, Vector};

/// What is to be evaluated.
#[derive(Clone, Copy)]
pub(super) struct Pairs<'a> {
    pub probes: &'a Probes,
    /// Of each site as a source.
    pub strengths: &'a [Real],
    /// Of each site: what turns the vector of the field into a force.
    pub weights: &'a [Real],
    pub range: Option<Real>,
}

/// Evaluates one batch whose sources are probes; keeps its buffers and neighbours between calls.
#[derive(Debug, Default)]
pub(super) struct Mutual {
    clumps: Vec<Clump>,
    list: PairList,
    /// The place of each part, and which probe it is.
    probe_of: Vec<(u32, u32)>,
    parts: Columns,
    /// The parts of the clump that meets the others.
    own: Vec<Own>,
}

impl Mutual {
    /// Adds the forces (or with `POTENTIAL`, potentials) that the probes exert on each other.
    pub(super) fn add<const POTENTIAL: bool>(
        &mut self,
        law: impl Kernel,
        pairs: Pairs<'_>,
        sums: &mut [Vector],
    ) {
        self.collect(&pairs);
        if let Some(range) = pairs.range {
            self.list.refresh(&self.clumps, range);
        }
        for i in 0..self.clumps.len() {
            match pairs.range {
                Some(range) => self.meet_near::<POTENTIAL>(law, i, range),
                None => self.meet_all_later::<POTENTIAL>(law, i),
            }
        }
        for (place, probe) in &self.probe_of {
            sums[*probe as usize] += self.parts.sum_at(*place as usize);
        }
    }

    /// Takes up all probes that act or are acted on, as the parts of clumps.
    fn collect(&mut self, pairs: &Pairs<'_>) {
        self.clumps.clear();
        self.probe_of.clear();
        self.parts.clear();
        let mut body = None;
        let sides = pairs.strengths.iter().zip(pairs.weights);
        let probes = pairs.probes.list.iter().zip(sides).enumerate();
        for (number, (probe, (strength, weight))) in probes {
            if *strength == 0.0 && *weight == 0.0 {
                continue;
            }
            if body != Some(probe.body) {
                body = Some(probe.body);
                self.close_clump(pairs.range.is_some());
                self.clumps.push(Clump {
                    centre: probe.world_point - probe.arm,
                    radius: 0.0,
                    start: self.parts.count as u32,
                    end: 0,
                });
            }
            if let Some(clump) = self.clumps.last_mut() {
                clump.radius = clump.radius.max(probe.arm.length());
            }
            self.probe_of.push((self.parts.count as u32, number as u32));
            self.parts.push(probe.world_point, *strength, *weight);
        }
        self.close_clump(pairs.range.is_some());
        self.parts.finish();
    }

    /// Ends the last clump; if clumps are to meet one by one, fills it up to whole lanes with
    /// parts that neither act nor are acted on.
    fn close_clump(&mut self, fill: bool) {
        let Some(clump) = self.clumps.last_mut() else {
            return;
        };
        let count = self.parts.count - clump.start as usize;
        let wanted = if fill {
            count.next_multiple_of(WIDTH)
        } else {
            count
        };
        (count..wanted).for_each(|_| self.parts.push(Vector::ZERO, 0.0, 0.0));
        clump.end = self.parts.count as u32;
    }

    /// Lets a clump meet the later ones that are in range.
    fn meet_near<const POTENTIAL: bool>(&mut self, law: impl Kernel, i: usize, range: Real) {
        let clump = self.clumps[i];
        self.take_own(&clump);
        for j in self.list.later(i) {
            let other = &self.clumps[*j as usize];
            if may_reach(&clump, other, range) {
                let there = other.start as usize..other.end as usize;
                self.parts
                    .meet::<POTENTIAL>(law, &mut self.own, there, range * range);
            }
        }
        self.put_own(&clump);
    }

    /// Lets a clump meet all later ones, which stand side by side already.
    fn meet_all_later<const POTENTIAL: bool>(&mut self, law: impl Kernel, i: usize) {
        let clump = self.clumps[i];
        self.take_own(&clump);
        let later = clump.end as usize..self.parts.count;
        self.parts
            .meet::<POTENTIAL>(law, &mut self.own, later, Real::INFINITY);
        self.put_own(&clump);
    }

    fn take_own(&mut self, clump: &Clump) {
        let places = clump.start as usize..clump.end as usize;
        self.own.clear();
        self.own.extend(places.map(|place| self.parts.own(place)));
    }

    fn put_own(&mut self, clump: &Clump) {
        for (own, place) in self.own.iter().zip(clump.start as usize..) {
            self.parts.add(place, own.sum());
        }
    }
}

/// Whether any parts of two clumps can be within range of each other.
fn may_reach(clump: &Clump, other: &Clump, range: Real) -> bool {
    // A hair of slack: rounding must not lose parts exactly at the range.
    let reach = range * 1.0001 + clump.radius + other.radius;
    (clump.centre - other.centre).length_squared() <= reach * reach
}

/// One part that meets others, the same in every lane, and lane by lane what they do to it.
#[derive(Clone, Copy, Debug)]
struct Own {
    x: Lanes,
    y: Lanes,
    z: Lanes,
    strength: Lanes,
    weight: Lanes,
    on: [Lanes; 3],
}

impl Own {
    fn sum(&self) -> Vector {
        let [x, y, z] = self.on;
        Vector::new(x.reduce_add(), y.reduce_add(), z.reduce_add())
    }
}

/// Parts as separate arrays, longer than needed by whole [`Lanes`], with the sums of what acts on
/// them.
#[derive(Debug, Default)]
struct Columns {
    /// x, y, z, strength, weight.
    given: [Vec<Real>; 5],
    sum: [Vec<Real>; 3],
    count: usize,
}

const STRENGTH: usize = 3;
const WEIGHT: usize = 4;

impl Columns {
    fn clear(&mut self) {
        self.count = 0;
    }

    fn push(&mut self, point: Vector, strength: Real, weight: Real) {
        self.make_room(1);
        let values = [point.x, point.y, point.z, strength, weight];
        for (column, value) in self.given.iter_mut().zip(values) {
            column[self.count] = value;
        }
        self.count += 1;
    }

    /// Room for that many more, and for whole lanes behind them.
    fn make_room(&mut self, more: usize) {
        let needed = self.count + more + WIDTH;
        if self.given[0].len() < needed {
            for column in &mut self.given {
                column.resize(needed * 2, 0.0);
            }
        }
    }

    /// Sums of zero, once all parts are there, and behind them lanes that do not act.
    fn finish(&mut self) {
        self.make_room(0);
        for side in [STRENGTH, WEIGHT] {
            self.given[side][self.count..self.count + WIDTH].fill(0.0);
        }
        for sum in &mut self.sum {
            sum.clear();
            sum.resize(self.count + WIDTH, 0.0);
        }
    }

    fn own(&self, place: usize) -> Own {
        let [x, y, z, strength, weight] = &self.given;
        Own {
            x: Lanes::splat(x[place]),
            y: Lanes::splat(y[place]),
            z: Lanes::splat(z[place]),
            strength: Lanes::splat(strength[place]),
            weight: Lanes::splat(weight[place]),
            on: [Lanes::splat(0.0); 3],
        }
    }

    fn sum_at(&self, place: usize) -> Vector {
        let [x, y, z] = &self.sum;
        Vector::new(x[place], y[place], z[place])
    }

    fn add(&mut self, place: usize, sum: Vector) {
        self.sum[0][place] += sum.x;
        self.sum[1][place] += sum.y;
        self.sum[2][place] += sum.z;
    }

    /// Lets some parts meet a range of the columns: adds what either does to the other.
    fn meet<const POTENTIAL: bool>(
        &mut self,
        law: impl Kernel,
        own: &mut [Own],
        there: Range<usize>,
        range2: Real,
    ) {
        let [x, y, z, strengths, weights] = &self.given;
        let [sum_x, sum_y, sum_z] = &mut self.sum;
        let (range2, zero) = (Lanes::splat(range2), Lanes::splat(0.0));
        for at in there.step_by(WIDTH) {
            let (x, y, z) = (load(x, at), load(y, at), load(z, at));
            let (strength, weight) = (load(strengths, at), load(weights, at));
            let mut on = [zero; 3];
            for own in &mut *own {
                let (dx, dy, dz) = (own.x - x, own.y - y, own.z - z);
                let r2 = dx * dx + dy * dy + dz * dz;
                let acts = r2.simd_le(range2);
                let on_own = strength * own.weight;
                let on_others = own.strength * weight;
                // Masked bit by bit: what does not act, or is not coupled, may be infinite.
                if POTENTIAL {
                    let both = (on_own + on_others) * Lanes::splat(0.5);
                    own.on[0] += acts & both.simd_ne(zero) & (both * law.potential(r2));
                    continue;
                }
                let factor = acts & law.factor(r2);
                let to_own = on_own.simd_ne(zero) & (factor * on_own);
                let to_others = on_others.simd_ne(zero) & (factor * on_others);
                own.on[0] += to_own * dx;
                own.on[1] += to_own * dy;
                own.on[2] += to_own * dz;
                on[0] += to_others * dx;
                on[1] += to_others * dy;
                on[2] += to_others * dz;
            }
            if !POTENTIAL {
                subtract(sum_x, at, on[0]);
                subtract(sum_y, at, on[1]);
                subtract(sum_z, at, on[2]);
            }
        }
    }
}
