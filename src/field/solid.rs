//! Closed solids in space. Each is the intersection of the inner sides of some surfaces.

use super::any_shape::AnyShape;
use super::error::{BuildError, positive, require, validate_interval};
use super::solid_shape::SolidShape;
use super::surface::{Face, Surface};
use crate::math::{DPose3, DVec3, Pose, Real, SharedShape, Vector, to_dpose3, to_dvec3, to_f64};
use crate::number::{Number, Plain, Vec3, constant, direction, length, rotate};
use crate::rapier::geometry::TypedShape;

/// A closed solid, in a frame of its own.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[non_exhaustive]
pub enum Solid {
    /// A ball around the origin.
    Ball {
        /// Its radius.
        radius: Real,
    },
    /// A box around the origin.
    Cuboid {
        /// Half the edges.
        half_extents: Vector,
    },
    /// A cylinder around the y axis.
    Cylinder {
        /// Half its height.
        half_height: Real,
        /// Its radius.
        radius: Real,
    },
    /// A cone around the y axis, with its apex up.
    Cone {
        /// Half its height.
        half_height: Real,
        /// The radius of its base.
        radius: Real,
    },
    /// A capsule around the y axis.
    Capsule {
        /// Half the length of its axis.
        half_height: Real,
        /// Its radius.
        radius: Real,
    },
    /// The half-space behind a plane through the origin.
    HalfSpace {
        /// The outward direction, of length one.
        outward: Vector,
    },
    /// The space between two planes.
    Slab {
        /// The axis across the planes: 0, 1 or 2 for x, y or z.
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

/// The surface of the nearer of two planes across an axis.
#[inline(always)]
fn slab<P: Plain>(p: Vec3<P>, axis: usize, half: f64) -> (P, Vec3<P>) {
    let side = P::select(p[axis].below(0.0), (-1.0).into(), 1.0.into());
    (p[axis].abs() - half, constant(DVec3::AXES[axis]) * side)
}

impl Solid {
    /// A shape of Parry's as a solid. Balls, cuboids, cylinders, cones, half-spaces, and capsules around the y axis
    /// become the variants of these names, which are tested at eight points at once.
    pub(super) fn of(shape: SharedShape) -> Self {
        match shape.as_typed_shape() {
            TypedShape::Ball(it) => Solid::Ball { radius: it.radius },
            TypedShape::Cuboid(it) => Solid::Cuboid {
                half_extents: it.half_extents,
            },
            TypedShape::Cylinder(it) => Solid::Cylinder {
                half_height: it.half_height,
                radius: it.radius,
            },
            TypedShape::Cone(it) => Solid::Cone {
                half_height: it.half_height,
                radius: it.radius,
            },
            TypedShape::Capsule(it)
                if it.segment.a == -it.segment.b && it.segment.b == Vector::Y * it.segment.b.y =>
            {
                Solid::Capsule {
                    half_height: it.segment.b.y.abs(),
                    radius: it.radius,
                }
            }
            TypedShape::HalfSpace(it) => Solid::HalfSpace { outward: it.normal },
            _ => Solid::Shape(AnyShape(shape.clone()).into()),
        }
    }

    /// Visits the surfaces whose inner sides intersect in the solid. `pose` is the frame of the solid in that of the
    /// field; `point` and the directions visited are in the frame of the field.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn for_each_surface<P: Plain>(
        &self,
        point: Vec3<P>,
        pose: &Pose,
        mut visit: impl FnMut(Surface<P>),
    ) {
        let pose: DPose3 = to_dpose3(pose);
        let p = if pose == DPose3::IDENTITY {
            point
        } else {
            rotate(pose.rotation.inverse(), point - pose.translation)
        };
        if let Solid::Shape(shape) = self {
            return shape.for_each_surface(p, |seen| {
                let outward = rotate(pose.rotation, seen.outward);
                visit(Surface { outward, ..seen });
            });
        }
        for number in 0..3 {
            if let Some(seen) = self.surface(number, p) {
                let outward = rotate(pose.rotation, seen.outward);
                visit(Surface { outward, ..seen });
            }
        }
    }

    /// A surface by its number, in the frame of the solid.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn surface<P: Plain>(&self, number: usize, p: Vec3<P>) -> Option<Surface<P>> {
        let y = constant::<P>(DVec3::Y);
        let around_y = Vec3::new(p.x, P::from(0.0), p.z);
        let (distance, outward) = match (self, number) {
            (Solid::Ball { radius }, 0) => (length(p) - to_f64(*radius), p),
            (Solid::Cuboid { half_extents }, axis) => slab(p, axis, to_dvec3(*half_extents)[axis]),
            (Solid::Cylinder { half_height, .. }, 0) => slab(p, 1, to_f64(*half_height)),
            (Solid::Cylinder { radius, .. }, 1) => (length(around_y) - to_f64(*radius), around_y),
            (Solid::Cone { half_height, .. }, 0) => (-p.y - to_f64(*half_height), -y),
            (
                Solid::Cone {
                    half_height,
                    radius,
                },
                1,
            ) => {
                let (h, r) = (to_f64(*half_height), to_f64(*radius));
                // The mantle: radius r at the base, 0 at the apex.
                let side = direction(around_y) * P::from(2.0 * h) + y * P::from(r);
                let distance = length(around_y) * (2.0 * h) - (-p.y + h) * r;
                (distance / (2.0 * h).hypot(r), side)
            }
            (
                Solid::Capsule {
                    half_height,
                    radius,
                },
                0,
            ) => {
                let h = to_f64(*half_height);
                let along = p.y.greater((-h).into()).lesser(h.into());
                let from_axis = Vec3::new(p.x, p.y - along, p.z);
                (length(from_axis) - to_f64(*radius), from_axis)
            }
            (Solid::HalfSpace { outward }, 0) => {
                let outward = constant(to_dvec3(*outward));
                (p.dot(outward), outward)
            }
            (Solid::Slab { axis, min, .. }, 0) => {
                (-p[*axis] + to_f64(*min), constant(-DVec3::AXES[*axis]))
            }
            (Solid::Slab { axis, max, .. }, 1) => {
                (p[*axis] - to_f64(*max), constant(DVec3::AXES[*axis]))
            }
            _ => return None,
        };
        Some(Surface::seen(distance, outward))
    }

    /// A face by its number, as seen from a point of the solid's frame and in its axes, with a bound of its
    /// curvature within a distance of that point; `None` after the last face.
    pub(super) fn face(&self, number: usize, p: DVec3, within: f64) -> Option<Face> {
        let side = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
        let plane = |axis: usize, end: f64| Face::plane(p, DVec3::AXES[axis] * side, end);
        let round = |surface: usize, radius: f64, straight: DVec3| {
            let seen = self.surface(surface, constant(p))?;
            Some(Face::curved(&seen, radius.recip(), Some(straight)))
        };
        Some(match (self, number) {
            (Solid::Ball { radius }, 0) => Face {
                is_sphere: true,
                ..round(0, to_f64(*radius), DVec3::ZERO)?
            },
            (Solid::Cuboid { half_extents }, 0..6) => {
                plane(number / 2, to_dvec3(*half_extents)[number / 2])
            }
            (Solid::Cylinder { half_height, .. }, 0 | 1) => plane(1, to_f64(*half_height)),
            (Solid::Cylinder { radius, .. }, 2) => round(1, to_f64(*radius), DVec3::Y)?,
            (Solid::Cone { half_height, .. }, 0) => Face::plane(p, -DVec3::Y, to_f64(*half_height)),
            (Solid::Cone { .. }, 1) => {
                let mut mantle = round(1, p.x.hypot(p.z), DVec3::ZERO)?;
                let straight = mantle.outward.cross(DVec3::Y).cross(mantle.outward);
                mantle.round = Some(straight.normalize_or_zero());
                mantle
            }
            (
                Solid::Capsule {
                    half_height,
                    radius,
                },
                0,
            ) => {
                let is_beside = p.y.abs() < to_f64(*half_height);
                let straight = if is_beside { DVec3::Y } else { DVec3::ZERO };
                round(0, to_f64(*radius), straight)?
            }
            (Solid::HalfSpace { outward }, 0) => {
                // The stored vector may be up to 1e-3 off length one.
                Face::plane(p, to_dvec3(*outward).normalize(), 0.0)
            }
            (Solid::Slab { axis, max, .. }, 0) => plane(*axis, to_f64(*max)),
            (Solid::Slab { axis, min, .. }, 1) => plane(*axis, -to_f64(*min)),
            (Solid::Shape(shape), 0) => shape.face(p, within),
            _ => return None,
        })
    }

    /// Depth of a point of the field's frame inside the solid, negative outside; no more than the distance from
    /// the surface.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn depth<T: Number>(&self, point: Vec3<T>, pose: &Pose) -> T {
        let mut excess = T::from(f64::NEG_INFINITY);
        self.for_each_surface(
            point.re(),
            pose,
            #[inline(always)]
            |surface| {
                let mut here = T::of(surface.distance);
                if T::HAS_SLOPES {
                    let outward = Vec3::of(direction(surface.outward) * surface.slope);
                    // Zero, with the derivative of the point.
                    let moved = point - Vec3::of(point.re());
                    here = outward.dot(moved) + here;
                }
                excess = excess.greater(here);
            },
        );
        -excess
    }

    /// Returns true if it can be evaluated at several points at once.
    pub(super) fn knows_several(&self) -> bool {
        !matches!(self, Solid::Shape(_))
    }

    /// The largest distance of a point of the solid from its own origin; `None` if it is not bounded.
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
                let fits = (length - 1.0).abs() <= 1e-3;
                let quantity = "the length of the half-space's outward vector";
                require(fits, field, quantity, "one", to_f64(length))
            }
            Solid::Slab { min, max, .. } => validate_interval(field, *min, *max),
            Solid::Shape(shape) => shape.validate(field),
        }
    }
}
