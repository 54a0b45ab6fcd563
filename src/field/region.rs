//! The spatial component of a field (the paper's critical set): where it acts.

use super::axis::Axis;
use super::boundary::{Neighbourhood, Normal, Pieces};
use super::error::TreeError;
use super::query::LocalQuery;
use crate::math::{
    DPose3, DVec3, Pose, Real, SharedShape, Vector, from_dvec3, to_dpose3, to_dvec3, to_f64,
};

/// Where a field is defined: a set in the space of all axes, in the field's own frame.
///
/// Outside its region a field is *not defined*, which is not the same as zero: replacements and
/// cross products see the difference. Regions are closed and regularised; see
/// [`boundary`](super::boundary) for what that means on a boundary.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let shell = Region::ball(3.0).difference(Region::ball(2.0));
/// let upper = shell.intersection(Region::half_space(-Vector::Y, 0.0));
/// let during_the_first_second = upper.intersection(Region::interval("time", 0.0, 1.0));
/// # let _ = during_the_first_second;
/// ```
#[derive(Clone, Debug)]
pub struct Region {
    /// Postfix, so that neither depth nor drop can exhaust the stack.
    steps: Vec<Step>,
}

#[derive(Clone, Debug)]
enum Step {
    Everywhere,
    Solid(Solid, Pose),
    Interval(Axis, Real, Real),
    Union,
    Intersection,
    Difference,
    Complement,
}

/// A closed body in space, in a frame of its own.
#[derive(Clone, Debug)]
enum Solid {
    Ball { radius: Real },
    Cuboid { half_extents: Vector },
    Cylinder { half_height: Real, radius: Real },
    Cone { half_height: Real, radius: Real },
    Capsule { half_height: Real, radius: Real },
    HalfSpace { outward: Vector },
    Slab { axis: usize, min: Real, max: Real },
    Shape(SharedShape),
}

/// Signed distance from a surface (negative inside) and its outward direction.
struct Surface {
    distance: f64,
    outward: DVec3,
}

impl Region {
    /// All of space, and all values of every other axis.
    pub fn everywhere() -> Self {
        Region {
            steps: vec![Step::Everywhere],
        }
    }

    /// A ball around the origin of the field's frame.
    pub fn ball(radius: Real) -> Self {
        Self::solid(Solid::Ball { radius })
    }

    /// A box around the origin, given half its edges.
    pub fn cuboid(half_extents: Vector) -> Self {
        Self::solid(Solid::Cuboid { half_extents })
    }

    /// A cylinder around the y axis, as Parry's: from −`half_height` to `half_height`.
    pub fn cylinder(half_height: Real, radius: Real) -> Self {
        Self::solid(Solid::Cylinder {
            half_height,
            radius,
        })
    }

    /// A cone around the y axis, as Parry's: apex at y = `half_height`, base at −`half_height`.
    pub fn cone(half_height: Real, radius: Real) -> Self {
        Self::solid(Solid::Cone {
            half_height,
            radius,
        })
    }

    /// A capsule around the y axis, as Parry's: its segment reaches from −`half_height` to
    /// `half_height`.
    pub fn capsule(half_height: Real, radius: Real) -> Self {
        Self::solid(Solid::Capsule {
            half_height,
            radius,
        })
    }

    /// The half-space behind the plane `outward` · x = `offset`, for a unit vector `outward`.
    pub fn half_space(outward: Vector, offset: Real) -> Self {
        Self::solid(Solid::HalfSpace { outward }).at(outward * offset)
    }

    /// Any Parry shape: convex, mesh, height field, compound, voxels, …
    ///
    /// Shapes without an inside (a triangle, a height field) hold their surface only, and so,
    /// regularised, nothing.
    pub fn shape(shape: SharedShape) -> Self {
        Self::solid(Solid::Shape(shape))
    }

    /// Where `axis` lies between two values; either may be infinite.
    pub fn interval(axis: impl Into<Axis>, min: Real, max: Real) -> Self {
        let axis = axis.into();
        match axis.spatial() {
            Some(axis) => Self::solid(Solid::Slab { axis, min, max }),
            None => Region {
                steps: vec![Step::Interval(axis, min, max)],
            },
        }
    }

    fn solid(solid: Solid) -> Self {
        Region {
            steps: vec![Step::Solid(solid, Pose::IDENTITY)],
        }
    }

    /// The same region moved to `local_pose` (a pose, or a point) in the field's frame.
    pub fn at(mut self, local_pose: impl Into<Placement>) -> Self {
        let Placement(moved) = local_pose.into();
        for step in &mut self.steps {
            if let Step::Solid(_, pose) = step {
                *pose = moved * *pose;
            }
        }
        self
    }

    /// Points in either region.
    pub fn union(self, other: Region) -> Self {
        self.combine(other, Step::Union)
    }

    /// Points in both regions.
    pub fn intersection(self, other: Region) -> Self {
        self.combine(other, Step::Intersection)
    }

    /// Points of this region that are not in the other, and the cut boundary.
    pub fn difference(self, other: Region) -> Self {
        self.combine(other, Step::Difference)
    }

    /// Points that are not in this region, and its boundary.
    pub fn complement(mut self) -> Self {
        self.steps.push(Step::Complement);
        self
    }

    fn combine(mut self, other: Region, step: Step) -> Self {
        self.steps.extend(other.steps);
        self.steps.push(step);
        self
    }

    /// Whether this is all of space: no test needed.
    pub(crate) fn is_everywhere(&self) -> bool {
        matches!(self.steps[..], [Step::Everywhere])
    }

    /// The radius, if this is nothing but a ball around the origin.
    pub(crate) fn as_centred_ball(&self) -> Option<Real> {
        match &self.steps[..] {
            [Step::Solid(Solid::Ball { radius }, pose)] if pose.translation == Vector::ZERO => {
                Some(*radius)
            }
            _ => None,
        }
    }

    /// A radius around the origin of the field's frame that holds the whole region, if it is
    /// bounded in space.
    pub(crate) fn bounding_radius(&self) -> Option<Real> {
        let mut stack: Vec<Option<Real>> = Vec::new();
        for step in &self.steps {
            let radius = match step {
                Step::Everywhere | Step::Interval(..) => None,
                Step::Solid(solid, pose) => solid
                    .extent()
                    .map(|extent| extent + pose.translation.length()),
                Step::Complement => {
                    stack.pop();
                    None
                }
                Step::Union | Step::Intersection | Step::Difference => {
                    let (right, left) = (stack.pop().flatten(), stack.pop().flatten());
                    match step {
                        Step::Union => left.zip(right).map(|(l, r)| l.max(r)),
                        Step::Intersection => match (left, right) {
                            (Some(l), Some(r)) => Some(l.min(r)),
                            (bounded, None) | (None, bounded) => bounded,
                        },
                        _ => left,
                    }
                }
            };
            stack.push(radius);
        }
        stack.pop().flatten()
    }

    /// The axes beyond space that the region constrains.
    pub(crate) fn axes(&self) -> impl Iterator<Item = &Axis> {
        self.steps.iter().filter_map(|step| match step {
            Step::Interval(axis, ..) => Some(axis),
            _ => None,
        })
    }

    pub(crate) fn validate(&self, field: &str) -> Result<(), TreeError> {
        for step in &self.steps {
            match step {
                Step::Solid(solid, pose) => {
                    rigid(field, "the pose of the region", pose)?;
                    solid.validate(field)?;
                }
                Step::Interval(_, min, max) => validate_interval(field, *min, *max)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// The pieces of the neighbourhood that lie in the region.
    pub(crate) fn pieces(&self, local: &LocalQuery<'_>, here: &Neighbourhood) -> Pieces {
        let mut stack: Vec<Pieces> = Vec::with_capacity(4);
        for step in &self.steps {
            let set = match step {
                Step::Everywhere => here.all(),
                Step::Solid(solid, pose) => {
                    let mut inside = here.all();
                    solid.for_each_surface(local.point, pose, |surface| {
                        let normal = || local.spatial_normal(surface.outward);
                        inside = inside & here.behind(surface.distance, normal);
                    });
                    inside
                }
                Step::Interval(axis, min, max) => {
                    let value = local.axis(axis).unwrap_or(f64::NAN);
                    here.behind(to_f64(*min) - value, || local.normal_along(axis, -1.0))
                        & here.behind(value - to_f64(*max), || local.normal_along(axis, 1.0))
                }
                Step::Complement => {
                    let set = stack.pop().unwrap_or(Pieces::NONE);
                    here.complement(set)
                }
                Step::Union | Step::Intersection | Step::Difference => {
                    let right = stack.pop().unwrap_or(Pieces::NONE);
                    let left = stack.pop().unwrap_or(Pieces::NONE);
                    match step {
                        Step::Union => left | right,
                        Step::Intersection => left & right,
                        _ => left & here.complement(right),
                    }
                }
            };
            stack.push(set);
        }
        stack.pop().unwrap_or(Pieces::NONE)
    }

    /// Adds the outward normals of the surfaces that the sample lies on exactly.
    pub(crate) fn touched(&self, local: &LocalQuery<'_>, normals: &mut Vec<Normal>) {
        for step in &self.steps {
            match step {
                Step::Solid(solid, pose) => {
                    solid.for_each_surface(local.point, pose, |surface| {
                        if surface.distance == 0.0 {
                            normals.push(local.spatial_normal(surface.outward));
                        }
                    });
                }
                Step::Interval(axis, min, max) => {
                    let value = local.axis(axis);
                    if value == Some(to_f64(*min)) || value == Some(to_f64(*max)) {
                        normals.push(local.normal_along(axis, 1.0));
                    }
                }
                _ => {}
            }
        }
    }
}

/// Where a region is put: made from a pose or from a point.
#[derive(Clone, Copy, Debug)]
pub struct Placement(Pose);

impl From<Pose> for Placement {
    fn from(pose: Pose) -> Self {
        Placement(pose)
    }
}

impl From<Vector> for Placement {
    fn from(local_point: Vector) -> Self {
        Placement(Pose::from_translation(local_point))
    }
}

pub(crate) const POSITIVE: &str = "positive and finite";
pub(crate) const FINITE: &str = "finite";

/// The error for a parameter out of range.
pub(crate) fn bad(
    field: &str,
    quantity: &'static str,
    requirement: &'static str,
    value: f64,
) -> TreeError {
    TreeError::Parameter {
        field: field.to_owned(),
        quantity,
        requirement,
        value,
    }
}

/// Checks that a parameter is positive and finite.
pub(crate) fn positive(field: &str, quantity: &'static str, value: Real) -> Result<(), TreeError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(bad(field, quantity, POSITIVE, to_f64(value)))
}

/// Checks that a parameter is finite.
pub(crate) fn finite(field: &str, quantity: &'static str, value: Real) -> Result<(), TreeError> {
    if value.is_finite() {
        return Ok(());
    }
    Err(bad(field, quantity, FINITE, to_f64(value)))
}

/// Checks that a pose is finite and turns without stretching.
pub(crate) fn rigid(field: &str, quantity: &'static str, pose: &Pose) -> Result<(), TreeError> {
    if !pose.is_finite() {
        return Err(bad(field, quantity, FINITE, f64::NAN));
    }
    let length = pose.rotation.length();
    if (length - 1.0).abs() <= 1e-3 {
        return Ok(());
    }
    let unit = "a rigid motion, its rotation of length one";
    Err(bad(field, quantity, unit, to_f64(length)))
}

fn validate_interval(field: &str, min: Real, max: Real) -> Result<(), TreeError> {
    if min < max {
        return Ok(());
    }
    let below = "less than its upper end";
    Err(bad(
        field,
        "the lower end of an interval",
        below,
        to_f64(min),
    ))
}

/// Whether a shape is more than its surface. Only meshes flagged as oriented know their inside.
fn has_inside(shape: &SharedShape) -> bool {
    let flat = shape.as_triangle().is_some()
        || shape.as_segment().is_some()
        || shape.as_polyline().is_some()
        || shape.as_heightfield().is_some();
    let mesh = shape.as_trimesh();
    !flat && mesh.is_none_or(|mesh| mesh.pseudo_normals_if_oriented().is_some())
}

impl Solid {
    /// Visits the surfaces whose inner sides intersect in the solid.
    ///
    /// `point` is in the frame of the field, `pose` the frame of the solid in it; directions are
    /// returned in the frame of the field.
    fn for_each_surface(&self, point: DVec3, pose: &Pose, mut visit: impl FnMut(Surface)) {
        let pose: DPose3 = to_dpose3(pose);
        let p = if pose == DPose3::IDENTITY {
            point
        } else {
            pose.inverse_transform_point(point)
        };
        let mut surface = |distance: f64, outward: DVec3| {
            visit(Surface {
                distance,
                outward: pose.rotation * outward,
            });
        };
        let mut slab = |axis: usize, half: f64| {
            let mut outward = DVec3::ZERO;
            outward[axis] = p[axis].signum();
            surface(p[axis].abs() - half, outward);
        };
        let around_y = DVec3::new(p.x, 0.0, p.z);
        match self {
            Solid::Ball { radius } => surface(p.length() - to_f64(*radius), p),
            Solid::Cuboid { half_extents } => {
                let half = to_dvec3(*half_extents);
                (0..3).for_each(|axis| slab(axis, half[axis]));
            }
            Solid::Cylinder {
                half_height,
                radius,
            } => {
                slab(1, to_f64(*half_height));
                surface(around_y.length() - to_f64(*radius), around_y);
            }
            Solid::Cone {
                half_height,
                radius,
            } => {
                let (h, r) = (to_f64(*half_height), to_f64(*radius));
                surface(-h - p.y, DVec3::NEG_Y);
                // The mantle: radius r at the base, 0 at the apex.
                let side = around_y.normalize_or_zero() * (2.0 * h) + DVec3::Y * r;
                let distance = around_y.length() * 2.0 * h - r * (h - p.y);
                surface(distance, side);
            }
            Solid::Capsule {
                half_height,
                radius,
            } => {
                let h = to_f64(*half_height);
                let from_axis = p - DVec3::Y * p.y.clamp(-h, h);
                surface(from_axis.length() - to_f64(*radius), from_axis);
            }
            Solid::HalfSpace { outward } => {
                let outward = to_dvec3(*outward);
                surface(p.dot(outward), outward);
            }
            Solid::Slab { axis, min, max } => {
                let outward = DVec3::AXES[*axis];
                surface(to_f64(*min) - p[*axis], -outward);
                surface(p[*axis] - to_f64(*max), outward);
            }
            Solid::Shape(shape) => {
                if !has_inside(shape) {
                    return surface(f64::INFINITY, DVec3::ZERO);
                }
                let local_point = from_dvec3(p);
                let projection = shape.project_local_point(local_point, false);
                let outward = p - to_dvec3(projection.point);
                // These project onto their nearest part, which need not hold the point.
                let in_parts = shape.as_compound().is_some() || shape.as_voxels().is_some();
                let is_inside =
                    projection.is_inside || in_parts && shape.contains_local_point(local_point);
                let sign = if is_inside { -1.0 } else { 1.0 };
                surface(sign * outward.length(), sign * outward);
            }
        }
    }

    /// Farthest distance of the solid from its own origin, if it is bounded.
    fn extent(&self) -> Option<Real> {
        match self {
            Solid::Ball { radius } => Some(*radius),
            Solid::Cuboid { half_extents } => Some(half_extents.length()),
            Solid::Cylinder {
                half_height,
                radius,
            }
            | Solid::Cone {
                half_height,
                radius,
            } => Some(half_height.hypot(*radius)),
            Solid::Capsule {
                half_height,
                radius,
            } => Some(half_height + radius),
            Solid::HalfSpace { .. } | Solid::Slab { .. } => None,
            Solid::Shape(shape) => {
                let bounds = shape.compute_local_bounding_sphere();
                let extent = bounds.center.length() + bounds.radius;
                extent.is_finite().then_some(extent)
            }
        }
    }

    fn validate(&self, field: &str) -> Result<(), TreeError> {
        match self {
            Solid::Ball { radius } => positive(field, "the radius of the region", *radius),
            Solid::Cuboid { half_extents } => half_extents
                .to_array()
                .iter()
                .try_for_each(|half| positive(field, "a half-extent of the region", *half)),
            Solid::Cylinder {
                half_height,
                radius,
            }
            | Solid::Cone {
                half_height,
                radius,
            }
            | Solid::Capsule {
                half_height,
                radius,
            } => {
                positive(field, "the half-height of the region", *half_height)?;
                positive(field, "the radius of the region", *radius)
            }
            Solid::HalfSpace { outward } => {
                let length = outward.length();
                if (length - 1.0).abs() <= 1e-3 {
                    return Ok(());
                }
                let quantity = "the length of the half-space's outward vector";
                Err(bad(field, quantity, "one", to_f64(length)))
            }
            Solid::Slab { min, max, .. } => validate_interval(field, *min, *max),
            Solid::Shape(_) => Ok(()),
        }
    }
}
