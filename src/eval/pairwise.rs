//! Radial fields of bodies on bodies: every pair of parts once, both ways.
//!
//! Most sources of a many-body scene sit where a sample sits: the field of an atom, sampled at
//! atoms. Then the law of a pair is worked out once and acts on both. Parts of one body, a cluster,
//! never act on each other, so pairs are sought between clusters. Each cluster fills whole lanes, so
//! that it can meet another where it stands; copying neighbours together to save lanes cost more
//! than it saved.

use std::ops::Range;

use super::kernel::Kernel;
use super::lanes::{Lanes, WIDTH, load, subtract};
use super::quantity::Quantity;
use crate::math::{Real, Vector};
use crate::neighbors::{Cluster, VerletList};
use crate::sample::Samples;

/// What is to be evaluated.
#[derive(Clone, Copy)]
pub(super) struct Pairs<'a> {
    pub samples: &'a Samples,
    /// Of each site as a source.
    pub strengths: &'a [Real],
    /// Of each site: what turns the vector of the field into a force.
    pub weights: &'a [Real],
    pub range: Option<Real>,
}

/// Evaluates one batch whose sources are samples; keeps its buffers and neighbours between calls.
#[derive(Debug, Default)]
pub(super) struct Pairwise {
    clusters: Vec<Cluster>,
    list: VerletList,
    /// The place of each part, and which sample it is.
    probe_of: Vec<(u32, u32)>,
    parts: Columns,
    /// The parts of the cluster that meets the others.
    own: Vec<Own>,
}

impl Pairwise {
    /// Adds the forces, or potentials, that the samples exert on each other.
    pub(super) fn run(
        &mut self,
        law: impl Kernel,
        pairs: Pairs<'_>,
        quantity: Quantity,
        sums: &mut [Vector],
    ) {
        match quantity {
            Quantity::Force => self.add::<false>(law, pairs, sums),
            Quantity::Potential => self.add::<true>(law, pairs, sums),
        }
    }

    fn add<const POTENTIAL: bool>(
        &mut self,
        law: impl Kernel,
        pairs: Pairs<'_>,
        sums: &mut [Vector],
    ) {
        self.collect(&pairs);
        if let Some(range) = pairs.range {
            self.list.refresh(&self.clusters, range);
        }
        for i in 0..self.clusters.len() {
            match pairs.range {
                Some(range) => self.meet_near::<POTENTIAL>(law, i, range),
                None => self.meet_all_later::<POTENTIAL>(law, i),
            }
        }
        for (place, sample) in &self.probe_of {
            sums[*sample as usize] += self.parts.sum_at(*place as usize);
        }
    }

    /// Takes up all samples that act or are acted on, as the parts of clusters.
    fn collect(&mut self, pairs: &Pairs<'_>) {
        self.clusters.clear();
        self.probe_of.clear();
        self.parts.clear();
        let mut body = None;
        let sides = pairs.strengths.iter().zip(pairs.weights);
        let samples = pairs.samples.list.iter().zip(sides).enumerate();
        for (number, (sample, (strength, weight))) in samples {
            if *strength == 0.0 && *weight == 0.0 {
                continue;
            }
            if body != Some(sample.body) {
                body = Some(sample.body);
                self.close_clump(pairs.range.is_some());
                self.clusters.push(Cluster {
                    centre: sample.world_point - sample.arm,
                    radius: 0.0,
                    start: self.parts.count as u32,
                    end: 0,
                });
            }
            if let Some(cluster) = self.clusters.last_mut() {
                cluster.radius = cluster.radius.max(sample.arm.length());
            }
            self.probe_of.push((self.parts.count as u32, number as u32));
            self.parts.push(sample.world_point, *strength, *weight);
        }
        self.close_clump(pairs.range.is_some());
        self.parts.finish();
    }

    /// Ends the last cluster; if clusters are to meet one by one, fills it up to whole lanes with
    /// parts that neither act nor are acted on.
    fn close_clump(&mut self, fill: bool) {
        let Some(cluster) = self.clusters.last_mut() else {
            return;
        };
        let count = self.parts.count - cluster.start as usize;
        let wanted = if fill {
            count.next_multiple_of(WIDTH)
        } else {
            count
        };
        (count..wanted).for_each(|_| self.parts.push(Vector::ZERO, 0.0, 0.0));
        cluster.end = self.parts.count as u32;
    }

    /// Lets a cluster meet the later ones that are in range.
    fn meet_near<const POTENTIAL: bool>(&mut self, law: impl Kernel, i: usize, range: Real) {
        let cluster = self.clusters[i];
        self.take_own(&cluster);
        for j in self.list.later(i) {
            let other = &self.clusters[*j as usize];
            if may_reach(&cluster, other, range) {
                let there = other.start as usize..other.end as usize;
                self.parts
                    .meet::<POTENTIAL>(law, &mut self.own, there, range * range);
            }
        }
        self.put_own(&cluster);
    }

    /// Lets a cluster meet all later ones, which stand side by side already.
    fn meet_all_later<const POTENTIAL: bool>(&mut self, law: impl Kernel, i: usize) {
        let cluster = self.clusters[i];
        self.take_own(&cluster);
        let later = cluster.end as usize..self.parts.count;
        self.parts
            .meet::<POTENTIAL>(law, &mut self.own, later, Real::INFINITY);
        self.put_own(&cluster);
    }

    fn take_own(&mut self, cluster: &Cluster) {
        let places = cluster.start as usize..cluster.end as usize;
        self.own.clear();
        self.own.extend(places.map(|place| self.parts.own(place)));
    }

    fn put_own(&mut self, cluster: &Cluster) {
        for (own, place) in self.own.iter().zip(cluster.start as usize..) {
            self.parts.add(place, own.sum());
        }
    }
}

/// Whether any parts of two clusters can be within range of each other.
fn may_reach(cluster: &Cluster, other: &Cluster, range: Real) -> bool {
    // A hair of slack: rounding must not lose parts exactly at the range.
    let reach = range * 1.0001 + cluster.radius + other.radius;
    (cluster.centre - other.centre).length_squared() <= reach * reach
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
