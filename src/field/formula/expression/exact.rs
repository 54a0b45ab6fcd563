//! Functions whose derivatives need care.
//!
//! Where a function has a value and an infinite slope (√x at 0), the slope is taken as zero, as in the rest of
//! the crate. Elsewhere intermediate results must not multiply infinities by zeros, which would turn a finite
//! slope into NaN.

use crate::number::Number;

/// For |x| below this, 1/x may be infinite.
const LEAST: f64 = f64::MIN_POSITIVE;

/// |x|; at zero, the slope is that on the right.
pub(super) fn abs<T: Number<Plain = f64>>(x: T) -> T {
    match x.re() {
        // Also removes the sign of −0.
        0.0 => x - x.re(),
        value if value < 0.0 => -x,
        _ => x,
    }
}

/// A function of x, given its value and its derivative, which is taken as zero where it is infinite.
pub(super) fn by<T: Number<Plain = f64>>(
    x: T,
    function: fn(f64) -> f64,
    slope: impl FnOnce(f64) -> f64,
) -> T {
    let value = function(x.re());
    let slope = || Some(slope(x.re())).filter(|slope| !slope.is_infinite());
    x.follow(value, || slope().unwrap_or(0.0))
}

/// √x.
pub(super) fn sqrt<T: Number<Plain = f64>>(x: T) -> T {
    if x.re() < LEAST {
        return x.re().sqrt().into();
    }
    x.sqrt()
}

/// ∛x.
pub(super) fn cbrt<T: Number<Plain = f64>>(x: T) -> T {
    if x.re().abs() < LEAST {
        return x.re().cbrt().into();
    }
    by(x, f64::cbrt, |x| 1.0 / (3.0 * x.cbrt() * x.cbrt()))
}

pub(super) fn atan<T: Number<Plain = f64>>(x: T) -> T {
    by(x, f64::atan, |x| 1.0 / (1.0 + x * x))
}

/// The angle of the point (x, y); at the origin the slope is taken as zero.
pub(super) fn atan2<T: Number<Plain = f64>>(y: T, x: T) -> T {
    let angle = y.re().atan2(x.re());
    let origin = y.re() == 0.0 && x.re() == 0.0;
    if !T::HAS_SLOPES || origin {
        return angle.into();
    }
    // From the smaller of the two quotients, which does not divide by zero.
    let turned = if x.re().abs() >= y.re().abs() {
        atan(y / x)
    } else {
        -atan(x / y)
    };
    turned - turned.re() + angle
}

/// The length of a vector of any dimension; at zero the slope is taken as zero.
pub(super) fn hypot<T: Number<Plain = f64>>(components: &[T]) -> T {
    let sizes = components.iter().map(|x| x.re().abs());
    let largest = sizes.clone().fold(0.0, f64::max);
    if !(LEAST..f64::INFINITY).contains(&largest) {
        return sizes.fold(0.0, f64::hypot).into();
    }
    // Relative to the largest, so that squares neither overflow nor underflow.
    let relative = components.iter().map(|x| *x / largest);
    let square = relative.map(|x| x * x).fold(T::from(0.0), |a, b| a + b);
    square.sqrt() * largest
}

/// The largest whole exponent for which powers are products.
const LARGEST_PRODUCT: f64 = 64.0;

/// The exponent, if powers with it are computed as products.
pub(super) fn whole(exponent: f64) -> Option<i32> {
    let is_whole = exponent.fract() == 0.0 && exponent.abs() <= LARGEST_PRODUCT;
    is_whole.then_some(exponent as i32)
}

/// x to a whole exponent, as a product: exact at zero and below, where logarithms are not.
pub(super) fn product<T: Number<Plain = f64>>(x: T, exponent: i32) -> T {
    // The reciprocal first: x to the exponent could overflow where the result does not.
    let mut square = if exponent < 0 { x.recip() } else { x };
    let mut result = T::from(1.0);
    let mut left = exponent.unsigned_abs();
    while left > 0 {
        if left % 2 == 1 {
            result = result * square;
        }
        left /= 2;
        // One square more than needed could overflow.
        if left > 0 {
            square = square * square;
        }
    }
    result
}

/// x to the power y. For a base that is not positive the slope along the exponent is taken as zero.
pub(super) fn power<T: Number<Plain = f64>>(x: T, y: T) -> T {
    let (base, exponent) = (x.re(), y.re());
    let logarithm_is_finite = (LEAST..f64::INFINITY).contains(&base);
    if let Some(whole) = whole(exponent) {
        let value = product(x, whole);
        if !T::HAS_SLOPES || !logarithm_is_finite {
            return value;
        }
        // The factor is one, with the slope along the exponent.
        return value * ((y - exponent) * x.ln()).exp();
    }
    let value = base.powf(exponent);
    if !T::HAS_SLOPES || base.abs() < LEAST || !value.is_finite() {
        return value.into();
    }
    let (size, y) = if base < 0.0 {
        (-x, exponent.into())
    } else {
        (x, y)
    };
    let logarithm = size.ln() * y;
    (logarithm - logarithm.re()).exp() * value
}
