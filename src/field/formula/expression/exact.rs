//! Functions whose derivatives need care.
//!
//! Where a function has a value and no slope, because it is infinite there (√x at 0), the slope is
//! taken as zero, as in the rest of the crate. Elsewhere infinities must not meet zeros on the way:
//! they would make a slope NaN that is finite.

use crate::field::number::Number;

/// Below it 1/x is no longer finite.
const LEAST: f64 = f64::MIN_POSITIVE;

/// |x|; at zero, the slope is that on the right.
pub(super) fn abs<T: Number>(x: T) -> T {
    match x.re() {
        // Also without the sign of −0.
        0.0 => x - x.re(),
        value if value < 0.0 => -x,
        _ => x,
    }
}

/// √x.
pub(super) fn sqrt<T: Number>(x: T) -> T {
    if x.re() < LEAST {
        return x.re().sqrt().into();
    }
    x.sqrt()
}

/// ∛x.
pub(super) fn cbrt<T: Number>(x: T) -> T {
    if x.re().abs() < LEAST {
        return x.re().cbrt().into();
    }
    x.cbrt()
}

pub(super) fn asin<T: Number>(x: T) -> T {
    if x.re().abs() >= 1.0 {
        return x.re().asin().into();
    }
    x.asin()
}

pub(super) fn acos<T: Number>(x: T) -> T {
    if x.re().abs() >= 1.0 {
        return x.re().acos().into();
    }
    x.acos()
}

pub(super) fn acosh<T: Number>(x: T) -> T {
    if x.re() <= 1.0 {
        return x.re().acosh().into();
    }
    x.acosh()
}

/// By what does not overflow, however large x.
pub(super) fn tanh<T: Number>(x: T) -> T {
    let less = |x: T| (x * -2.0).exp_m1();
    if x.re() < 0.0 {
        let less = less(-x);
        return less / (less + 2.0);
    }
    let less = less(x);
    -less / (less + 2.0)
}

/// The angle of the point (x, y); at the origin, its slope is taken as zero.
pub(super) fn atan2<T: Number>(y: T, x: T) -> T {
    let angle = y.re().atan2(x.re());
    let origin = y.re() == 0.0 && x.re() == 0.0;
    if T::NDERIV == 0 || origin {
        return angle.into();
    }
    // By the smaller of the two quotients, so that neither axis divides by zero.
    let turned = if x.re().abs() >= y.re().abs() {
        (y / x).atan()
    } else {
        -(x / y).atan()
    };
    turned - turned.re() + angle
}

/// The length of a vector of any dimension; at zero, its slope is taken as zero.
pub(super) fn hypot<T: Number>(components: &[T]) -> T {
    let sizes = components.iter().map(|x| x.re().abs());
    let largest = sizes.clone().fold(0.0, f64::max);
    if !(LEAST..f64::INFINITY).contains(&largest) {
        return sizes.fold(0.0, f64::hypot).into();
    }
    // So that squares neither overflow nor vanish.
    let relative = components.iter().map(|x| *x / largest);
    let square = relative.map(|x| x * x).fold(T::from(0.0), |a, b| a + b);
    square.sqrt() * largest
}

/// The largest whole exponent for which powers are products.
const LARGEST_PRODUCT: f64 = 64.0;

/// The exponent, if powers with it are products.
pub(super) fn whole(exponent: f64) -> Option<i32> {
    let is_whole = exponent.fract() == 0.0 && exponent.abs() <= LARGEST_PRODUCT;
    is_whole.then_some(exponent as i32)
}

/// x to a whole exponent, as a product: exact at zero and below, where logarithms are not.
pub(super) fn product<T: Number>(x: T, exponent: i32) -> T {
    // The reciprocal first: x to the exponent could overflow where the result does not.
    let mut square = if exponent < 0 { x.recip() } else { x };
    let mut result = T::from(1.0);
    let mut left = exponent.unsigned_abs();
    while left > 0 {
        if left % 2 == 1 {
            result *= square;
        }
        left /= 2;
        // One square more than needed could overflow.
        if left > 0 {
            square *= square;
        }
    }
    result
}

/// x to the exponent y. Of a base that is not positive, powers have no slope along the exponent;
/// it is taken as zero.
pub(super) fn power<T: Number>(x: T, y: T) -> T {
    let (base, exponent) = (x.re(), y.re());
    let logarithm_is_finite = (LEAST..f64::INFINITY).contains(&base);
    if let Some(whole) = whole(exponent) {
        let value = product(x, whole);
        if T::NDERIV == 0 || !logarithm_is_finite {
            return value;
        }
        // Times one, but for its slope.
        return value * ((y - exponent) * x.ln()).exp();
    }
    let value = base.powf(exponent);
    if T::NDERIV == 0 || base.abs() < LEAST || !value.is_finite() {
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
