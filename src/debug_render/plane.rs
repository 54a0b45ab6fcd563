//! Planes, which are drawn as square patches.

use super::pen::Pen;
use super::view::View;
use crate::math::{Pose, Real, Vector};
use crate::rapier::pipeline::{DebugColor, DebugRenderBackend};

/// The number of lines of a patch in each of its directions.
const LINES: u32 = 5;

/// A plane by a point and a direction across it, of length one.
pub(super) struct OutlinePlane {
    pub point: Vector,
    pub outward: Vector,
}

impl OutlinePlane {
    /// The plane in the outer frame, in which its own frame has the pose `pose`.
    pub fn moved(&self, pose: &Pose) -> Self {
        OutlinePlane {
            point: *pose * self.point,
            outward: pose.rotation * self.outward,
        }
    }

    /// Draws the part of the plane that is nearest to the middle of the view, as large as the view.
    pub fn draw<B: DebugRenderBackend>(
        &self,
        pen: &mut Pen<'_, B>,
        view: &View,
        color: DebugColor,
    ) {
        let above = (view.centre - self.point).dot(self.outward);
        let middle = view.centre - self.outward * above;
        // An edit may have left a direction of length zero.
        let Some(outward) = self.outward.try_normalize() else {
            return;
        };
        let (right, up) = outward.any_orthonormal_pair();
        let [right, up] = [right, up].map(|way| way * view.half_size);
        for number in 0..LINES {
            let at = 2.0 * number as Real / (LINES - 1) as Real - 1.0;
            pen.line(middle + right * at - up, middle + right * at + up, color);
            pen.line(middle + up * at - right, middle + up * at + right, color);
        }
    }
}
