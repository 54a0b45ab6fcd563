//! Where regions end in space: bodies are cut there.

use super::anchor::Frame;
use super::formula::Formula;
use super::leaf::Field;
use super::number::{constant, real};
use super::region::Step;
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
    /// How far out of the solid the point is.
    pub distance: f64,
    /// Out of the solid, in world axes, of length one.
    pub outward: DVec3,
    /// How much it bends, at most, as far as was asked for: zero of a plane.
    pub curvature: f64,
    /// If it bends by that, inwards: the direction, in world axes, in which it does not; zero if it
    /// bends alike in all.
    pub round: Option<DVec3>,
    /// Whether it is all of a sphere.
    pub is_sphere: bool,
}

impl Border {
    /// Adds the borders of a field that may pass within a distance of a point: those of the solids
    /// its region is made of, and the surface of a fluid.
    pub(crate) fn near(field: &Field, frame: &Frame, at: (DVec3, f64), borders: &mut Vec<Border>) {
        let to_world = to_dpose3(&frame.pose);
        let mut add = |solid: &Solid, pose: DPose3| {
            if passes(solid, &pose, at) {
                let solid = solid.clone();
                borders.push(Border { solid, pose });
            }
        };
        for step in &field.region.steps {
            if let Step::Solid(solid, pose) = step {
                add(solid, to_world * to_dpose3(pose));
            }
        }
        if matches!(field.formula, Formula::Buoyancy(_)) {
            let outward = Vector::Y;
            add(&Solid::HalfSpace { outward }, to_world);
        }
    }

    /// Whether it may pass within a distance of a point.
    pub(crate) fn passes(&self, at: (DVec3, f64)) -> bool {
        passes(&self.solid, &self.pose, at)
    }

    /// A face by its number, from a point of the world, and as it is within a distance of there;
    /// `None` if there are no more.
    pub(crate) fn face(&self, number: usize, (world_point, within): (DVec3, f64)) -> Option<Face> {
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
                // Nearly of length one.
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

    /// How much the surface of any shape bends within a distance of a point of its frame, by how far
    /// it is from its tangent plane there; without bound if it has another face that near.
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

    /// Along which tangent a round face is straight, seen from a point of the solid's frame.
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

    /// The surface that a point of the solid's frame is farthest out of; of those with flat ends,
    /// the round one.
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

/// Distances that differ by this part of a body's size are the same.
const SAME: f64 = 1e-6;

/// Directions all around, of which one is within 28° of any: what another face cuts off between them is
/// less than 1/100 of a ball.
fn around() -> impl Iterator<Item = DVec3> {
    let signs = |n: u8| f64::from(n) - 1.0;
    let cube = (0..27_u8).map(move |n| DVec3::new(signs(n % 3), signs(n / 3 % 3), signs(n / 9)));
    cube.filter_map(DVec3::try_normalize)
}

/// Whether the surface of a solid may pass within a distance of a point; it may, if nobody knows.
fn passes(solid: &Solid, pose: &DPose3, (world_point, within): (DVec3, f64)) -> bool {
    let point = pose.inverse_transform_point(world_point);
    let mut excess = f64::NEG_INFINITY;
    solid.for_each_surface(constant(point), &Pose::IDENTITY, |surface: Surface| {
        excess = excess.max(surface.distance);
    });
    excess.is_nan() || excess.abs() <= within
}
