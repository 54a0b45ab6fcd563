//! The numbers over which fields are evaluated.
//!
//! Formulas, regions, scales, operators and the walk over programs are written once for all of them:
//!
//! | number | evaluates |
//! |---|---|
//! | `f64` | one sample |
//! | [`Lanes`] | eight samples at once, each with the same bits as `f64` |
//! | [`Dual`] of `f64` | one sample, with exact derivatives (forward mode) |
//!
//! So code must not branch on a number: it [selects](Number::select) between two results.

mod dual;
mod lanes;
mod quat;
mod registers;
mod sine;
mod vec3;

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

pub(crate) use dual::Dual;
pub(crate) use lanes::{LANES, LaneMask, Lanes, each_lane, lanes_of};
pub(crate) use quat::Quat;
#[cfg(test)]
pub(crate) use registers::FORCED;
pub(crate) use registers::{in_registers, level};
pub(crate) use sine::sin_cos;
pub(crate) use vec3::{
    Vec3, chain, constant, cross, differences, direction, length, limited, real, rotate,
};

/// Arithmetic with numbers of the same kind, and with constants.
pub(crate) trait Number:
    Copy
    + Debug
    + From<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// The same numbers without derivatives, which can be compared.
    type Plain: Plain<Mask = Self::Mask>;
    /// The result of comparisons.
    type Mask: Mask;
    /// True if derivatives are carried.
    const HAS_SLOPES: bool;

    /// The number without its derivatives.
    fn re(self) -> Self::Plain;

    /// A number whose derivatives are zero.
    fn of(plain: Self::Plain) -> Self;

    /// `yes` where the mask is set, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// A function of this number, given its value and its derivative at this number.
    fn follow(self, value: Self::Plain, slope: impl FnOnce() -> Self::Plain) -> Self;

    /// The square root. Its derivative at zero, which is infinite, is taken as zero.
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.re().map(f64::sqrt);
        self.follow(root, || {
            let zero = root.equals(0.0);
            Self::Plain::select(zero, 0.0.into(), Self::Plain::from(0.5) / root)
        })
    }

    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.re().map(f64::exp);
        self.follow(value, || value)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        self.follow(self.re().map(f64::ln), || self.re().recip())
    }

    #[inline(always)]
    fn recip(self) -> Self {
        Self::from(1.0) / self
    }

    /// The number to a power. Common powers need no logarithm.
    #[inline(always)]
    fn powf(self, power: f64) -> Self {
        let (x, one) = (self.re(), Self::Plain::from(1.0));
        let value = if power == -1.5 {
            one / (x * x.map(f64::sqrt))
        } else if power == -1.0 {
            one / x
        } else if power == -0.5 {
            one / x.map(f64::sqrt)
        } else if power == 0.0 {
            one
        } else if power == 0.5 {
            x.map(f64::sqrt)
        } else if power == 1.0 {
            x
        } else {
            x.map(|x| x.powf(power))
        };
        self.follow(value, || {
            let at_zero = if power == 1.0 { 1.0 } else { 0.0 };
            Self::Plain::select(x.equals(0.0), at_zero.into(), value / x * power)
        })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self::select(self.re().below(0.0), -self, self)
    }

    /// The lesser of two numbers; the first, if they are equal or not comparable.
    #[inline(always)]
    fn lesser(self, other: Self) -> Self {
        Self::select(other.re().below(self.re()), other, self)
    }

    /// The greater of two numbers; the first, if they are equal or not comparable.
    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        Self::select(other.re().above(self.re()), other, self)
    }
}

/// A number without derivatives: one number, or several at once.
pub(crate) trait Plain: Number<Plain = Self> {
    /// A function of each number.
    fn map(self, function: impl Fn(f64) -> f64) -> Self;

    /// The number, if it is one; `None` for several.
    fn single(self) -> Option<f64>;

    fn below(self, other: impl Into<Self>) -> Self::Mask;

    fn equals(self, other: impl Into<Self>) -> Self::Mask;

    #[inline(always)]
    fn above(self, other: impl Into<Self>) -> Self::Mask {
        other.into().below(self)
    }

    #[inline(always)]
    fn at_most(self, other: impl Into<Self>) -> Self::Mask {
        let other = other.into();
        self.below(other) | self.equals(other)
    }
}

/// The result of comparing one number, or several.
pub(crate) trait Mask:
    Copy + Debug + From<bool> + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// Returns true if it is set for any number.
    fn any(self) -> bool;
}

impl Mask for bool {
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

impl Number for f64 {
    type Plain = f64;
    type Mask = bool;
    const HAS_SLOPES: bool = false;

    #[inline(always)]
    fn re(self) -> f64 {
        self
    }

    #[inline(always)]
    fn of(plain: f64) -> f64 {
        plain
    }

    #[inline(always)]
    fn select(mask: bool, yes: f64, no: f64) -> f64 {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn follow(self, value: f64, _: impl FnOnce() -> f64) -> f64 {
        value
    }
}

impl Plain for f64 {
    #[inline(always)]
    fn map(self, function: impl Fn(f64) -> f64) -> f64 {
        function(self)
    }

    #[inline(always)]
    fn single(self) -> Option<f64> {
        Some(self)
    }

    #[inline(always)]
    fn below(self, other: impl Into<f64>) -> bool {
        self < other.into()
    }

    #[inline(always)]
    fn equals(self, other: impl Into<f64>) -> bool {
        self == other.into()
    }
}
