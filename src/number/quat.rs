//! Rotations of vectors of numbers.

use super::{Number, Vec3};

/// A quaternion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quat<T> {
    pub xyz: Vec3<T>,
    pub w: T,
}

impl<T: Number> Quat<T> {
    /// The quaternion with unit length.
    #[inline(always)]
    pub(crate) fn normalized(self) -> Self {
        let scale = (self.xyz.dot(self.xyz) + self.w * self.w).sqrt().recip();
        Quat {
            xyz: self.xyz * scale,
            w: self.w * scale,
        }
    }

    /// The inverse of a rotation.
    #[inline(always)]
    pub(crate) fn inverse(self) -> Self {
        Quat {
            xyz: -self.xyz,
            w: self.w,
        }
    }

    /// The rotation by `first`, then by `self`.
    #[inline(always)]
    pub(crate) fn after(self, first: Self) -> Self {
        let (a, b) = (self.xyz, first.xyz);
        Quat {
            xyz: b * self.w + a * first.w + a.cross(b),
            w: self.w * first.w - a.dot(b),
        }
    }

    /// `v` turned by a rotation.
    #[inline(always)]
    pub(crate) fn rotate(self, v: Vec3<T>) -> Vec3<T> {
        let half = self.xyz.cross(v);
        let across = half + half;
        v + across * self.w + self.xyz.cross(across)
    }
}
