//! Numbers of up to eight samples.

use fearless_simd::{Simd, SimdBase, SimdMask};

use crate::math::to_f64;
use crate::sample::SamplePoint;

/// As the interpreter has them: in full precision whatever a `Real` is.
pub(super) use fearless_simd::f64x8 as Eight;

/// How many samples.
pub(in crate::eval) const WIDTH: usize = 8;

pub(super) type Mask<S> = <Eight<S> as SimdBase<S>>::Mask;

/// A vector of each sample.
pub(super) type Vectors<S> = [Eight<S>; 3];

/// The samples that are asked about: the lanes of which are `here`.
pub(super) struct Chunk<'a, S: Simd> {
    pub simd: S,
    pub samples: [&'a SamplePoint; WIDTH],
    pub here: Mask<S>,
    pub point: Vectors<S>,
    pub velocity: Vectors<S>,
    pub owner: Eight<S>,
}

impl<'a, S: Simd> Chunk<'a, S> {
    /// Of at least one sample.
    #[inline(always)]
    pub(super) fn new(simd: S, samples: &[&'a SamplePoint]) -> Self {
        let last = samples.len().min(WIDTH) - 1;
        let samples = std::array::from_fn(|lane| samples[lane.min(last)]);
        let chunk = Chunk {
            simd,
            samples,
            here: Mask::<S>::from_bitmask(simd, (2 << last) - 1),
            point: [Eight::splat(simd, 0.0); 3],
            velocity: [Eight::splat(simd, 0.0); 3],
            owner: Eight::splat(simd, 0.0),
        };
        let each = [0, 1, 2];
        Chunk {
            point: each.map(|axis| chunk.of_each(|sample| to_f64(sample.world_point[axis]))),
            velocity: each.map(|axis| chunk.of_each(|sample| to_f64(sample.velocity[axis]))),
            owner: chunk.of_each(|sample| to_f64(sample.owner)),
            ..chunk
        }
    }

    /// A number of each sample.
    #[inline(always)]
    pub(super) fn of_each(&self, number: impl Fn(&SamplePoint) -> f64) -> Eight<S> {
        let numbers: [f64; WIDTH] = std::array::from_fn(|lane| number(self.samples[lane]));
        Eight::load_array(self.simd, numbers)
    }

    #[inline(always)]
    pub(super) fn splat(&self, number: f64) -> Eight<S> {
        Eight::splat(self.simd, number)
    }

    #[inline(always)]
    pub(super) fn none(&self) -> Mask<S> {
        Mask::<S>::splat(self.simd, false)
    }
}

/// A composite on each sample.
#[derive(Clone, Copy)]
pub(super) struct Value<S: Simd> {
    pub defined: Mask<S>,
    pub vector: Vectors<S>,
}

impl<S: Simd> Value<S> {
    #[inline(always)]
    pub(super) fn undefined(simd: S) -> Self {
        Value {
            defined: Mask::<S>::splat(simd, false),
            vector: [Eight::splat(simd, 0.0); 3],
        }
    }
}
