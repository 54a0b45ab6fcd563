//! Closed bodies in space, as intersections of what lies behind surfaces.

use super::error::{BuildError, bad, positive, validate_interval};
use super::number::{Number, Vec3, constant, real};
use super::solid_shape::SolidShape;
use super::surface::Surface;
use crate::math::{DPose3, DVec3, Pose, Real, Vector, to_dpose3, to_dvec3, to_f64};

/// A closed body in space, in a frame of its own.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[non_exhaustive]
pub enum Solid {
    /// Around the origin.
    Ball {
        /// Its radius.
        radius: Real,
    },
    /// Around the origin.
    Cuboid {
        /// Half its edges.
        half_extents: Vector,
    },
    /// Around the y axis.
    Cylinder {
        /// Half its height.
        half_height: Real,
        /// Its radius.
        radius: Real,
    },
    /// Around the y axis, its apex up.
    Cone {
        /// Half its height.
        half_height: Real,
        /// The radius of its base.
        radius: Real,
    },
    /// Around the y axis.
    Capsule {
        /// Half the length of its axis.
        half_height: Real,
        /// Its radius.
        radius: Real,
    },
    /// What is behind the plane through the origin.
    HalfSpace {
        /// The direction out of it, of length one.
        outward: Vector,
    },
    /// Between two planes.
    Slab {
        /// 0, 1 or 2: x, y or z.
        axis: usize,
        /// The lower end.
        #[cfg_attr(feature = "serde-serialize", serde(with = "super::saved::lower"))]
        min: Real,
        /// The upper end.
        #[cfg_attr(feature = "serde-serialize", serde(with = "super::saved::upper"))]
        max: Real,
    },
    /// A shape of Parry's.
    Shape(SolidShape),
}

impl Solid {
    /// Visits the surfaces whose inner sides intersect in the solid.
    ///
    /// `point` is in the frame of the field, `pose` the frame of the solid in it; directions are
    /// returned in the frame of the field.
    pub(super) fn for_each_surface(
        &self,
        point: DVec3,
        pose: &Pose,
        mut visit: impl FnMut(Surface),
    ) {
        let pose: DPose3 = to_dpose3(pose);
        let p = if pose == DPose3::IDENTITY {
            point
        } else {
            pose.inverse_transform_point(point)
        };
        let mut surface = |distance: f64, outward: DVec3| {
            visit(Surface::new(distance, pose.rotation * outward));
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
                surface(distance / (2.0 * h).hypot(r), side);
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
            Solid::Shape(shape) => shape.for_each_surface(p, |seen| {
                visit(Surface {
                    outward: pose.rotation * seen.outward,
                    ..seen
                });
            }),
        }
    }

    /// How deep a point of the field's frame lies inside, negative outside; no more than its
    /// distance from the surface.
    pub(super) fn depth<T: Number>(&self, point: &Vec3<T>, pose: &Pose) -> T {
        let mut excess = T::from(f64::NEG_INFINITY);
        self.for_each_surface(real(point), pose, |surface| {
            if surface.distance > excess.re() {
                let outward = surface.outward.normalize_or_zero() * surface.slope;
                let outward = constant::<T>(outward);
                // Zero, but for the derivative.
                let moved = point - constant::<T>(real(point));
                excess = outward.dot(&moved) + surface.distance;
            }
        });
        -excess
    }

    /// Farthest distance of the solid from its own origin, if it is bounded.
    pub(super) fn extent(&self) -> Option<Real> {
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
            Solid::Shape(shape) => shape.extent(),
        }
    }

    pub(super) fn validate(&self, field: &str) -> Result<(), BuildError> {
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
            Solid::Shape(shape) => shape.validate(field),
        }
    }
}
