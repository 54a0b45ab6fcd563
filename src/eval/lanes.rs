//! Numbers in SIMD lanes. The number of lanes and the order of sums are fixed whatever registers the machine has,
//! and no multiply-add is fused: so the width of the registers changes no bit.

use fearless_simd::{Simd, SimdBase, SimdCombine, SimdFloat};

use crate::math::Real;

#[cfg(feature = "f32")]
mod width {
    pub use fearless_simd::{f32x4 as Four, f32x8 as Eight};
}
#[cfg(feature = "f64")]
mod width {
    pub use fearless_simd::{f64x4 as Four, f64x8 as Eight};
}

pub(super) use width::{Eight, Four};

/// A vector of [`Real`] with any number of lanes.
pub(super) trait RealLanes<S: Simd>: SimdFloat<S, Element = Real> {}

impl<S: Simd, V: SimdFloat<S, Element = Real>> RealLanes<S> for V {}

/// The number of lanes of [`Four`].
pub(super) const WIDTH: usize = 4;

/// The lanes that start at `values[at]`. The slice must be padded by [`WIDTH`].
#[inline(always)]
pub(super) fn load<S: Simd>(simd: S, values: &[Real], at: usize) -> Four<S> {
    Four::from_slice(simd, &values[at..at + WIDTH])
}

/// The sum of four lanes, first to last.
#[inline(always)]
pub(super) fn total<S: Simd>(lanes: Four<S>) -> Real {
    let [a, b, c, d] = lanes.to_array();
    ((a + b) + c) + d
}

/// The sum of eight lanes, first to last.
#[inline(always)]
pub(super) fn sum_of<S: Simd>(lanes: Eight<S>) -> Real {
    let [a, b, c, d, e, f, g, h] = lanes.to_array();
    ((((((a + b) + c) + d) + e) + f) + g) + h
}

/// One number for each of four sites.
pub(super) type Row = [Real; 4];

/// A row of four numbers, twice.
#[inline(always)]
pub(super) fn twice<S: Simd>(simd: S, row: &Row) -> Eight<S> {
    let row = Four::load_array_ref(simd, row);
    row.combine(row)
}

/// Two numbers of a row, from `first` on, each four times.
#[inline(always)]
pub(super) fn spread<S: Simd>(simd: S, row: &Row, first: usize) -> Eight<S> {
    Four::splat(simd, row[first]).combine(Four::splat(simd, row[first + 1]))
}
