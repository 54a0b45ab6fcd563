//! The limits of stability of the schemes.

use super::scheme::{Scheme, Substeps};
use crate::math::bisect;
use crate::rapier::na::Complex;

/// The dt·ω from which on the energy of a vibration is unbounded; zero if it is unbounded at any step. `reads` if
/// forces read velocities.
fn explodes_at(scheme: Scheme, reads: bool) -> f64 {
    match scheme {
        // The limit of Suzuki's composition.
        Scheme::Forward4 if reads => 2.72,
        Scheme::KickDriftKick | Scheme::Kick => 2.0,
        Scheme::Substep(Substeps::Fixed(count)) => 2.0 * f64::from(count),
        // 2 √3.
        Scheme::Forward4 => 3.46,
        Scheme::ExternalForce => 0.0,
        // These damp, or divide the step until it is short enough.
        Scheme::LinearlyImplicit
        | Scheme::Auto { .. }
        | Scheme::Substep(Substeps::PerBody { .. }) => f64::INFINITY,
    }
}

/// The dt·ω from which on a scheme that does not choose warns: half of the limit of stability. For a scheme that gains
/// energy at any step, the dt·ω at which the gain is a percent in a hundred steps. For the damping scheme, dt times the
/// rate at which fields push bodies apart. `reads` if forces read velocities.
pub(super) fn warns_from(scheme: Scheme, reads: bool) -> Option<f64> {
    match scheme {
        Scheme::ExternalForce => Some(BY_FORCE),
        Scheme::LinearlyImplicit => Some(0.25),
        _ if scheme.chooses() => None,
        _ => Some(0.5 * explodes_at(scheme, reads)),
    }
}

/// The dt·ω from which on forces given to Rapier warn; links of multibodies get such forces under every scheme.
pub(super) const BY_FORCE: f64 = 0.02;

/// Two bodies that attract each other oscillate with up to this times the square of the frequency of either one with
/// the other held.
pub(super) const COUPLED: f64 = 2.0;

/// A mode of oscillation of a body in fields.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mode {
    pub omega2: f64,
    /// The rate at which its velocity decays.
    pub damping: f64,
    /// The rate at which its velocity turns.
    pub gyration: f64,
}

/// A relative growth of the energy per step above this is a gain: one percent in a hundred steps.
const GAINS: f64 = 1e-4;
/// A smaller growth is rounding.
const ROUNDING: f64 = 1e-9;
/// The number of steps that are tried to find the longest stable one.
const TRIED: u32 = 128;

impl Mode {
    /// The relative growth of the square of the amplitude in a step of half a kick, drift, and half a kick, with kicks
    /// that are exact in the velocity.
    ///
    /// In the plane of gyration, v' = f + z v with z = −γ + iΩ: half a kick is v e + q f, with
    /// e = exp(z h/2) and q = (e − 1)/z. The map has the trace 1 + e² − ω² h q (1 + e) and the
    /// determinant e².
    fn growth(self, dt: f64) -> f64 {
        let z = Complex::new(-self.damping, self.gyration) * (0.5 * dt);
        let e = z.exp();
        let mean = if z.norm() < 1e-6 {
            Complex::from(1.0) + z * 0.5
        } else {
            (e - 1.0) / z
        };
        let swing = mean * (0.5 * self.omega2 * dt * dt);
        let half = (e * e + 1.0 - swing * (e + 1.0)) * 0.5;
        let root = (half * half - e * e).sqrt();
        (half + root).norm_sqr().max((half - root).norm_sqr()) - 1.0
    }

    /// Returns true if a scheme gains energy in steps of this length, or within two percent of it: near a resonance
    /// with gyration even bounded oscillations are large.
    pub(super) fn gains(self, scheme: Scheme, dt: f64) -> bool {
        let count = match scheme {
            Scheme::KickDriftKick | Scheme::Kick => 1.0,
            Scheme::Substep(Substeps::Fixed(count)) => f64::from(count),
            _ => return false,
        };
        let near = [0.98, 1.0, 1.02].into_iter();
        near.map(|share| self.growth(share * dt / count))
            .any(|growth| growth * count > GAINS)
    }

    /// The length up to which all steps are stable under a scheme. `reads` if forces read velocities.
    pub(super) fn largest_stable_dt(self, scheme: Scheme, reads: bool) -> f64 {
        if self.omega2 <= 0.0 {
            return f64::INFINITY;
        }
        self.stable_to() * (0.5 * explodes_at(scheme, reads))
    }

    /// [`Self::largest_stable_dt`] under `KickDriftKick`.
    fn stable_to(self) -> f64 {
        let damped = self.damped_to();
        if self.gyration == 0.0 {
            return damped;
        }
        // The limit is at most the time of one whole turn.
        let end = damped.min(std::f64::consts::TAU / self.gyration);
        let unstable = |dt: f64| self.growth(dt) > ROUNDING;
        let step = end / f64::from(TRIED);
        let mut tried = (1..TRIED).map(|count| step * f64::from(count));
        let Some(first) = tried.find(|dt| unstable(*dt)) else {
            return end;
        };
        let stable = |dt: f64| !unstable(dt);
        bisect([first - step, first], f64::MANTISSA_DIGITS, stable)
    }

    /// The limit without gyration: h ω² tanh(γh/2) = 2γ, or h ω = 2 without damping. Solved for u = γh/2.
    fn damped_to(self) -> f64 {
        let plain = 2.0 / self.omega2.sqrt();
        let goal = self.damping * self.damping / self.omega2;
        if goal.is_nan() || goal < 1e-12 {
            return plain;
        }
        let low = goal.sqrt();
        let high = goal / low.tanh();
        let is_low = |u: f64| u * u.tanh() < goal;
        2.0 * bisect([low, high], f64::MANTISSA_DIGITS, is_low) / self.damping
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Iterates the map on both sides of the limit.
    #[test]
    fn steps_are_stable_up_to_the_limit_and_no_further() {
        for gyration in [0.0, 0.3, 3.0, 30.0] {
            for damping in [0.0, 0.1, 1.0, 10.0] {
                for omega2 in [0.04, 1.0, 25.0] {
                    let mode = Mode {
                        omega2,
                        damping,
                        gyration,
                    };
                    let largest = mode.largest_stable_dt(Scheme::KickDriftKick, false);
                    assert!(largest > 0.0 && largest.is_finite(), "{mode:?}: {largest}");
                    for part in [0.1, 0.5, 0.9, 0.99] {
                        let swing = largest_swing(mode, largest * part);
                        assert!(swing < 1e4, "{mode:?}: {swing} at {part} of {largest}");
                    }
                    if gyration == 0.0 {
                        let swing = largest_swing(mode, largest * 1.01);
                        assert!(swing > 1e6, "{mode:?}: {swing} beyond {largest}");
                    }
                }
            }
        }
    }

    /// The largest amplitude in many steps that begin at 1.
    fn largest_swing(mode: Mode, dt: f64) -> f64 {
        let z = Complex::new(-mode.damping, mode.gyration);
        let e = (z * (0.5 * dt)).exp();
        let q = match z.norm() {
            0.0 => Complex::from(0.5 * dt),
            _ => (e - 1.0) / z,
        };
        let (mut x, mut v) = (Complex::from(1.0), Complex::from(0.0));
        let mut most = 0.0_f64;
        for _ in 0..2000 {
            v = e * v - q * mode.omega2 * x;
            x += v * dt;
            v = e * v - q * mode.omega2 * x;
            most = most.max(x.norm());
        }
        most
    }

    #[test]
    fn limits_agree_with_their_closed_forms() {
        let free = Mode {
            omega2: 25.0,
            damping: 0.0,
            gyration: 0.0,
        };
        assert_eq!(free.largest_stable_dt(Scheme::KickDriftKick, false), 0.4);
        let four = Scheme::Substep(Substeps::Fixed(4));
        assert_eq!(free.largest_stable_dt(four, false), 1.6);
        assert_eq!(free.largest_stable_dt(Scheme::ExternalForce, false), 0.0);
        for (reads, limit) in [(false, 3.46), (true, 2.72)] {
            let largest = free.largest_stable_dt(Scheme::Forward4, reads);
            assert!((largest - limit / 5.0).abs() < 1e-9, "{largest}");
        }
        // With strong drag, 2γ/ω².
        let slow = Mode {
            damping: 1e3,
            ..free
        };
        let largest = slow.largest_stable_dt(Scheme::KickDriftKick, false);
        assert!((largest - 80.0).abs() < 1e-6, "{largest}");
        // h ω² = Ω cot(Ωh/4).
        let turned = Mode {
            gyration: 6.0,
            ..free
        };
        let h = turned.largest_stable_dt(Scheme::KickDriftKick, false);
        let cot = (1.5 * h).tan().recip();
        assert!((25.0 * h - 6.0 * cot).abs() < 1e-6, "{h}");
    }
}
