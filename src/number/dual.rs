//! Numbers that carry derivatives (forward mode).

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Number, Plain};

/// A number and its derivatives with respect to `K` inputs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dual<const K: usize, T = f64> {
    pub re: T,
    pub slopes: [T; K],
}

impl<const K: usize, T: Plain> Dual<K, T> {
    /// The input of index `number`, with the value `re`: its derivative with respect to itself is one.
    pub(crate) fn input(re: T, number: usize) -> Self {
        let mut slopes = [T::from(0.0); K];
        slopes[number] = T::from(1.0);
        Dual { re, slopes }
    }

    #[inline(always)]
    fn with(self, re: T, slope: impl Fn(usize) -> T) -> Self {
        let mut slopes = self.slopes;
        for (number, value) in slopes.iter_mut().enumerate() {
            *value = slope(number);
        }
        Dual { re, slopes }
    }
}

impl<const K: usize, T: Plain> From<f64> for Dual<K, T> {
    #[inline(always)]
    fn from(number: f64) -> Self {
        Dual::of(number.into())
    }
}

/// Arithmetic operations, each with its derivative with respect to input `k`.
macro_rules! arithmetic {
    ($($Trait:ident<$Other:ty>, $method:ident: ($a:ident, $b:ident) $value:expr, $k:ident $slope:expr;)*) => {$(
        impl<const K: usize, T: Plain> $Trait<$Other> for Dual<K, T> {
            type Output = Self;
            #[inline(always)]
            #[allow(clippy::suspicious_arithmetic_impl, reason = "slopes")]
            fn $method(self, $b: $Other) -> Self {
                let $a = self;
                $a.with($value, |$k| $slope)
            }
        }
    )*};
}

arithmetic! {
    Add<Self>, add: (a, b) a.re + b.re, k a.slopes[k] + b.slopes[k];
    Sub<Self>, sub: (a, b) a.re - b.re, k a.slopes[k] - b.slopes[k];
    Mul<Self>, mul: (a, b) a.re * b.re, k a.slopes[k] * b.re + a.re * b.slopes[k];
    Div<Self>, div: (a, b) a.re / b.re, k (a.slopes[k] - a.re / b.re * b.slopes[k]) / b.re;
    Add<f64>, add: (a, b) a.re + b, k a.slopes[k];
    Sub<f64>, sub: (a, b) a.re - b, k a.slopes[k];
    Mul<f64>, mul: (a, b) a.re * b, k a.slopes[k] * b;
    Div<f64>, div: (a, b) a.re / b, k a.slopes[k] / b;
}

impl<const K: usize, T: Plain> Neg for Dual<K, T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.with(-self.re, |k| -self.slopes[k])
    }
}

impl<const K: usize, T: Plain> Number for Dual<K, T> {
    type Plain = T;
    type Mask = T::Mask;
    const HAS_SLOPES: bool = true;

    #[inline(always)]
    fn re(self) -> T {
        self.re
    }

    #[inline(always)]
    fn of(re: T) -> Self {
        let slopes = [T::from(0.0); K];
        Dual { re, slopes }
    }

    #[inline(always)]
    fn select(mask: T::Mask, yes: Self, no: Self) -> Self {
        let re = T::select(mask, yes.re, no.re);
        yes.with(re, |k| T::select(mask, yes.slopes[k], no.slopes[k]))
    }

    #[inline(always)]
    fn follow(self, value: T, slope: impl FnOnce() -> T) -> Self {
        let slope = slope();
        self.with(value, |k| self.slopes[k] * slope)
    }
}
