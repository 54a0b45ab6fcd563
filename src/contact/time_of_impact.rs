//! The time of the first touch of two parts on their paths.

use std::cell::Cell;

use super::conservative_advancement::{GapBound, first_touch};
use super::moving_shape::{Approach, SweptPair};
use super::shape_gap::{TouchDepth, touch_of_shapes};
use super::swept_parts::Form;
use crate::math::DVec3;

/// A gap below this share of the coordinates, some roundings in 64 bits, counts as touching.
const EXACT: f64 = 16.0 * f64::EPSILON;

/// The first moment in `span` at which two parts overlap by a depth and approach. Adds its work to `looks`.
pub(super) fn time_of_impact(
    [a, b]: SweptPair<'_>,
    touch: TouchDepth,
    span: [f64; 2],
    looks: &Cell<u64>,
) -> Option<f64> {
    let depth = touch.depth;
    match [a.member.form, b.member.form] {
        [Form::Ball { radius: r }, Form::Ball { radius: s }] => balls([a, b], r + s - depth, span),
        [Form::Plane { normal }, Form::Ball { radius }] if !a.turns() => {
            plane([a, b], normal, radius - depth, span)
        }
        [Form::Ball { radius }, Form::Plane { normal }] if !b.turns() => {
            plane([b, a], normal, radius - depth, span)
        }
        _ => touch_of_shapes([a, b], touch, span, looks),
    }
}

/// Two balls. The value is the square of the distance minus that of `reach`, which is smooth even at equal centres.
fn balls([a, b]: SweptPair<'_>, reach: f64, span: [f64; 2]) -> Option<f64> {
    let (one, two) = (&a.track.path, &b.track.path);
    let approach = Approach::new([a, b], span);
    let (turn_a, turn_b) = (one.bounds(), two.bounds());
    let [arm_a, arm_b] = [a, b].map(|part| part.member.arm.length());
    let swing = turn_a.angvel * arm_a + turn_b.angvel * arm_b;
    let pull = approach.pull;
    let bend = turn_a.acceleration * arm_a + turn_b.acceleration * arm_b + pull;
    // An early exit for pairs that cannot meet in the span, which are most.
    let apart = (b.place(span[0]) - a.place(span[0])).length();
    let duration = span[1] - span[0];
    if apart - reach > (approach.fastest(duration) + swing) * duration {
        return None;
    }
    let scale = one.com.length() + two.com.length() + arm_a + arm_b + reach;
    let tolerance = EXACT * scale * 2.0 * reach;
    first_touch(span, tolerance, |time| {
        let ([at_a, swing_a], [at_b, swing_b]) = (a.arm(time), b.arm(time));
        let between = (two.com(time) - one.com(time)) + (at_b - at_a);
        let closing = approach.velocity(time);
        let rate = closing + (swing_b - swing_a);
        let distance = between.length();
        let left = span[1] - time;
        let farthest = distance + (closing.length() + pull * left + swing) * left;
        let slowest = (rate.length() - bend * left).max(0.0);
        GapBound {
            value: (distance - reach) * (distance + reach),
            slope: 2.0 * between.dot(rate),
            curvature: (2.0 * (farthest * bend - slowest * slowest)).max(0.0),
        }
    })
}

/// A half-space that does not rotate, and a ball.
fn plane([a, b]: SweptPair<'_>, normal: DVec3, radius: f64, span: [f64; 2]) -> Option<f64> {
    let normal = a.track.path.attitude(span[0]) * normal;
    let radius = radius + a.member.skin;
    let path = &b.track.path;
    let approach = Approach::new([a, b], span);
    let arm = b.member.arm.length();
    let bend = path.bounds().acceleration * arm + approach.pull;
    // An early exit for balls that cannot reach the half-space in the span, which are most.
    let gap = (b.place(span[0]) - a.place(span[0])).dot(normal) - radius;
    let duration = span[1] - span[0];
    if gap > (approach.fastest(duration) + path.bounds().angvel * arm) * duration {
        return None;
    }
    let scale = path.com.length() + a.place(span[0]).length() + arm + radius;
    first_touch(span, EXACT * scale, |time| {
        let [at, swing] = b.arm(time);
        GapBound {
            value: (path.com(time) + at - a.place(time)).dot(normal) - radius,
            slope: (approach.velocity(time) + swing).dot(normal),
            curvature: bend,
        }
    })
}
