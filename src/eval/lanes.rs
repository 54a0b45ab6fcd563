//! Several scalars at once.

use crate::math::Real;

/// A vector of scalars, as wide as pays on common processors.
#[cfg(feature = "f32")]
pub(super) type Lanes = wide::f32x8;
/// A vector of scalars, as wide as pays on common processors.
#[cfg(feature = "f64")]
pub(super) type Lanes = wide::f64x4;

/// Scalars in [`Lanes`].
#[cfg(feature = "f32")]
pub(super) const WIDTH: usize = 8;
/// Scalars in [`Lanes`].
#[cfg(feature = "f64")]
pub(super) const WIDTH: usize = 4;

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
