//! Numbers that look random and are the same in every run.

use rapier3d_fields::math::DVec3;

/// Numbers from −1 to 1, the same in every run.
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Self {
        let mut numbers = Numbers(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        for _ in 0..5 {
            numbers.next();
        }
        numbers
    }

    pub fn next(&mut self) -> f64 {
        let state = self.0.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
        self.0 = state;
        (state >> 33) as f64 / f64::from(1u32 << 30) - 1.0
    }

    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }

    /// A number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.next() + 1.0) * 0.5 * count as f64) as usize % count
    }

    pub fn one_of<T: Copy>(&mut self, these: &[T]) -> T {
        these[self.below(these.len())]
    }

    /// Zero, or a number from zero to `most`.
    pub fn perhaps(&mut self, most: f64) -> f64 {
        self.one_of(&[0.0, most]) * (self.next() + 1.0) * 0.5
    }

    /// A number from `least` to `most`, uniform in its logarithm.
    pub fn within(&mut self, least: f64, most: f64) -> f64 {
        least * (most / least).powf((self.next() + 1.0) * 0.5)
    }

    /// A direction.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let vector = self.vector();
            if (0.1..1.0).contains(&vector.length()) {
                return vector.normalize();
            }
        }
    }
}
