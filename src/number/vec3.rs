//! Vectors of numbers.

use std::ops::{Add, AddAssign, Div, Index, Mul, Neg, Sub};

use super::{Lanes, Number, Plain};
use crate::math::{DQuat, DVec3};

/// Three numbers of one kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vec3<T> {
    pub x: T,
    pub y: T,
    pub z: T,
}

impl<T: Number> Vec3<T> {
    #[inline(always)]
    pub(crate) fn new(x: T, y: T, z: T) -> Self {
        Vec3 { x, y, z }
    }

    #[inline(always)]
    pub(crate) fn zero() -> Self {
        constant(DVec3::ZERO)
    }

    #[inline(always)]
    pub(crate) fn map<U: Number>(self, each: impl Fn(T) -> U) -> Vec3<U> {
        Vec3::new(each(self.x), each(self.y), each(self.z))
    }

    #[inline(always)]
    pub(crate) fn zip(self, other: Self, each: impl Fn(T, T) -> T) -> Self {
        Vec3 {
            x: each(self.x, other.x),
            y: each(self.y, other.y),
            z: each(self.z, other.z),
        }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> T {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The products of the components.
    #[inline(always)]
    pub(crate) fn times(self, other: Self) -> Self {
        Vec3::new(self.x * other.x, self.y * other.y, self.z * other.z)
    }

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        Vec3::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    #[inline(always)]
    pub(crate) fn select(mask: T::Mask, yes: Self, no: Self) -> Self {
        yes.zip(no, |yes, no| T::select(mask, yes, no))
    }

    /// The vector without derivatives.
    #[inline(always)]
    pub(crate) fn re(self) -> Vec3<T::Plain> {
        self.map(T::re)
    }

    #[inline(always)]
    pub(crate) fn of(plain: Vec3<T::Plain>) -> Self {
        plain.map(T::of)
    }
}

impl Vec3<Lanes> {
    /// The vector in one lane.
    #[inline(always)]
    pub(crate) fn lane(self, lane: usize) -> DVec3 {
        DVec3::new(self.x.0[lane], self.y.0[lane], self.z.0[lane])
    }
}

/// Operators that act on each component by itself.
macro_rules! componentwise {
    ($($Trait:ident<$Other:ty>, $method:ident: ($a:ident, $b:ident) $x:expr, $y:expr, $z:expr;)*) => {$(
        impl<T: Number> $Trait<$Other> for Vec3<T> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, $b: $Other) -> Self {
                let $a = self;
                Vec3::new($x, $y, $z)
            }
        }
    )*};
}

componentwise! {
    Add<Self>, add: (a, b) a.x + b.x, a.y + b.y, a.z + b.z;
    Sub<Self>, sub: (a, b) a.x - b.x, a.y - b.y, a.z - b.z;
    Sub<DVec3>, sub: (a, b) a.x - b.x, a.y - b.y, a.z - b.z;
    Mul<T>, mul: (a, b) a.x * b, a.y * b, a.z * b;
    Div<T>, div: (a, b) a.x / b, a.y / b, a.z / b;
}

impl<T: Number> Neg for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<T: Number> AddAssign for Vec3<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T> Index<usize> for Vec3<T> {
    type Output = T;
    #[inline(always)]
    fn index(&self, axis: usize) -> &T {
        [&self.x, &self.y, &self.z][axis]
    }
}

/// A vector whose derivatives are zero.
#[inline(always)]
pub(crate) fn constant<T: Number>(v: DVec3) -> Vec3<T> {
    Vec3::new(v.x.into(), v.y.into(), v.z.into())
}

/// The vector of one sample, without its derivatives.
#[inline(always)]
pub(crate) fn real<T: Number<Plain = f64>>(v: Vec3<T>) -> DVec3 {
    DVec3::new(v.x.re(), v.y.re(), v.z.re())
}

/// |v|. Its derivative at zero, which does not exist, is taken as zero.
#[inline(always)]
pub(crate) fn length<T: Number>(v: Vec3<T>) -> T {
    v.dot(v).sqrt()
}

/// v/|v|, or zero for a zero vector.
#[inline(always)]
pub(crate) fn direction<T: Number>(v: Vec3<T>) -> Vec3<T> {
    let length = length(v);
    Vec3::select(length.re().equals(0.0), Vec3::zero(), v / length)
}

/// a × v.
#[inline(always)]
pub(crate) fn cross<T: Number>(a: DVec3, v: Vec3<T>) -> Vec3<T> {
    Vec3::new(
        v.z * a.y - v.y * a.z,
        v.x * a.z - v.z * a.x,
        v.y * a.x - v.x * a.y,
    )
}

/// `v` turned by `rotation`.
#[inline(always)]
pub(crate) fn rotate<T: Number>(rotation: DQuat, v: Vec3<T>) -> Vec3<T> {
    // An identity must not cost the last bit, since boundaries are compared exactly.
    if rotation == DQuat::IDENTITY {
        return v;
    }
    let axis = rotation.xyz();
    let across = cross(axis, v).map(|part| part * 2.0);
    v + across.map(|part| part * rotation.w) + cross(axis, across)
}

/// The vector with this value, whose derivatives follow by the chain rule from those of the inputs and from its slopes,
/// one for each input.
#[inline(always)]
pub(crate) fn chain<T: Number, const N: usize>(
    value: Vec3<T::Plain>,
    inputs: [T; N],
    slopes: impl FnOnce() -> [Vec3<T::Plain>; N],
) -> Vec3<T> {
    let mut result = Vec3::of(value);
    if T::HAS_SLOPES {
        for (input, slope) in inputs.into_iter().zip(slopes()) {
            // Zero, with the derivatives of the input.
            let moved = input - T::of(input.re());
            result += Vec3::of(slope) * moved;
        }
    }
    result
}

/// Slopes by central differences, with a step for each input.
pub(crate) fn differences<const N: usize>(
    at: [f64; N],
    steps: [f64; N],
    function: impl Fn([f64; N]) -> DVec3,
) -> [DVec3; N] {
    std::array::from_fn(|k| {
        let moved = |by: f64| {
            let mut inputs = at;
            inputs[k] += by;
            function(inputs)
        };
        (moved(steps[k]) - moved(-steps[k])) / (2.0 * steps[k])
    })
}

/// The vector, shortened to `limit` if it is longer.
#[inline(always)]
pub(crate) fn limited<T: Number>(vector: Vec3<T>, limit: f64) -> Vec3<T> {
    if limit == 0.0 {
        // The derivative is zero, too, even for small vectors.
        return Vec3::zero();
    }
    let size = length(vector);
    let shortened = vector * (size.recip() * limit);
    Vec3::select(size.re().above(limit), shortened, vector)
}
