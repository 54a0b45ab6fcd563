//! Several scalars at once.

use crate::math::Real;

// As wide as the registers that the target is known to have: wider lanes are kept in two, of which
// the pair loop has none to spare.
#[cfg(all(feature = "f32", not(target_feature = "avx")))]
mod width {
    pub type Lanes = wide::f32x4;
    pub const WIDTH: usize = 4;
}
#[cfg(all(feature = "f32", target_feature = "avx"))]
mod width {
    pub type Lanes = wide::f32x8;
    pub const WIDTH: usize = 8;
}
#[cfg(all(feature = "f64", not(target_feature = "avx")))]
mod width {
    pub type Lanes = wide::f64x2;
    pub const WIDTH: usize = 2;
}
#[cfg(all(feature = "f64", target_feature = "avx"))]
mod width {
    pub type Lanes = wide::f64x4;
    pub const WIDTH: usize = 4;
}

/// Several scalars in one register, and how many.
pub(super) use width::{Lanes, WIDTH};

/// The lanes that start at `values[at]`. The slice must be padded by [`WIDTH`].
pub(super) fn load(values: &[Real], at: usize) -> Lanes {
    Lanes::new(values[at..].first_chunk().copied().unwrap_or_default())
}

/// 0, 1, 2, …
pub(super) fn counting() -> Lanes {
    let mut lanes = [0.0; WIDTH];
    for (lane, value) in lanes.iter_mut().enumerate() {
        *value = lane as Real;
    }
    Lanes::new(lanes)
}

/// Takes `lanes` off the values that start at `at`; the slice must be padded as for [`load`].
pub(super) fn subtract(values: &mut [Real], at: usize, lanes: Lanes) {
    if let Some(place) = values[at..].first_chunk_mut() {
        *place = (Lanes::new(*place) - lanes).to_array();
    }
}
