//! Seeded random numbers, so that a scene is the same on every machine and every run.
//!
//! All numbers are drawn in `f64`, so that the `f32` and the `f64` build of a scene differ by rounding only.

use std::f64::consts::TAU;

use rapier3d_fields::math::{DQuat, DVec3};

/// A SplitMix64 generator (Steele, Lea and Flood, 2014): 64 bits of state, any seed is good.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// A generator that always gives the same numbers for the same `seed`.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number uniform in `[0, 1)`.
    pub fn uniform(&mut self) -> f64 {
        // The 53 high bits fill an `f64` mantissa, so the result never rounds up to 1.
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A normally distributed number with mean 0 and standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        // Box–Muller; `1 - uniform` is in (0, 1], where the logarithm is finite.
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }

    /// Three independent [`normal`](Self::normal) numbers.
    pub fn normal_vector(&mut self) -> DVec3 {
        DVec3::new(self.normal(), self.normal(), self.normal())
    }

    /// A point uniform on the unit sphere.
    pub fn unit_vector(&mut self) -> DVec3 {
        // Archimedes: the height of a uniform point on the sphere is itself uniform.
        let z = 2.0 * self.uniform() - 1.0;
        let rim = (1.0 - z * z).sqrt();
        let (sin, cos) = (TAU * self.uniform()).sin_cos();
        DVec3::new(rim * cos, rim * sin, z)
    }

    /// A rotation uniform over all orientations, as a unit quaternion.
    pub fn rotation(&mut self) -> DQuat {
        // Shoemake (1992): two circles whose squared radii add up to 1.
        let u = self.uniform();
        let (sin_a, cos_a) = (TAU * self.uniform()).sin_cos();
        let (sin_b, cos_b) = (TAU * self.uniform()).sin_cos();
        let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
        DQuat::from_xyzw(a * sin_a, a * cos_a, b * sin_b, b * cos_b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRAWS: usize = 100_000;
    /// Five standard errors of the mean of `DRAWS` numbers of variance at most 2.
    const FIVE_SIGMA: f64 = 5.0 * 0.0045;

    fn mean(mut draw: impl FnMut() -> f64) -> f64 {
        (0..DRAWS).map(|_| draw()).sum::<f64>() / DRAWS as f64
    }

    #[test]
    fn bits_equal_the_published_sequence() {
        // The reference implementation's first outputs for seed 1234567.
        let mut random = Random::new(1_234_567);
        let bits: [u64; 3] = std::array::from_fn(|_| random.bits());
        assert_eq!(
            bits,
            [
                6_457_827_717_110_365_317,
                3_203_168_211_198_807_973,
                9_817_491_932_198_370_423
            ]
        );
    }

    #[test]
    fn uniform_has_the_moments_of_the_unit_interval() {
        let mut random = Random::new(1);
        assert!((0..DRAWS).all(|_| (0.0..1.0).contains(&random.uniform())));
        assert!((mean(|| random.uniform()) - 0.5).abs() < FIVE_SIGMA);
        assert!((mean(|| random.uniform().powi(2)) - 1.0 / 3.0).abs() < FIVE_SIGMA);
    }

    #[test]
    fn normal_has_mean_zero_and_variance_one() {
        let mut random = Random::new(2);
        assert!(mean(|| random.normal()).abs() < FIVE_SIGMA);
        assert!((mean(|| random.normal().powi(2)) - 1.0).abs() < FIVE_SIGMA);
    }

    #[test]
    fn directions_and_rotations_are_unit_and_isotropic() {
        let mut random = Random::new(3);
        for _ in 0..1000 {
            assert!((random.unit_vector().length() - 1.0).abs() < 1e-12);
            assert!((random.rotation().length() - 1.0).abs() < 1e-12);
        }
        // An isotropic direction has <cos^2> = 1/3 with any axis, a rotated axis too.
        let third = 1.0 / 3.0;
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let direction = mean(|| random.unit_vector().dot(axis).powi(2));
            let rotated = mean(|| (random.rotation() * DVec3::X).dot(axis).powi(2));
            let first_moment = mean(|| (random.rotation() * DVec3::Z).dot(axis));
            assert!(
                (direction - third).abs() < FIVE_SIGMA,
                "{axis}: {direction}"
            );
            assert!((rotated - third).abs() < FIVE_SIGMA, "{axis}: {rotated}");
            assert!(first_moment.abs() < FIVE_SIGMA, "{axis}: {first_moment}");
        }
    }
}
