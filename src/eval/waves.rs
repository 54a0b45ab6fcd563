//! Turbulence with its waves in lanes.

use fearless_simd::{Select, Simd, SimdBase, f64x8 as Eight};

use crate::field::Turbulence;
use crate::math::DVec3;

/// What [`Turbulence`] is at a point of its frame, but for roundings; not a number where a phase is too
/// large for [`sin_cos`].
#[inline(always)]
pub(super) fn flow_at<S: Simd>(simd: S, law: &Turbulence, point: DVec3, time: f64) -> DVec3 {
    let waves = &law.waves;
    let [along, cosine, sine] = [&waves.along, &waves.cosine, &waves.sine];
    let (mut x, mut y, mut z) = (splat(simd, 0.0), splat(simd, 0.0), splat(simd, 0.0));
    for first in (0..waves.frequency.len()).step_by(LANES) {
        let phase = load(simd, &along[0], first) * point.x
            + load(simd, &along[1], first) * point.y
            + load(simd, &along[2], first) * point.z
            + load(simd, &waves.frequency, first) * time;
        let (sin, cos) = sin_cos(phase);
        x += load(simd, &cosine[0], first) * cos + load(simd, &sine[0], first) * sin;
        y += load(simd, &cosine[1], first) * cos + load(simd, &sine[1], first) * sin;
        z += load(simd, &cosine[2], first) * cos + load(simd, &sine[2], first) * sin;
    }
    DVec3::new(total(x), total(y), total(z))
}

#[inline(always)]
fn splat<S: Simd>(simd: S, number: f64) -> Eight<S> {
    Eight::splat(simd, number)
}

#[inline(always)]
fn load<S: Simd>(simd: S, numbers: &[f64], first: usize) -> Eight<S> {
    Eight::from_slice(simd, &numbers[first..first + LANES])
}

/// First to last.
#[inline(always)]
fn total<S: Simd>(numbers: Eight<S>) -> f64 {
    let [a, b, c, d, e, f, g, h] = numbers.to_array();
    ((((((a + b) + c) + d) + e) + f) + g) + h
}

/// How many waves at once; a divisor of their number.
const LANES: usize = 8;

/// The largest number whose multiples of π/2 are taken off exactly.
const LARGEST: f64 = 1e6;

/// π/2 in three parts, of which the first two have 33 bits: so many that 2²⁰ times them are exact.
#[expect(clippy::excessive_precision, reason = "as they are known")]
const QUARTER: [f64; 3] = [
    1.570_796_326_734_125_614_17,
    6.077_100_506_303_965_976_60e-11,
    2.022_266_248_795_950_631_54e-21,
];

/// To be added and taken off again: what is left is whole.
const WHOLE: f64 = 6_755_399_441_055_744.0;

/// By falling powers of the square: ±1/k!, of which the last ones but x itself, or 1 − x²/2, are left out.
const SINE: [f64; 7] = [
    -1.0 / 1_307_674_368_000.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 39_916_800.0,
    1.0 / 362_880.0,
    -1.0 / 5_040.0,
    1.0 / 120.0,
    -1.0 / 6.0,
];
const COSINE: [f64; 7] = [
    1.0 / 20_922_789_888_000.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 479_001_600.0,
    -1.0 / 3_628_800.0,
    1.0 / 40_320.0,
    -1.0 / 720.0,
    1.0 / 24.0,
];

/// Sine and cosine, to a few roundings of one; not a number beyond a million.
///
/// What is left of a number within an eighth of a turn goes into Taylor's series, as far as an `f64` sees.
#[inline(always)]
fn sin_cos<S: Simd>(x: Eight<S>) -> (Eight<S>, Eight<S>) {
    let quarters = nearest(x * std::f64::consts::FRAC_2_PI);
    let [first, second, third] = QUARTER;
    let rest = ((x - quarters * first) - quarters * second) - quarters * third;
    let square = rest * rest;
    let sin = rest + rest * (square * series(&SINE, square));
    let cos = (square * square) * series(&COSINE, square) - square * 0.5 + 1.0;
    // In which quarter: from −2 to 2, of which these are one.
    let quarter = quarters - nearest(quarters * 0.25) * 4.0;
    let (odd, turned) = (quarter.abs().simd_eq(1.0), quarter.abs().simd_eq(2.0));
    let (mine, other) = (odd.select(cos, sin), odd.select(sin, cos));
    let (back, forth) = (quarter.simd_eq(-1.0), quarter.simd_eq(1.0));
    let known = x.abs().simd_le(LARGEST);
    let nan = splat(x.simd, f64::NAN);
    (
        known.select((turned | back).select(-mine, mine), nan),
        known.select((turned | forth).select(-other, other), nan),
    )
}

#[inline(always)]
fn nearest<S: Simd>(x: Eight<S>) -> Eight<S> {
    (x + WHOLE) - WHOLE
}

#[inline(always)]
fn series<S: Simd>(numbers: &[f64; 7], square: Eight<S>) -> Eight<S> {
    let mut sum = splat(square.simd, numbers[0]);
    for number in &numbers[1..] {
        sum = sum * square + *number;
    }
    sum
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::*;
    use crate::eval::lanes::level;

    #[test]
    fn sines_are_as_those_of_the_platform() {
        let (mut worst, mut x) = (0.0_f64, 1e-9_f64);
        while x < LARGEST {
            for x in [x, -x] {
                let (sin, cos) = dispatch!(level(), simd => {
                    let (sin, cos) = sin_cos(Eight::splat(simd, x));
                    (sin.to_array()[0], cos.to_array()[0])
                });
                worst = worst.max((sin - x.sin()).abs()).max((cos - x.cos()).abs());
            }
            x *= 1.000_1;
        }
        assert!(worst < 4e-16, "{worst:e}");
    }

    #[test]
    fn too_large_a_number_has_none() {
        for x in [1.001e6, -1e300, f64::INFINITY, f64::NAN] {
            let (sin, cos) = dispatch!(level(), simd => {
                let (sin, cos) = sin_cos(Eight::splat(simd, x));
                (sin.to_array()[0], cos.to_array()[0])
            });
            assert!(sin.is_nan() && cos.is_nan(), "{x}");
        }
    }
}
