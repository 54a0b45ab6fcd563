//! Random numbers, some of them extreme.

use rapier3d_fields::math::{Pose, Real, Rotation, from_dvec3, from_f64};
use rapier3d_fields::prelude::Vector;
#[cfg(feature = "f64")]
use rapier3d_fields_lab::double as lab;
#[cfg(not(feature = "f64"))]
use rapier3d_fields_lab::single as lab;

use lab::random::Random;

/// A stream of random numbers.
pub struct Draw(Random);

impl Draw {
    /// One of the streams of a case.
    pub fn new(seed: u64, stream: u64) -> Self {
        Draw(Random::new(seed.wrapping_mul(8).wrapping_add(stream)))
    }

    /// A number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.0.bits() % count as u64) as usize
    }

    /// True once in `count` times on average.
    pub fn once_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }

    pub fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    pub fn between(&mut self, low: f64, high: f64) -> Real {
        from_f64(low + (high - low) * self.0.uniform())
    }

    /// A length.
    pub fn size(&mut self) -> Real {
        match self.below(40) {
            0 => self.of(&[1e-6, 1e-3, 100.0, 1e4]),
            _ => self.between(0.1, 2.0),
        }
    }

    /// Any number, mostly of the order of one.
    pub fn number(&mut self) -> Real {
        const EXTREME: [Real; 8] = [0.0, 1.0, -1.0, 1e-20, 1e6, -1e9, 1e18, Real::MAX];
        match self.below(30) {
            0 => self.of(&EXTREME),
            1 => self.between(-300.0, 300.0),
            _ => self.between(-5.0, 5.0),
        }
    }

    pub fn vector(&mut self, reach: f64) -> Vector {
        Vector::new(
            self.between(-reach, reach),
            self.between(-reach, reach),
            self.between(-reach, reach),
        )
    }

    pub fn numbers(&mut self) -> Vector {
        Vector::new(self.number(), self.number(), self.number())
    }

    pub fn unit(&mut self) -> Vector {
        from_dvec3(self.0.unit_vector())
    }

    pub fn pose(&mut self, reach: f64) -> Pose {
        let rotation = match self.below(3) {
            0 => Rotation::IDENTITY,
            _ => Rotation::from_scaled_axis(self.vector(3.0)),
        };
        Pose::from_parts(self.vector(reach), rotation)
    }
}
