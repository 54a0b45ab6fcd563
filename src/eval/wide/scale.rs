//! Numbers that scale vectors.

use fearless_simd::{Select, Simd, SimdBase};

use super::chunk::Eight;
use super::local::{Local, length};
use super::region::excess;
use crate::compile::DEPTH;
use crate::field::{Curve, Scalar, ScalarStep};
use crate::math::to_f64;

/// The number of each sample.
#[inline(always)]
pub(super) fn at<S: Simd>(scale: &Scalar, local: &Local<'_, S>) -> Eight<S> {
    let mut stack = [local.chunk.splat(f64::NAN); DEPTH];
    let mut top = 0;
    for step in &scale.steps {
        let before = top.max(2);
        let (left, right) = (stack[before - 2], stack[before - 1]);
        let (taken, number) = match step {
            ScalarStep::Constant(number) => (0, local.chunk.splat(to_f64(*number))),
            ScalarStep::Axis(axis) => (0, local.coordinate(axis).0),
            ScalarStep::Distance => (0, length(local.point)),
            ScalarStep::Depth(region) => (0, -excess(region, local).0),
            ScalarStep::Curve(curve) => (1, on_curve(curve, stack[top.max(1) - 1])),
            ScalarStep::Plus => (2, left + right),
            ScalarStep::Times => (2, left * right),
            ScalarStep::Lesser => (2, right.simd_lt(left).select(right, left)),
            ScalarStep::Greater => (2, right.simd_gt(left).select(right, left)),
            ScalarStep::Function(_) => (0, stack[0]),
        };
        top = top.saturating_sub(taken) + 1;
        stack[top - 1] = number;
    }
    stack[top.max(1) - 1]
}

#[inline(always)]
fn on_curve<S: Simd>(curve: &Curve, at: Eight<S>) -> Eight<S> {
    let (zero, one) = (Eight::splat(at.simd, 0.0), Eight::splat(at.simd, 1.0));
    match curve {
        Curve::Ramp { from, to, smooth } => {
            let (from, to) = (to_f64(*from), to_f64(*to));
            let t = (at - from) / (to - from);
            let bent = if *smooth { t * t * (t * -2.0 + 3.0) } else { t };
            let above = t.simd_ge(1.0).select(one, bent);
            t.simd_le(0.0).select(zero, above)
        }
        _ => {
            let mut numbers = at.to_array();
            numbers
                .iter_mut()
                .for_each(|number| *number = by_definition(curve, *number));
            Eight::load_array(at.simd, numbers)
        }
    }
}

// Not inlined: compiled once, so that it is the same whatever instructions the caller may use.
#[inline(never)]
fn by_definition(curve: &Curve, at: f64) -> f64 {
    curve.at(at)
}
