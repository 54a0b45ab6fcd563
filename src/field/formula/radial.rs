//! Forces along the line through the field's origin.

use crate::field::error::{TreeError, bad, finite, positive};
use crate::math::{DVec3, Real, to_f64};

/// A force d/r · (f(r) − f(r_c)) for the distance vector d from the field's origin, |d| = r.
///
/// Without a cutoff the second term is absent. With one it makes the force continuous at the
/// cutoff r_c ("shifted force"; Allen & Tildesley, Computer Simulation of Liquids, §1.6.3): the
/// potential becomes U(r) − U(r_c) + (r − r_c) f(r_c).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Radial {
    /// The profile f(r), positive outward.
    pub profile: Profile,
    /// r_c, the distance at which the force is brought to zero.
    pub shifted_at: Option<Real>,
}

/// A force along the line as a function f of the distance r, positive outward.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Profile {
    /// f = k r ρⁿ⁻¹ with ρ² = r² + ε²; unsoftened, f = k rⁿ. Potential −k ρⁿ⁺¹/(n + 1), and
    /// −k ln ρ for n = −1. Singular at r = 0 for n < 0 without softening.
    Power {
        /// k: positive pushes outward, negative pulls in.
        strength: Real,
        /// n.
        power: Real,
        /// ε (Plummer softening).
        softening: Real,
    },
    /// U = 4 ε ((σ/r)¹² − (σ/r)⁶), f = −dU/dr. Singular at r = 0.
    LennardJones {
        /// ε, the depth of the well.
        epsilon: Real,
        /// σ, the distance at which the potential is zero.
        sigma: Real,
    },
}

impl Radial {
    /// The factor s with F = s d, given r².
    pub(crate) fn factor(&self, r2: f64) -> f64 {
        let inner = self.profile.factor(r2);
        match self.shifted_at {
            // At the very centre the direction is undefined, and the shift pushes nowhere.
            Some(cutoff) if r2 != 0.0 => inner - self.profile.force(to_f64(cutoff)) / r2.sqrt(),
            _ => inner,
        }
    }

    /// The potential, given r².
    pub(crate) fn potential(&self, r2: f64) -> f64 {
        let inner = self.profile.potential(r2);
        match self.shifted_at.map(to_f64) {
            Some(cutoff) => {
                let slope = self.profile.force(cutoff);
                inner - self.profile.potential(cutoff * cutoff) + (r2.sqrt() - cutoff) * slope
            }
            None => inner,
        }
    }

    pub(crate) fn kind(&self) -> &'static str {
        match self.profile {
            Profile::Power { .. } => "radial",
            Profile::LennardJones { .. } => "Lennard-Jones",
        }
    }

    pub(crate) fn validate(&self, field: &str) -> Result<(), TreeError> {
        if let Some(cutoff) = self.shifted_at {
            positive(field, "the cutoff", cutoff)?;
        }
        match self.profile {
            Profile::Power {
                strength,
                power,
                softening,
            } => {
                finite(field, "the strength", strength)?;
                finite(field, "the power", power)?;
                if softening >= 0.0 && softening.is_finite() {
                    return Ok(());
                }
                let range = "zero or more, and finite";
                Err(bad(field, "the softening", range, to_f64(softening)))
            }
            Profile::LennardJones { epsilon, sigma } => {
                finite(field, "epsilon", epsilon)?;
                positive(field, "sigma", sigma)
            }
        }
    }
}

impl Profile {
    /// f(r).
    fn force(&self, r: f64) -> f64 {
        self.factor(r * r) * r
    }

    /// f(r)/r.
    fn factor(&self, r2: f64) -> f64 {
        match *self {
            Profile::Power {
                strength,
                power,
                softening,
            } => {
                let rho2 = r2 + to_f64(softening) * to_f64(softening);
                // At the very centre the direction is undefined, so what is not singular there
                // pushes nowhere.
                if rho2 == 0.0 && power >= 0.0 {
                    return 0.0;
                }
                to_f64(strength) * rho2.powf((to_f64(power) - 1.0) / 2.0)
            }
            Profile::LennardJones { epsilon, sigma } => {
                let s2 = to_f64(sigma) * to_f64(sigma) / r2;
                let s6 = s2 * s2 * s2;
                24.0 * to_f64(epsilon) * (2.0 * s6 * s6 - s6) / r2
            }
        }
    }

    fn potential(&self, r2: f64) -> f64 {
        match *self {
            Profile::Power {
                strength,
                power,
                softening,
            } => {
                let rho2 = r2 + to_f64(softening) * to_f64(softening);
                let n1 = to_f64(power) + 1.0;
                if n1 == 0.0 {
                    -to_f64(strength) * rho2.ln() / 2.0
                } else {
                    -to_f64(strength) * rho2.powf(n1 / 2.0) / n1
                }
            }
            Profile::LennardJones { epsilon, sigma } => {
                let s2 = to_f64(sigma) * to_f64(sigma) / r2;
                let s6 = s2 * s2 * s2;
                4.0 * to_f64(epsilon) * (s6 * s6 - s6)
            }
        }
    }
}

/// The pull of a spring of stiffness `k` and rest length `l` from the origin.
pub(super) fn spring(d: DVec3, k: f64, l: f64) -> DVec3 {
    if l == 0.0 {
        return d * -k;
    }
    // At the very centre the direction is undefined; a spring pushed there stays.
    let direction = d.normalize_or_zero();
    direction * (-k * (d.length() - l))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// F = −∇U, by a central difference whose error is third order in h.
    #[test]
    fn the_force_is_the_slope_of_the_potential() {
        let power = |power, softening| Profile::Power {
            strength: 3.0,
            power,
            softening,
        };
        let profiles = [
            power(-2.0, 0.0),
            power(-2.0, 0.5),
            power(-1.0, 0.25),
            power(1.0, 0.0),
            Profile::LennardJones {
                epsilon: 2.0,
                sigma: 1.5,
            },
        ];
        for profile in profiles {
            for shifted_at in [None, Some(3.0)] {
                let radial = Radial {
                    profile,
                    shifted_at,
                };
                for r in [1.25_f64, 1.7, 2.5] {
                    let h = 1e-5;
                    let u = |r: f64| radial.potential(r * r);
                    let slope = (u(r + h) - u(r - h)) / (2.0 * h);
                    let force = radial.factor(r * r) * r;
                    assert_relative_eq!(force, -slope, epsilon = 1e-8, max_relative = 1e-8);
                }
            }
        }
    }

    #[test]
    fn a_shifted_force_ends_at_zero() {
        let radial = Radial {
            profile: Profile::LennardJones {
                epsilon: 2.0,
                sigma: 1.5,
            },
            shifted_at: Some(4.0),
        };
        assert_eq!(radial.factor(16.0), 0.0);
        assert_eq!(radial.potential(16.0), 0.0);
    }
}
