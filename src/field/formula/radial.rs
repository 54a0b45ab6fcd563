//! Forces along the line through the field's origin, as functions of the distance.

use super::Law;
use crate::field::error::{BuildError, finite, not_negative, positive, require};
use crate::field::query::{LocalQuery, QueryNumber, Single};
use crate::math::{Real, to_f64};
use crate::number::{Dual, Number, Plain, Vec3, limited};

/// A force d/r · (f(r) − f(r_c)) for the distance vector d from the field's origin, |d| = r.
///
/// Without a cutoff the second term is absent. With one it makes the force continuous at the
/// cutoff r_c ("shifted force"; Allen & Tildesley, Computer Simulation of Liquids, §1.6.3): the
/// potential becomes U(r) − U(r_c) + (r − r_c) f(r_c).
///
/// At the centre the direction is not defined: laws that are not singular there give zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct Radial {
    /// The profile f(r), positive outward.
    pub profile: Profile,
    /// r_c, the distance at which the force is brought to zero.
    pub shifted_at: Option<Real>,
    /// Below this distance the force is as strong as at this distance.
    pub nearest: Option<Real>,
    /// Bound of the strength of the force. A bounded force has no potential here.
    pub strongest: Option<Real>,
    /// Cells of sources that appear smaller than this act as a whole, if there are 512 sources or more; see
    /// [`Field::opening_angle`](crate::Field::opening_angle).
    pub opening_angle: Option<Real>,
}

/// A force along the line as a function f of the distance r, positive outward.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
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
    /// U = k exp(−r/λ)/r, f = −dU/dr: a screened charge (Yukawa; Debye and Hückel). Singular at
    /// r = 0.
    Yukawa {
        /// k: positive pushes outward.
        strength: Real,
        /// λ, the length over which it is screened.
        screening: Real,
    },
    /// U = D ((1 − exp(−a (r − r₀)))² − 1), f = −dU/dr: a bond (Morse, Phys. Rev. 34, 1929).
    Morse {
        /// D, the depth of the well.
        depth: Real,
        /// a, per length. A larger a makes the well narrower.
        stiffness: Real,
        /// r₀, where the well is deepest.
        rest_length: Real,
    },
    /// U = k exp(−r²/2w²), f = −dU/dr = k r/w² exp(−r²/2w²).
    Gaussian {
        /// k, the height of the hill (negative: depth of the well).
        height: Real,
        /// w.
        width: Real,
    },
    /// f = k (d − r)^{3/2} for r < d, else none: elastic balls pressed together (Hertz, 1882).
    /// U = ⅖ k (d − r)^{5/2}.
    Hertz {
        /// k, force per length^{3/2}.
        stiffness: Real,
        /// d, the sum of the two radii.
        diameter: Real,
    },
}

impl Radial {
    pub(crate) fn new(profile: Profile) -> Self {
        Radial {
            profile,
            shifted_at: None,
            nearest: None,
            strongest: None,
            opening_angle: None,
        }
    }

    /// Returns true if the force is the profile, shifted or not, at all distances.
    pub(crate) fn is_plain(&self) -> bool {
        self.nearest.is_none() && self.strongest.is_none()
    }

    /// Returns true if the force is proportional to the distance.
    pub(super) fn is_linear(&self) -> bool {
        let grows = matches!(self.profile, Profile::Power { power: 1.0, .. });
        grows && self.is_plain() && self.shifted_at.is_none()
    }

    /// Returns true if it has a potential here: a bounded force has none.
    pub(crate) fn has_potential(&self) -> bool {
        self.strongest.is_none()
    }

    /// The same law without a bound.
    pub(crate) fn unbounded(self) -> Radial {
        Radial {
            strongest: None,
            ..self
        }
    }

    /// The factor s in F = s d, from r².
    #[inline(always)]
    pub(crate) fn factor<T: Number>(&self, r2: T) -> T {
        self.factor_less(self.shift(), r2)
    }

    /// The factor with its derivative by r², as a function of r².
    pub(crate) fn slope(&self) -> impl Fn(f64) -> Dual<1> {
        let shift = self.shift();
        move |r2| self.factor_less(shift, Dual::input(r2, 0))
    }

    /// The factor, given the shift that is subtracted from the force.
    #[inline(always)]
    fn factor_less<T: Number>(&self, shift: f64, r2: T) -> T {
        let own = self.profile.factor(r2);
        if self.is_plain() && self.shifted_at.is_none() {
            return own;
        }
        let at_centre = r2.re().equals(0.0);
        let r = r2.sqrt();
        if self.is_plain() {
            return T::select(at_centre, own, own - r.recip() * shift);
        }
        let mut force = own * r - shift;
        if let Some(nearest) = self.nearest {
            let near = r.re().below(to_f64(nearest));
            force = T::select(near, self.force_when_near().into(), force);
        }
        if let Some(bound) = self.strongest.map(to_f64) {
            let is_push = force.re().above(0.0);
            let bounded = T::select(is_push, bound.into(), (-bound).into());
            force = T::select(force.re().abs().above(bound), bounded, force);
        }
        T::select(at_centre, 0.0.into(), force / r)
    }

    /// The force at the nearest distance, which it also has at any smaller one.
    fn force_when_near(&self) -> f64 {
        let nearest = self.nearest.map_or(0.0, to_f64);
        self.profile.force(nearest) - self.shift()
    }

    fn shift(&self) -> f64 {
        self.shifted_at
            .map_or(0.0, |cutoff| self.profile.force(to_f64(cutoff)))
    }

    /// Checks that the force can be expanded in moments, and that the angle is in range.
    fn may_be_seen_from_afar(&self, field: &str, angle: Real) -> Result<(), BuildError> {
        let is_power = matches!(self.profile, Profile::Power { .. });
        if !is_power || !self.is_plain() || self.shifted_at.is_some() {
            return Err(BuildError::Misfit {
                field: field.into(),
                setter: "opening_angle",
                formula: "radial (other than a power law, or bounded, or cut off)",
            });
        }
        let fits = angle > 0.0 && angle <= 1.0;
        let (quantity, range) = ("the opening angle", "above 0 and at most 1");
        require(fits, field, quantity, range, to_f64(angle))
    }

    /// The potential, from r²; `None` for a bounded force.
    pub(crate) fn potential_at<T: Number<Plain = f64>>(&self, r2: T) -> Option<T> {
        if !self.has_potential() {
            return None;
        }
        let nearest = self.nearest.map_or(0.0, to_f64);
        let nearest2 = nearest * nearest;
        Some(if r2.re() < nearest2 {
            let at_nearest = self.shifted_potential(T::from(nearest2));
            at_nearest + (-r2.sqrt() + nearest) * self.force_when_near()
        } else {
            self.shifted_potential(r2)
        })
    }

    fn shifted_potential<T: Number<Plain = f64>>(&self, r2: T) -> T {
        let inner = self.profile.potential(r2);
        match self.shifted_at.map(to_f64) {
            Some(cutoff) => {
                let at_cutoff = self.profile.potential(cutoff * cutoff);
                inner - at_cutoff + (r2.sqrt() - cutoff) * self.shift()
            }
            None => inner,
        }
    }

    /// The law with the strength multiplied by a factor, and the same bound.
    pub(crate) fn times(mut self, factor: Real) -> Radial {
        *self.profile.strength_mut() *= factor;
        self
    }

    /// The strength, and the same law with a strength of one.
    pub(crate) fn unit(&self) -> (Real, Radial) {
        let mut law = *self;
        let strength = std::mem::replace(law.profile.strength_mut(), 1.0);
        law.strongest = self.strongest.map(|bound| bound / strength.abs());
        (strength, law)
    }

    /// The parameters by which laws of strength one differ, as bits.
    pub(crate) fn bits(&self) -> [u64; 7] {
        let bits = |x: Real| to_f64(x).to_bits();
        let option_bits = |x: Option<Real>| x.map_or(u64::MAX, bits);
        let (kind, a, b) = match self.profile {
            Profile::Power {
                power, softening, ..
            } => (0, power, softening),
            Profile::LennardJones { sigma, .. } => (1, sigma, 0.0),
            Profile::Yukawa { screening, .. } => (2, screening, 0.0),
            Profile::Morse {
                stiffness,
                rest_length,
                ..
            } => (3, stiffness, rest_length),
            Profile::Gaussian { width, .. } => (4, width, 0.0),
            Profile::Hertz { diameter, .. } => (5, diameter, 0.0),
        };
        let [shift, nearest, strongest, angle] = [
            self.shifted_at,
            self.nearest,
            self.strongest,
            self.opening_angle,
        ]
        .map(option_bits);
        [kind, bits(a), bits(b), shift, nearest, strongest, angle]
    }
}

impl Law for Radial {
    fn kind(&self) -> &'static str {
        self.profile.kind()
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn vector<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        local.point * self.factor(local.point.dot(local.point))
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn times<T: QueryNumber>(&self, strength: f64, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let vector = self.unbounded().vector(local) * T::from(strength);
        match self.strongest {
            Some(bound) => limited(vector, to_f64(bound)),
            None => vector,
        }
    }

    fn potential<T: Single>(&self, local: &LocalQuery<'_, T>) -> Option<T> {
        self.potential_at(local.point.dot(local.point))
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        for (quantity, value) in [
            ("the cutoff", self.shifted_at),
            ("the nearest distance", self.nearest),
        ] {
            value.map_or(Ok(()), |value| positive(field, quantity, value))?;
        }
        let strongest = self.strongest.unwrap_or(0.0);
        not_negative(field, "the bound of the force", strongest)?;
        if let Some(angle) = self.opening_angle {
            self.may_be_seen_from_afar(field, angle)?;
        }
        self.profile.validate(field)
    }
}

impl Profile {
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Profile::Power { .. } => "radial",
            Profile::LennardJones { .. } => "Lennard-Jones",
            Profile::Yukawa { .. } => "Yukawa",
            Profile::Morse { .. } => "Morse",
            Profile::Gaussian { .. } => "Gaussian",
            Profile::Hertz { .. } => "Hertz",
        }
    }

    /// The parameter that f is proportional to.
    fn strength_mut(&mut self) -> &mut Real {
        match self {
            Profile::Power { strength, .. } | Profile::Yukawa { strength, .. } => strength,
            Profile::LennardJones { epsilon, .. } => epsilon,
            Profile::Morse { depth, .. } => depth,
            Profile::Gaussian { height, .. } => height,
            Profile::Hertz { stiffness, .. } => stiffness,
        }
    }

    /// f(r).
    fn force(&self, r: f64) -> f64 {
        self.factor(r * r) * r
    }

    /// f(r)/r.
    #[inline(always)]
    fn factor<T: Number>(&self, r2: T) -> T {
        match *self {
            Profile::Power {
                strength,
                power,
                softening,
            } => {
                let (power, softening) = (to_f64(power), to_f64(softening));
                let rho2 = r2 + softening * softening;
                let factor = rho2.powf((power - 1.0) / 2.0) * to_f64(strength);
                // At the centre f/r of f = k r is k, too; for other powers the force is zero there.
                let flat = power >= 0.0 && power != 1.0;
                let at_centre = rho2.re().equals(0.0) & flat.into();
                T::select(at_centre, 0.0.into(), factor)
            }
            Profile::LennardJones { epsilon, sigma } => {
                let s2 = r2.recip() * (to_f64(sigma) * to_f64(sigma));
                let s6 = s2 * s2 * s2;
                (s6 * s6 * 2.0 - s6) * (24.0 * to_f64(epsilon)) / r2
            }
            Profile::Yukawa {
                strength,
                screening,
            } => {
                let (r, inverse) = (r2.sqrt(), to_f64(screening).recip());
                let decay = (-r * inverse).exp() * to_f64(strength);
                decay * (r.recip() + inverse) / r2
            }
            Profile::Morse {
                depth,
                stiffness,
                rest_length,
            } => {
                let (r, a) = (r2.sqrt(), to_f64(stiffness));
                let decay = (-(r - to_f64(rest_length)) * a).exp();
                let factor = (decay * decay - decay) * (2.0 * to_f64(depth) * a) / r;
                T::select(r.re().equals(0.0), 0.0.into(), factor)
            }
            Profile::Gaussian { height, width } => {
                let inverse2 = (to_f64(width) * to_f64(width)).recip();
                (r2 * (-0.5 * inverse2)).exp() * (to_f64(height) * inverse2)
            }
            Profile::Hertz {
                stiffness,
                diameter,
            } => {
                let r = r2.sqrt();
                let depth = -r + to_f64(diameter);
                let parted = depth.re().at_most(0.0) | r.re().equals(0.0);
                let factor = depth * depth.sqrt() * to_f64(stiffness) / r;
                T::select(parted, 0.0.into(), factor)
            }
        }
    }

    fn potential<T: Number<Plain = f64>>(&self, r2: T) -> T {
        match *self {
            Profile::Power {
                strength,
                power,
                softening,
            } => {
                let rho2 = r2 + to_f64(softening) * to_f64(softening);
                let (k, n1) = (to_f64(strength), to_f64(power) + 1.0);
                if n1 == 0.0 {
                    rho2.ln() * (-k / 2.0)
                } else {
                    rho2.powf(n1 / 2.0) * (-k / n1)
                }
            }
            Profile::LennardJones { epsilon, sigma } => {
                let s2 = r2.recip() * (to_f64(sigma) * to_f64(sigma));
                let s6 = s2 * s2 * s2;
                (s6 * s6 - s6) * (4.0 * to_f64(epsilon))
            }
            Profile::Yukawa {
                strength,
                screening,
            } => {
                let r = r2.sqrt();
                (-r / to_f64(screening)).exp() * to_f64(strength) / r
            }
            Profile::Morse {
                depth,
                stiffness,
                rest_length,
            } => {
                let stretch = r2.sqrt() - to_f64(rest_length);
                let decay = (-stretch * to_f64(stiffness)).exp();
                (decay * decay - decay * 2.0) * to_f64(depth)
            }
            Profile::Gaussian { height, width } => {
                let inverse2 = (to_f64(width) * to_f64(width)).recip();
                (r2 * (-0.5 * inverse2)).exp() * to_f64(height)
            }
            Profile::Hertz {
                stiffness,
                diameter,
            } => {
                let depth = -r2.sqrt() + to_f64(diameter);
                if depth.re() <= 0.0 {
                    return 0.0.into();
                }
                depth * depth * depth.sqrt() * (0.4 * to_f64(stiffness))
            }
        }
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        let positive = |quantity, value| positive(field, quantity, value);
        match *self {
            Profile::Power {
                strength,
                power,
                softening,
            } => {
                finite(field, "the strength", strength)?;
                finite(field, "the power", power)?;
                not_negative(field, "the softening", softening)
            }
            Profile::LennardJones { epsilon, sigma } => {
                finite(field, "epsilon", epsilon)?;
                positive("sigma", sigma)
            }
            Profile::Yukawa {
                strength,
                screening,
            } => {
                finite(field, "the strength", strength)?;
                positive("the screening length", screening)
            }
            Profile::Morse {
                depth,
                stiffness,
                rest_length,
            } => {
                finite(field, "the depth", depth)?;
                finite(field, "the rest length", rest_length)?;
                positive("the stiffness", stiffness)
            }
            Profile::Gaussian { height, width } => {
                finite(field, "the height", height)?;
                positive("the width", width)
            }
            Profile::Hertz {
                stiffness,
                diameter,
            } => {
                finite(field, "the stiffness", stiffness)?;
                positive("the diameter", diameter)
            }
        }
    }
}
