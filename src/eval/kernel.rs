//! Radial laws on several lanes at once.

use super::lanes::Lanes;
use crate::field::{Profile, Radial};
use crate::math::{Real, from_f64, to_f64};

/// A radial law of strength one on lanes.
pub(super) trait Kernel: Copy {
    /// s with F = s d, given r².
    fn factor(self, r2: Lanes) -> Lanes;
    /// U, given r².
    fn potential(self, r2: Lanes) -> Lanes;
}

/// The laws that have a kernel of their own, and the rest.
pub(super) enum Law {
    InverseSquare(InverseSquare),
    LennardJones(LennardJones),
    Other(Other),
}

impl Law {
    pub(super) fn new(law: &Radial) -> Self {
        match law.profile {
            _ if !law.is_plain() => Law::Other(Other { law: *law }),
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
pub(super) struct InverseSquare {
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
pub(super) struct Other {
    law: Radial,
}

impl Other {
    fn each(r2: Lanes, value: impl Fn(f64) -> f64) -> Lanes {
        Lanes::new(r2.to_array().map(|r2| from_f64(value(to_f64(r2)))))
    }
}

impl Kernel for Other {
    fn factor(self, r2: Lanes) -> Lanes {
        Self::each(r2, |r2| self.law.factor(r2))
    }

    fn potential(self, r2: Lanes) -> Lanes {
        // Laws without a potential are not asked for it.
        Self::each(r2, |r2| self.law.potential_at(r2).unwrap_or(f64::NAN))
    }
}
