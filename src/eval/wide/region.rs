//! Where fields are defined.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat};

use super::chunk::{Eight, Mask, Vectors};
use super::local::{Local, blur_of, length};
use crate::compile::DEPTH;
use crate::field::{Axis, Region, RegionStep, Solid};
use crate::math::{Pose, to_dvec3, to_f64};

/// How far outside of a set samples are, negative inside, and how far that may be off.
pub(super) type Excess<S> = (Eight<S>, Eight<S>);

/// The samples that a region holds; takes note of those of which roundings would decide it.
#[inline(always)]
pub(super) fn holds<S: Simd>(
    region: &Region,
    local: &Local<'_, S>,
    acts: Mask<S>,
    doubt: &mut Mask<S>,
) -> Mask<S> {
    if region.is_everywhere() {
        return acts;
    }
    let (excess, blur) = excess(region, local);
    // What is not a number is not sure, either.
    *doubt |= acts & !excess.abs().simd_gt(blur);
    acts & excess.simd_lt(0.0)
}

/// How far outside of a region samples are.
#[inline(always)]
pub(super) fn excess<S: Simd>(region: &Region, local: &Local<'_, S>) -> Excess<S> {
    let inside = (local.chunk.splat(f64::NEG_INFINITY), local.chunk.splat(0.0));
    let mut stack = [inside; DEPTH];
    let mut top = 0;
    for step in &region.steps {
        let before = top.max(2);
        let (left, right) = (stack[before - 2], stack[before - 1]);
        let (taken, set) = match step {
            RegionStep::Solid(solid, pose) => (0, of_solid(solid, pose, local)),
            RegionStep::Interval(axis, min, max) => {
                let ((value, blur), [min, max]) =
                    (local.coordinate(axis), [*min, *max].map(to_f64));
                // Numbers of a sample are compared as they are.
                let exact = matches!(axis, Axis::Time | Axis::Radius | Axis::Mass | Axis::Charge);
                let ends = if exact { 0.0 } else { largest([min, max]) };
                (
                    0,
                    (greater(-value + min, value - max), blur + blur_of(ends)),
                )
            }
            RegionStep::Complement => (1, (-stack[top.max(1) - 1].0, stack[top.max(1) - 1].1)),
            RegionStep::Union => (2, either(left, right, lesser)),
            RegionStep::Intersection => (2, either(left, right, greater)),
            RegionStep::Difference => (2, either(left, (-right.0, right.1), greater)),
            _ => (0, inside),
        };
        top = top.saturating_sub(taken) + 1;
        stack[top - 1] = set;
    }
    stack[top.max(1) - 1]
}

#[inline(always)]
fn either<S: Simd>(
    left: Excess<S>,
    right: Excess<S>,
    which: impl Fn(Eight<S>, Eight<S>) -> Eight<S>,
) -> Excess<S> {
    (which(left.0, right.0), greater(left.1, right.1))
}

#[inline(always)]
fn lesser<S: Simd>(a: Eight<S>, b: Eight<S>) -> Eight<S> {
    b.simd_lt(a).select(b, a)
}

#[inline(always)]
fn greater<S: Simd>(a: Eight<S>, b: Eight<S>) -> Eight<S> {
    b.simd_gt(a).select(b, a)
}

/// As [`Solid`] has it, surface by surface.
#[inline(always)]
fn of_solid<S: Simd>(solid: &Solid, pose: &Pose, local: &Local<'_, S>) -> Excess<S> {
    let (point, blur) = local.points_in(pose);
    let [x, y, z] = point;
    let around_y = (x * x + z * z).sqrt();
    let (excess, size) = match solid {
        Solid::Ball { radius } => (length(point) - to_f64(*radius), to_f64(*radius)),
        Solid::Cuboid { half_extents } => {
            let half = to_dvec3(*half_extents);
            let sides = greater(x.abs() - half.x, y.abs() - half.y);
            (greater(sides, z.abs() - half.z), half.max_element())
        }
        Solid::Cylinder {
            half_height,
            radius,
        } => {
            let (h, r) = (to_f64(*half_height), to_f64(*radius));
            (greater(y.abs() - h, around_y - r), h.max(r))
        }
        Solid::Cone {
            half_height,
            radius,
        } => {
            let (h, r) = (to_f64(*half_height), to_f64(*radius));
            let mantle = (around_y * (2.0 * h) - (-y + h) * r) / (2.0 * h).hypot(r);
            (greater(-y - h, mantle), h + r)
        }
        Solid::Capsule {
            half_height,
            radius,
        } => {
            let (h, r) = (to_f64(*half_height), to_f64(*radius));
            (from_axis(point, h) - r, h + r)
        }
        Solid::HalfSpace { outward } => {
            let outward = to_dvec3(*outward);
            (x * outward.x + y * outward.y + z * outward.z, 0.0)
        }
        Solid::Slab { axis, min, max } => {
            let (along, [min, max]) = (point[*axis], [*min, *max].map(to_f64));
            (greater(-along + min, along - max), largest([min, max]))
        }
        Solid::Shape(_) => (local.chunk.splat(f64::NAN), 0.0),
    };
    (excess, blur + blur_of(size))
}

/// The larger of the ends that there are.
fn largest(ends: [f64; 2]) -> f64 {
    let ends = ends.into_iter().filter(|end| end.is_finite());
    ends.map(f64::abs).fold(0.0, f64::max)
}

/// The distance from a piece of the y axis.
#[inline(always)]
fn from_axis<S: Simd>([x, y, z]: Vectors<S>, half: f64) -> Eight<S> {
    let simd = y.simd;
    let along = lesser(
        greater(y, Eight::splat(simd, -half)),
        Eight::splat(simd, half),
    );
    length([x, y - along, z])
}
