//! The surfaces at which regions end in space, where bodies are cut.

use super::anchor::Frame;
use super::formula::Formula;
use super::leaf::Field;
use super::number::{constant, real};
use super::region::RegionStep;
use super::solid::Solid;
use super::surface::Surface;
use crate::math::{DPose3, DVec3, Pose, Vector, to_dpose3, to_dvec3, to_f64};

/// The surface of a solid in the world.
#[derive(Clone, Debug)]
pub(crate) struct Border {
    solid: Solid,
    pose: DPose3,
}

/// One of the smooth faces of a border, as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// Distance of the point from the face; negative inside the solid.
    pub distance: f64,
    /// The outward normal, in world axes and of length one.
    pub outward: DVec3,
    /// Bound of the curvature within the distance that was asked for; zero for a plane.
    pub curvature: f64,
    /// For a face that bends inwards by `curvature`: the tangent, in world axes, along which it is straight, or
    /// zero if it bends alike in all directions. `None` if the face may have another form. Meaningless for a
    /// plane.
    pub round: Option<DVec3>,
    /// True if the face is a whole sphere.
    pub is_sphere: bool,
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

    /// A face by its number, as seen from a point of the world, with a bound of its curvature within a distance
    /// of that point; `None` after the last face.
    pub(crate) fn face(&self, number: usize, world_point: DVec3, within: f64) -> Option<Face> {
        let p = self.pose.inverse_transform_point(world_point);
        let side = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
        let plane = |axis: usize, side: f64, offset: f64| {
            let distance = p[axis] * side - offset;
            (distance, DVec3::AXES[axis] * side, 0.0)
        };
        let curved = |curvature: f64| {
            let seen = self.outermost(p);
            let distance = seen.distance / seen.slope;
            (distance, real(seen.outward).normalize_or_zero(), curvature)
        };
        let (distance, outward, curvature) = match (&self.solid, number) {
            (Solid::Cuboid { half_extents }, 0..6) => {
                let axis = number / 2;
                plane(axis, side, to_dvec3(*half_extents)[axis])
            }
            (Solid::Slab { axis, max, .. }, 0) => plane(*axis, 1.0, to_f64(*max)),
            (Solid::Slab { axis, min, .. }, 1) => plane(*axis, -1.0, -to_f64(*min)),
            (Solid::Cylinder { half_height, .. }, 0 | 1) => plane(1, side, to_f64(*half_height)),
            (Solid::Cylinder { radius, .. }, 2) => curved(to_f64(*radius).recip()),
            (Solid::Cone { half_height, .. }, 0) => plane(1, -1.0, to_f64(*half_height)),
            (Solid::Cone { .. }, 1) => curved(p.x.hypot(p.z).recip()),
            (Solid::Ball { radius } | Solid::Capsule { radius, .. }, 0) => {
                curved(to_f64(*radius).recip())
            }
            (Solid::HalfSpace { outward }, 0) => {
                // Stored with length one only to rounding.
                let outward = to_dvec3(*outward).normalize();
                (p.dot(outward), outward, 0.0)
            }
            (Solid::Shape(_), 0) => curved(self.bend(p, within)),
            _ => return None,
        };
        Some(Face {
            distance,
            outward: self.pose.rotation * outward,
            curvature,
            round: self
                .straight(p, outward)
                .map(|way| self.pose.rotation * way),
            is_sphere: matches!(self.solid, Solid::Ball { .. }),
        })
    }

    /// An estimate of the curvature of a shape's surface within a distance of a point of its frame, from its
    /// deviation from the tangent plane there. Infinite if there seems to be another face within that distance.
    fn bend(&self, point: DVec3, within: f64) -> f64 {
        let seen = self.outermost(point);
        let Some(outward) = real(seen.outward).try_normalize() else {
            return f64::INFINITY;
        };
        let foot = point - outward * (seen.distance / seen.slope);
        let (u, v) = outward.any_orthonormal_pair();
        let off = [u, -u, v, -v].map(|way| self.outermost(foot + way * within).distance.abs());
        let bend = 2.0 * off.into_iter().fold(0.0, f64::max) / (within * within);
        let may_differ = (bend * within).max(SAME) * within;
        let is_as_one_face = |way: DVec3| {
            let one = seen.distance / seen.slope + outward.dot(way);
            let all = self.outermost(point + way).distance;
            (one < 0.0) == (all < 0.0) || (one - all).abs() <= may_differ
        };
        let alone = around().all(|way| is_as_one_face(way * within));
        if alone { bend } else { f64::INFINITY }
    }

    /// The tangent along which a round face is straight, as seen from a point of the solid's frame; zero if it
    /// bends alike in all directions.
    fn straight(&self, point: DVec3, outward: DVec3) -> Option<DVec3> {
        match &self.solid {
            Solid::Cylinder { .. } => Some(DVec3::Y),
            Solid::Cone { .. } => Some(outward.cross(DVec3::Y).cross(outward).normalize_or_zero()),
            Solid::Capsule { half_height, .. } if point.y.abs() < to_f64(*half_height) => {
                Some(DVec3::Y)
            }
            Solid::Ball { .. } | Solid::Capsule { .. } => Some(DVec3::ZERO),
            _ => None,
        }
    }

    /// The surface that a point of the solid's frame is farthest outside of; for solids with flat ends, their
    /// round surface.
    fn outermost(&self, point: DVec3) -> Surface {
        let mut found = Surface::new(f64::NEG_INFINITY, DVec3::ZERO);
        let round_is_last = !matches!(self.solid, Solid::Shape(_));
        let visit = |surface: Surface| {
            if round_is_last || surface.distance > found.distance {
                found = surface;
            }
        };
        self.solid
            .for_each_surface(constant(point), &Pose::IDENTITY, visit);
        found
    }
}

/// Distances that differ by less than this share of a body's size count as equal.
const SAME: f64 = 1e-6;

/// Directions all around: every direction is within 28° of one of them. What another face cuts off between them
/// is less than 1/100 of a ball.
fn around() -> impl Iterator<Item = DVec3> {
    let signs = |n: u8| f64::from(n) - 1.0;
    let cube = (0..27_u8).map(move |n| DVec3::new(signs(n % 3), signs(n / 3 % 3), signs(n / 9)));
    cube.filter_map(DVec3::try_normalize)
}

/// Returns true if the surface of a solid may pass within a distance of a point, or if that is not known.
fn passes(solid: &Solid, pose: &DPose3, world_point: DVec3, within: f64) -> bool {
    let point = pose.inverse_transform_point(world_point);
    let mut excess = f64::NEG_INFINITY;
    solid.for_each_surface(constant(point), &Pose::IDENTITY, |surface: Surface| {
        excess = excess.max(surface.distance);
    });
    excess.is_nan() || excess.abs() <= within
}
