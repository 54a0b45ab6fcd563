//! Seeded random numbers for formulas, the same on every machine and in both precisions.

use std::f64::consts::TAU;

use crate::math::DVec3;

/// A SplitMix64 generator (Steele, Lea and Flood, 2014) with 64 bits of state. Any seed is good.
#[derive(Clone, Debug)]
pub(super) struct Random {
    state: u64,
}

impl Random {
    /// A generator that always gives the same numbers for the same `seed`.
    pub(super) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// 64 random bits.
    pub(super) fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number uniform in `[0, 1)`.
    pub(super) fn uniform(&mut self) -> f64 {
        // The 53 high bits fill an `f64` mantissa, so the result never rounds up to 1.
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A point uniform on the unit sphere.
    pub(super) fn unit_vector(&mut self) -> DVec3 {
        // Archimedes: the height of a uniform point on the sphere is itself uniform.
        let z = 2.0 * self.uniform() - 1.0;
        let rim = (1.0 - z * z).sqrt();
        let (sin, cos) = (TAU * self.uniform()).sin_cos();
        DVec3::new(rim * cos, rim * sin, z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
