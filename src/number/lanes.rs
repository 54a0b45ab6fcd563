//! Eight numbers at once.
//!
//! Operations are plain loops over all lanes, which are compiled for the registers of the function that
//! inlines them ([`vectorize`](fearless_simd::Simd::vectorize)). Nothing is fused or regrouped, so each lane
//! has the bits of the same operation on one `f64`, on every machine.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::{Mask, Number, Plain};

/// The number of lanes.
pub(crate) const LANES: usize = 8;

/// Eight numbers.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Lanes(pub [f64; LANES]);

/// A mask of eight numbers: all bits of a lane are set, or none.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct LaneMask([u64; LANES]);

impl Lanes {
    #[inline(always)]
    pub(crate) fn from_fn(number: impl Fn(usize) -> f64) -> Self {
        Lanes(each_lane(number))
    }

    /// The sum of all lanes, first to last.
    #[inline(always)]
    pub(crate) fn total(self) -> f64 {
        let [first, rest @ ..] = self.0;
        rest.iter().fold(first, |sum, number| sum + number)
    }
}

impl LaneMask {
    #[inline(always)]
    pub(crate) fn is_set(self, lane: usize) -> bool {
        self.0[lane] != 0
    }

    /// One bit for each lane.
    #[inline(always)]
    pub(crate) fn bits(self) -> u64 {
        let each = self.0.iter().enumerate();
        each.fold(0, |bits, (lane, set)| bits | (set & 1) << lane)
    }

    #[inline(always)]
    pub(crate) fn from_fn(is_set: impl Fn(usize) -> bool) -> Self {
        LaneMask(each_lane(
            #[inline(always)]
            |lane| if is_set(lane) { !0 } else { 0 },
        ))
    }
}

/// The indices of the bits set in a mask, first to last.
#[inline(always)]
pub(crate) fn lanes_of(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (lane < 64).then_some(lane)
    })
}

/// `std::array::from_fn`, but always inlined.
#[inline(always)]
pub(crate) fn each_lane<T>(each: impl Fn(usize) -> T) -> [T; LANES] {
    [
        each(0),
        each(1),
        each(2),
        each(3),
        each(4),
        each(5),
        each(6),
        each(7),
    ]
}

macro_rules! arithmetic {
    ($($Trait:ident $method:ident $operator:tt),*) => {$(
        impl $Trait for Lanes {
            type Output = Lanes;
            #[inline(always)]
            fn $method(self, other: Lanes) -> Lanes {
                Lanes(each_lane(|lane| self.0[lane] $operator other.0[lane]))
            }
        }

        impl $Trait<f64> for Lanes {
            type Output = Lanes;
            #[inline(always)]
            fn $method(self, other: f64) -> Lanes {
                Lanes(each_lane(|lane| self.0[lane] $operator other))
            }
        }
    )*};
}

arithmetic!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Neg for Lanes {
    type Output = Lanes;
    #[inline(always)]
    fn neg(self) -> Lanes {
        self.map(|number| -number)
    }
}

impl From<f64> for Lanes {
    #[inline(always)]
    fn from(number: f64) -> Self {
        Lanes([number; LANES])
    }
}

impl Number for Lanes {
    type Plain = Lanes;
    type Mask = LaneMask;
    const HAS_SLOPES: bool = false;

    #[inline(always)]
    fn re(self) -> Lanes {
        self
    }

    #[inline(always)]
    fn of(plain: Lanes) -> Lanes {
        plain
    }

    #[inline(always)]
    fn select(mask: LaneMask, yes: Lanes, no: Lanes) -> Lanes {
        Lanes(each_lane(|lane| {
            let (mask, yes, no) = (mask.0[lane], yes.0[lane].to_bits(), no.0[lane].to_bits());
            f64::from_bits((yes & mask) | (no & !mask))
        }))
    }

    #[inline(always)]
    fn follow(self, value: Lanes, _: impl FnOnce() -> Lanes) -> Lanes {
        value
    }
}

impl Plain for Lanes {
    #[inline(always)]
    fn map(self, function: impl Fn(f64) -> f64) -> Lanes {
        Lanes(each_lane(|lane| function(self.0[lane])))
    }

    #[inline(always)]
    fn single(self) -> Option<f64> {
        None
    }

    #[inline(always)]
    fn below(self, other: impl Into<Lanes>) -> LaneMask {
        let other = other.into();
        LaneMask::from_fn(|lane| self.0[lane] < other.0[lane])
    }

    #[inline(always)]
    fn equals(self, other: impl Into<Lanes>) -> LaneMask {
        let other = other.into();
        LaneMask::from_fn(|lane| self.0[lane] == other.0[lane])
    }
}

impl From<bool> for LaneMask {
    #[inline(always)]
    fn from(set: bool) -> Self {
        LaneMask::from_fn(|_| set)
    }
}

macro_rules! logic {
    ($($Trait:ident $method:ident $operator:tt),*) => {$(
        impl $Trait for LaneMask {
            type Output = LaneMask;
            #[inline(always)]
            fn $method(self, other: LaneMask) -> LaneMask {
                LaneMask(each_lane(|lane| self.0[lane] $operator other.0[lane]))
            }
        }
    )*};
}

logic!(BitAnd bitand &, BitOr bitor |);

impl Not for LaneMask {
    type Output = LaneMask;
    #[inline(always)]
    fn not(self) -> LaneMask {
        LaneMask(each_lane(|lane| !self.0[lane]))
    }
}

impl Mask for LaneMask {
    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().fold(0, |any, set| any | set) != 0
    }
}
