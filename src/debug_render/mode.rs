//! The flags of the parts that are drawn.

use std::ops::{BitOr, BitOrAssign};

/// Flags of the parts of fields that are drawn, in the order in which they are drawn.
///
/// ```
/// use rapier3d_fields::debug_render::FieldDebugRenderMode as Mode;
/// let mut mode = Mode::REGIONS | Mode::SLICE_ARROWS;
/// mode.insert(Mode::STREAM_LINES);
/// mode.remove(Mode::REGIONS);
/// assert!(mode.contains(Mode::SLICE_ARROWS | Mode::STREAM_LINES));
/// assert!(!mode.contains(Mode::REGIONS));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FieldDebugRenderMode(u32);

impl FieldDebugRenderMode {
    /// The outline of the region of each field that acts now, at its present place. Each solid of the region is drawn
    /// whole; a solid that is cut away, by a difference or a complement, has a colour of its own. A plane is drawn as a
    /// square of the size of the view. Sets over other axes than space, sets over several axes and predicates are not
    /// drawn.
    pub const REGIONS: Self = Self(1 << 0);
    /// The wrench of the last step on each body: an arrow for the force, and one along the axis of the torque, from the
    /// present centre of mass.
    pub const WRENCHES: Self = Self(1 << 1);
    /// The contacts that fields found in the last step, by a cross and the normal, and the points of the
    /// [disagreements](crate::cross_check::CrossCheckReport::disagreements) of the cross-check, if it is on.
    pub const CONTACTS: Self = Self(1 << 2);
    /// Arrows of the composite field on a plane.
    pub const SLICE_ARROWS: Self = Self(1 << 3);
    /// Arrows of the composite field in a cube.
    pub const VOLUME_ARROWS: Self = Self(1 << 4);
    /// Stream lines of the composite field.
    pub const STREAM_LINES: Self = Self(1 << 5);
    /// Colours the two strokes of each arrow's point by the first and the last field that count there: both have the
    /// colour of the same field where one field overrules all others.
    pub const COUNTING_FIELDS: Self = Self(1 << 6);

    /// No part.
    pub const fn empty() -> Self {
        Self(0)
    }

    /// All parts.
    pub const fn all() -> Self {
        Self((1 << 7) - 1)
    }

    /// The flags as bits of a number.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Returns true if all flags of the other are set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Sets the flags of the other.
    pub const fn insert(&mut self, other: Self) {
        self.0 |= other.0;
    }

    /// Clears the flags of the other.
    pub const fn remove(&mut self, other: Self) {
        self.0 &= !other.0;
    }
}

/// Regions, wrenches, contacts, and arrows on a plane.
impl Default for FieldDebugRenderMode {
    fn default() -> Self {
        Self::REGIONS | Self::WRENCHES | Self::CONTACTS | Self::SLICE_ARROWS
    }
}

impl BitOr for FieldDebugRenderMode {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for FieldDebugRenderMode {
    fn bitor_assign(&mut self, other: Self) {
        self.insert(other);
    }
}
