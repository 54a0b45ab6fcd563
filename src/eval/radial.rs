//! Batches of radial fields: every probe against every source in range, several at a time.

use super::grid::Grid;
use super::lanes::{Lanes, WIDTH, counting, load};
use super::probe::{Moment, Probes, owner};
use crate::compile::{IndexKind, RadialBatch};
use crate::field::{Frame, Profile, Radial};
use crate::math::{Real, Vector};

/// Sources sorted for one evaluation, as separate arrays padded to whole [`Lanes`].
#[derive(Debug, Default)]
pub(super) struct Sources {
    points: Vec<Vector>,
    kept: Vec<(Real, Real)>,
    x: Vec<Real>,
    y: Vec<Real>,
    z: Vec<Real>,
    strength: Vec<Real>,
    owner: Vec<Real>,
    grid: Grid,
}

/// What is summed over the sources.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Force,
    /// The potential, in x; half of it where the source belongs to a body, because the body it
    /// acts on has a field that acts back.
    Potential,
}

impl Sources {
    /// Takes the sources whose anchors are there, and sorts them into a grid if the plan says so.
    fn gather(&mut self, batch: &RadialBatch, frames: &[Option<Frame>], quantity: Quantity) {
        self.points.clear();
        self.kept.clear();
        for source in &batch.sources {
            let Some(frame) = &frames[source.anchor as usize] else {
                continue;
            };
            let shared = quantity == Quantity::Potential && frame.body.is_some();
            let strength = if shared {
                source.strength * 0.5
            } else {
                source.strength
            };
            self.points.push(frame.pose.translation);
            self.kept.push((strength, owner(frame.body)));
        }
        for array in [&mut self.x, &mut self.y, &mut self.z] {
            array.clear();
        }
        self.strength.clear();
        self.owner.clear();
        match batch.range {
            Some(range) if batch.index_kind() == IndexKind::Grid => {
                // Half the range: finer cells fit the ball better than they cost in ranges.
                self.grid.build(&self.points, range * 0.5);
                for place in 0..self.points.len() {
                    self.push(self.grid.order()[place] as usize);
                }
            }
            _ => (0..self.points.len()).for_each(|place| self.push(place)),
        }
        for array in [&mut self.x, &mut self.y, &mut self.z] {
            array.extend([0.0; WIDTH]);
        }
        self.strength.extend([0.0; WIDTH]);
        self.owner.extend([0.0; WIDTH]);
    }

    fn push(&mut self, source: usize) {
        let (point, (strength, owner)) = (self.points[source], self.kept[source]);
        self.x.push(point.x);
        self.y.push(point.y);
        self.z.push(point.z);
        self.strength.push(strength);
        self.owner.push(owner);
    }

    /// Adds the batch's forces (or potentials) on every probe.
    pub(super) fn add(
        &mut self,
        batch: &RadialBatch,
        frames: &[Option<Frame>],
        probes: &Probes,
        moment: Moment,
        quantity: Quantity,
        sums: &mut [Vector],
    ) {
        self.gather(batch, frames, quantity);
        let law = Law::new(&batch.law);
        match law {
            Law::InverseSquare(law) => self.add_all(law, batch, probes, moment, quantity, sums),
            Law::LennardJones(law) => self.add_all(law, batch, probes, moment, quantity, sums),
            Law::Other(law) => self.add_all(law, batch, probes, moment, quantity, sums),
        }
    }

    fn add_all(
        &self,
        law: impl Kernel,
        batch: &RadialBatch,
        probes: &Probes,
        moment: Moment,
        quantity: Quantity,
        sums: &mut [Vector],
    ) {
        for (probe, sum) in probes.list.iter().zip(sums) {
            let weight = probes.weight(probe, &batch.weighting, moment);
            // Probes that are not coupled are left out; so is what they would cost.
            if weight == 0.0 {
                continue;
            }
            let mut seen = Accumulator::new(probe.world_point, probe.owner, batch.range, quantity);
            match batch.range {
                Some(range) if batch.index_kind() == IndexKind::Grid => {
                    for run in self.grid.near(probe.world_point, range) {
                        seen.add(self, law, run.start, run.end);
                    }
                }
                _ => seen.add(self, law, 0, self.points.len()),
            }
            *sum += seen.total() * weight;
        }
    }
}

/// The sum over sources at one probe.
struct Accumulator {
    point: [Lanes; 3],
    owner: Lanes,
    range2: Lanes,
    counting: Lanes,
    quantity: Quantity,
    sum: [Lanes; 3],
}

impl Accumulator {
    fn new(point: Vector, owner: Real, range: Option<Real>, quantity: Quantity) -> Self {
        let range = range.unwrap_or(Real::INFINITY);
        Accumulator {
            point: point.to_array().map(Lanes::splat),
            owner: Lanes::splat(owner),
            range2: Lanes::splat(range * range),
            counting: counting(),
            quantity,
            sum: [Lanes::splat(0.0); 3],
        }
    }

    /// Adds the sources at places `start..end`.
    fn add(&mut self, sources: &Sources, law: impl Kernel, start: usize, end: usize) {
        for at in (start..end).step_by(WIDTH) {
            let dx = self.point[0] - load(&sources.x, at);
            let dy = self.point[1] - load(&sources.y, at);
            let dz = self.point[2] - load(&sources.z, at);
            let r2 = dx * dx + dy * dy + dz * dz;
            let left = Lanes::splat((end - at) as Real);
            let acts = r2.simd_le(self.range2)
                & load(&sources.owner, at).simd_ne(self.owner)
                & self.counting.simd_lt(left);
            if !acts.any() {
                continue;
            }
            let strength = load(&sources.strength, at);
            match self.quantity {
                Quantity::Force => {
                    // Masked bit by bit: what does not act may be infinite or NaN.
                    let factor = acts & (strength * law.factor(r2));
                    self.sum[0] += factor * (acts & dx);
                    self.sum[1] += factor * (acts & dy);
                    self.sum[2] += factor * (acts & dz);
                }
                Quantity::Potential => self.sum[0] += acts & (strength * law.potential(r2)),
            }
        }
    }

    fn total(&self) -> Vector {
        let [x, y, z] = self.sum.map(Lanes::reduce_add);
        Vector::new(x, y, z)
    }
}

/// A radial law of strength one on lanes.
trait Kernel: Copy {
    /// s with F = s d, given r².
    fn factor(self, r2: Lanes) -> Lanes;
    /// U, given r².
    fn potential(self, r2: Lanes) -> Lanes;
}

/// The laws that have a kernel of their own, and the rest.
enum Law {
    InverseSquare(InverseSquare),
    LennardJones(LennardJones),
    Other(Other),
}

impl Law {
    fn new(law: &Radial) -> Self {
        match law.profile {
            Profile::Power {
                power: -2.0,
                softening: 0.0,
                ..
            } => {
                let inverse = law.shifted_at.map_or(0.0, Real::recip);
                Law::InverseSquare(InverseSquare {
                    shift: inverse * inverse,
                    offset: inverse * 2.0,
                })
            }
            Profile::LennardJones { sigma, .. } => Law::LennardJones(LennardJones::new(law, sigma)),
            _ => Law::Other(Other { law: *law }),
        }
    }
}

/// s = 1/r³ − shift/r, U = 1/r + shift r − offset.
#[derive(Clone, Copy)]
struct InverseSquare {
    shift: Real,
    offset: Real,
}

impl Kernel for InverseSquare {
    #[inline]
    fn factor(self, r2: Lanes) -> Lanes {
        let inverse = Lanes::splat(1.0) / r2.sqrt();
        inverse * (inverse * inverse - Lanes::splat(self.shift))
    }

    #[inline]
    fn potential(self, r2: Lanes) -> Lanes {
        let r = r2.sqrt();
        Lanes::splat(1.0) / r + r * Lanes::splat(self.shift) - Lanes::splat(self.offset)
    }
}

/// s = 24 (2 (σ/r)¹² − (σ/r)⁶)/r² − slope/r, U = 4 ((σ/r)¹² − (σ/r)⁶) + slope r − offset.
#[derive(Clone, Copy)]
struct LennardJones {
    sigma2: Real,
    slope: Real,
    offset: Real,
}

impl LennardJones {
    fn new(law: &Radial, sigma: Real) -> Self {
        use crate::math::{from_f64, to_f64};
        let (slope, offset) = law.shifted_at.map_or((0.0, 0.0), |cutoff| {
            let cutoff = to_f64(cutoff);
            let plain = Radial {
                shifted_at: None,
                ..*law
            };
            let slope = plain.factor(cutoff * cutoff) * cutoff;
            (slope, plain.potential(cutoff * cutoff) + cutoff * slope)
        });
        LennardJones {
            sigma2: sigma * sigma,
            slope: from_f64(slope),
            offset: from_f64(offset),
        }
    }
}

impl Kernel for LennardJones {
    #[inline]
    fn factor(self, r2: Lanes) -> Lanes {
        let inverse2 = Lanes::splat(1.0) / r2;
        let s2 = Lanes::splat(self.sigma2) * inverse2;
        let s6 = s2 * s2 * s2;
        let plain = Lanes::splat(24.0) * inverse2 * s6 * (s6 + s6 - Lanes::splat(1.0));
        // One branch for the batch, not for the pair: the compiler hoists it.
        if self.slope == 0.0 {
            return plain;
        }
        plain - Lanes::splat(self.slope) * inverse2.sqrt()
    }

    #[inline]
    fn potential(self, r2: Lanes) -> Lanes {
        let s2 = Lanes::splat(self.sigma2) / r2;
        let s6 = s2 * s2 * s2;
        let plain = Lanes::splat(4.0) * s6 * (s6 - Lanes::splat(1.0));
        plain + Lanes::splat(self.slope) * r2.sqrt() - Lanes::splat(self.offset)
    }
}

/// Any law, one lane after the other, by its definition.
#[derive(Clone, Copy)]
struct Other {
    law: Radial,
}

impl Other {
    fn each(r2: Lanes, value: impl Fn(f64) -> f64) -> Lanes {
        use crate::math::{from_f64, to_f64};
        Lanes::new(r2.to_array().map(|r2| from_f64(value(to_f64(r2)))))
    }
}

impl Kernel for Other {
    fn factor(self, r2: Lanes) -> Lanes {
        Self::each(r2, |r2| self.law.factor(r2))
    }

    fn potential(self, r2: Lanes) -> Lanes {
        Self::each(r2, |r2| self.law.potential(r2))
    }
}
