//! Sine and cosine by arithmetic alone: the bits are the same for one number and for several, and, up to a million, on
//! every machine.

use super::{Mask, Plain};

/// The largest number from which multiples of π/2 are subtracted exactly.
const LARGEST: f64 = 1e6;

/// π/2 in three parts, of which the first two have 33 bits, so that 2²⁰ times these parts are exact.
#[expect(clippy::excessive_precision, reason = "as they are known")]
const QUARTER: [f64; 3] = [
    1.570_796_326_734_125_614_17,
    6.077_100_506_303_965_976_60e-11,
    2.022_266_248_795_950_631_54e-21,
];

/// 1.5 · 2⁵²: adding this to a number and subtracting it again rounds the number to a whole one.
const WHOLE: f64 = 6_755_399_441_055_744.0;

/// Coefficients ±1/k!, for the highest power of x² first, without the terms x of the sine and 1 − x²/2 of the cosine.
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

/// Sine and cosine, with an error of a few roundings of 1.0; beyond [`LARGEST`] those of the platform.
///
/// The remainder after quarters of a turn, at most an eighth of a turn, goes into Taylor series with all terms that an
/// `f64` resolves.
#[inline(always)]
pub(crate) fn sin_cos<P: Plain>(x: P) -> (P, P) {
    let quarters = nearest(x * std::f64::consts::FRAC_2_PI);
    let [first, second, third] = QUARTER;
    let rest = ((x - quarters * first) - quarters * second) - quarters * third;
    let square = rest * rest;
    let sin = rest + rest * (square * series(&SINE, square));
    let cos = (square * square) * series(&COSINE, square) - square * 0.5 + 1.0;
    // The quarter of the turn, from −2 to 2, where −2 and 2 are the same.
    let quarter = quarters - nearest(quarters * 0.25) * 4.0;
    let (odd, turned) = (quarter.abs().equals(1.0), quarter.abs().equals(2.0));
    let (mine, other) = (P::select(odd, cos, sin), P::select(odd, sin, cos));
    let (back, forth) = (quarter.equals(-1.0), quarter.equals(1.0));
    let sin = P::select(turned | back, -mine, mine);
    let cos = P::select(turned | forth, -other, other);
    let unknown = !x.abs().at_most(LARGEST);
    if unknown.any() {
        let far = |known: P, function: fn(f64) -> f64| P::select(unknown, x.map(function), known);
        return (far(sin, f64::sin), far(cos, f64::cos));
    }
    (sin, cos)
}

#[inline(always)]
fn nearest<P: Plain>(x: P) -> P {
    (x + WHOLE) - WHOLE
}

#[inline(always)]
fn series<P: Plain>(numbers: &[f64; 7], square: P) -> P {
    let mut sum = P::from(numbers[0]);
    for number in &numbers[1..] {
        sum = sum * square + *number;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::Lanes;
    use super::*;

    #[test]
    fn sines_and_cosines_agree_with_those_of_the_platform() {
        let (mut worst, mut x) = (0.0_f64, 1e-9_f64);
        while x < 2.0 * LARGEST {
            for x in [x, -x] {
                let (sin, cos) = sin_cos(x);
                worst = worst.max((sin - x.sin()).abs()).max((cos - x.cos()).abs());
                let (sines, cosines) = sin_cos(Lanes::from(x));
                assert_eq!([sines.0[3], cosines.0[3]], [sin, cos]);
            }
            x *= 1.000_1;
        }
        assert!(worst < 4e-16, "{worst:e}");
    }
}
