//! Radial laws on several lanes at once, for pairs of samples and sources.

use fearless_simd::{Simd, SimdMask};

use super::lanes::RealLanes;
use crate::field::{Profile, Radial};
use crate::math::{Real, from_f64, to_f64};
use crate::number::lanes_of;

/// A radial law of strength one on lanes.
pub(super) trait Kernel: Copy {
    /// The factor s in F = s d, from r². Lanes that are not set in `acts` may hold anything.
    fn factor<S: Simd, V: RealLanes<S>>(self, r2: V, acts: V::Mask) -> V;
    /// The potential U, from r², under the same condition.
    fn potential<S: Simd, V: RealLanes<S>>(self, r2: V, acts: V::Mask) -> V;
}

/// The laws with kernels of their own, and all others.
#[derive(Clone, Copy, Debug)]
pub(super) enum KernelLaw {
    InverseSquare(InverseSquare),
    Softened(Softened),
    LennardJones(LennardJones),
    Other(Other),
}

/// Evaluates an expression with the kernel of a law under the given name; it is compiled once per kernel type.
macro_rules! with_kernel {
    ($law:expr, $kernel:ident => $result:expr) => {
        match $law {
            KernelLaw::InverseSquare($kernel) => $result,
            KernelLaw::Softened($kernel) => $result,
            KernelLaw::LennardJones($kernel) => $result,
            KernelLaw::Other($kernel) => $result,
        }
    };
}
pub(super) use with_kernel;

impl KernelLaw {
    pub(super) fn new(law: &Radial) -> Self {
        match law.profile {
            _ if !law.is_plain() => Self::Other(Other { law: *law }),
            Profile::Power {
                power: -2.0,
                softening: 0.0,
                ..
            } => {
                let inverse = law.shifted_at.map_or(0.0, Real::recip);
                Self::InverseSquare(InverseSquare {
                    shift: inverse * inverse,
                    offset: inverse * 2.0,
                })
            }
            Profile::Power {
                power: -2.0,
                softening,
                ..
            } if law.shifted_at.is_none() && Softened::is_sound(softening) => {
                Self::Softened(Softened {
                    softening2: softening * softening,
                })
            }
            Profile::LennardJones { sigma, .. } => {
                Self::LennardJones(LennardJones::new(law, sigma))
            }
            _ => Self::Other(Other { law: *law }),
        }
    }
}

impl Kernel for KernelLaw {
    #[inline(always)]
    fn factor<S: Simd, V: RealLanes<S>>(self, r2: V, acts: V::Mask) -> V {
        with_kernel!(self, law => law.factor(r2, acts))
    }

    #[inline(always)]
    fn potential<S: Simd, V: RealLanes<S>>(self, r2: V, acts: V::Mask) -> V {
        with_kernel!(self, law => law.potential(r2, acts))
    }
}

/// s = 1/r³ − shift/r, U = 1/r + shift r − offset.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InverseSquare {
    shift: Real,
    offset: Real,
}

impl InverseSquare {
    /// The factor, from 1/r and 1/r².
    #[inline(always)]
    pub(super) fn factor_of<S: Simd, V: RealLanes<S>>(self, inverse: V, inverse2: V) -> V {
        inverse * (inverse2 - self.shift)
    }
}

impl Kernel for InverseSquare {
    #[inline(always)]
    fn factor<S: Simd, V: RealLanes<S>>(self, r2: V, _: V::Mask) -> V {
        let inverse = V::splat(r2.token(), 1.0) / r2.sqrt();
        self.factor_of(inverse, inverse * inverse)
    }

    #[inline(always)]
    fn potential<S: Simd, V: RealLanes<S>>(self, r2: V, _: V::Mask) -> V {
        let r = r2.sqrt();
        V::splat(r2.token(), 1.0) / r + r * self.shift - self.offset
    }
}

/// s = 1/ρ³, U = 1/ρ, with ρ² = r² + ε².
#[derive(Clone, Copy, Debug)]
pub(super) struct Softened {
    softening2: Real,
}

impl Softened {
    /// Returns true if s is finite at any distance.
    fn is_sound(softening: Real) -> bool {
        let inverse = softening.recip();
        (inverse * inverse * inverse).is_finite() && (softening * softening).is_normal()
    }
}

impl Kernel for Softened {
    #[inline(always)]
    fn factor<S: Simd, V: RealLanes<S>>(self, r2: V, acts: V::Mask) -> V {
        let inverse = self.potential(r2, acts);
        inverse * inverse * inverse
    }

    #[inline(always)]
    fn potential<S: Simd, V: RealLanes<S>>(self, r2: V, _: V::Mask) -> V {
        V::splat(r2.token(), 1.0) / (r2 + self.softening2).sqrt()
    }
}

/// s = 24 (2 (σ/r)¹² − (σ/r)⁶)/r² − slope/r, U = 4 ((σ/r)¹² − (σ/r)⁶) + slope r − offset.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LennardJones {
    sigma2: Real,
    slope: Real,
    offset: Real,
}

impl LennardJones {
    fn new(law: &Radial, sigma: Real) -> Self {
        let (slope, offset) = law.shifted_at.map_or((0.0, 0.0), |cutoff| {
            let cutoff = to_f64(cutoff);
            let plain = Radial {
                shifted_at: None,
                ..*law
            };
            let slope = plain.factor(cutoff * cutoff) * cutoff;
            let at_cutoff = plain.potential_at(cutoff * cutoff).unwrap_or(0.0);
            (slope, at_cutoff + cutoff * slope)
        });
        LennardJones {
            sigma2: sigma * sigma,
            slope: from_f64(slope),
            offset: from_f64(offset),
        }
    }

    /// The factor, from 1/r and 1/r².
    #[inline(always)]
    pub(super) fn factor_of<S: Simd, V: RealLanes<S>>(self, inverse: V, inverse2: V) -> V {
        let s2 = inverse2 * self.sigma2;
        let s6 = s2 * s2 * s2;
        inverse2 * 24.0 * s6 * (s6 + s6 - 1.0) - inverse * self.slope
    }
}

impl Kernel for LennardJones {
    #[inline(always)]
    fn factor<S: Simd, V: RealLanes<S>>(self, r2: V, _: V::Mask) -> V {
        let inverse2 = V::splat(r2.token(), 1.0) / r2;
        self.factor_of(inverse2.sqrt(), inverse2)
    }

    #[inline(always)]
    fn potential<S: Simd, V: RealLanes<S>>(self, r2: V, _: V::Mask) -> V {
        let s2 = V::splat(r2.token(), self.sigma2) / r2;
        let s6 = s2 * s2 * s2;
        s6 * 4.0 * (s6 - 1.0) + r2.sqrt() * self.slope - self.offset
    }
}

/// Any other law: its definition in `f64`, lane by lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Other {
    law: Radial,
}

impl Other {
    // Not inlined: it is compiled once, so its bits do not depend on the caller's instruction set.
    #[inline(never)]
    fn factor_at(&self, r2: Real) -> Real {
        from_f64(self.law.factor(to_f64(r2)))
    }

    #[inline(never)]
    fn potential_at(&self, r2: Real) -> Real {
        // Only called for laws with a potential.
        from_f64(self.law.potential_at(to_f64(r2)).unwrap_or(f64::NAN))
    }
}

impl Kernel for Other {
    #[inline(always)]
    fn factor<S: Simd, V: RealLanes<S>>(self, r2: V, acts: V::Mask) -> V {
        each(
            r2,
            acts,
            #[inline(always)]
            |r2| self.factor_at(r2),
        )
    }

    #[inline(always)]
    fn potential<S: Simd, V: RealLanes<S>>(self, r2: V, acts: V::Mask) -> V {
        each(
            r2,
            acts,
            #[inline(always)]
            |r2| self.potential_at(r2),
        )
    }
}

/// A function of the lanes that are set in `acts`; zero in the others.
#[inline(always)]
fn each<S: Simd, V: RealLanes<S>>(r2: V, acts: V::Mask, number: impl Fn(Real) -> Real) -> V {
    let mut lanes = V::splat(r2.token(), 0.0);
    for lane in lanes_of(acts.to_bitmask()) {
        lanes[lane] = number(r2[lane]);
    }
    lanes
}
