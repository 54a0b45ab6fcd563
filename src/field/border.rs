//! The surfaces at which regions end in space, where bodies are cut.

use super::anchor::Frame;
use super::formula::Formula;
use super::leaf::Field;
use super::region::RegionStep;
use super::solid::Solid;
use super::surface::Face;
use crate::math::{DPose3, DVec3, Pose, Vector, to_dpose3};
use crate::number::constant;

/// The surface of a solid in the world.
#[derive(Clone, Debug)]
pub(crate) struct Border {
    solid: Solid,
    pose: DPose3,
}

impl Border {
    /// Adds those borders of a field that may pass within a distance of a point: the solids of its region, and
    /// the surface of a fluid.
    pub(crate) fn near(field: &Field, frame: &Frame, at: DVec3, within: f64, into: &mut Vec<Self>) {
        let to_world = to_dpose3(&frame.pose);
        let mut add = |solid: &Solid, pose: DPose3| {
            if passes(solid, &pose, at, within) {
                let solid = solid.clone();
                into.push(Border { solid, pose });
            }
        };
        for step in &field.region.steps {
            if let RegionStep::Solid(solid, pose) = step {
                add(solid, to_world * to_dpose3(pose));
            }
        }
        if matches!(field.formula, Formula::Buoyancy(_)) {
            let outward = Vector::Y;
            add(&Solid::HalfSpace { outward }, to_world);
        }
    }

    /// Returns true if the border may pass within a distance of a point.
    pub(crate) fn passes(&self, world_point: DVec3, within: f64) -> bool {
        passes(&self.solid, &self.pose, world_point, within)
    }

    /// A face by its number, as seen from a point of the world and in world axes, with a bound of its curvature
    /// within a distance of that point; `None` after the last face.
    pub(crate) fn face(&self, number: usize, world_point: DVec3, within: f64) -> Option<Face> {
        let point = self.pose.inverse_transform_point(world_point);
        let seen = self.solid.face(number, point, within)?;
        Some(Face {
            outward: self.pose.rotation * seen.outward,
            round: seen.round.map(|straight| self.pose.rotation * straight),
            ..seen
        })
    }
}

/// Returns true if the surface of a solid may pass within a distance of a point.
fn passes(solid: &Solid, pose: &DPose3, world_point: DVec3, within: f64) -> bool {
    let point = constant::<f64>(pose.inverse_transform_point(world_point));
    solid.depth(point, &Pose::IDENTITY).abs() <= within
}
