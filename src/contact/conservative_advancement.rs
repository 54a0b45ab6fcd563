//! The first moment at which a gap closes.
//!
//! Conservative advancement of second order: with f the gap (or a rising function of it) and f'' ≥ −M, the parabola f +
//! f' h − M h²/2 lies below f, so nothing can touch before its root. At a simple root this converges like Newton's
//! method, from outside; at a grazing touch each evaluation halves the gap. Motion that stays close without touching
//! would take ever smaller steps; after [`MAX_ITERATIONS`] evaluations the gap is sampled instead, and a change of sign
//! is bracketed.

use crate::math::bisect;

/// Evaluations before sampling begins.
const MAX_ITERATIONS: usize = 128;

/// Samples over the whole span once sampling has begun.
const SAMPLES: f64 = 4096.0;

/// The same limits for gaps that are expensive to evaluate. Overlapping parts that separate are sampled as often, to
/// find when they close again.
const DEAR_ITERATIONS: usize = 32;
const DEAR_SAMPLES: f64 = 64.0;

/// Whether overlapping parts approach shows by the change of the gap in the time in which it may change by this many
/// tolerances.
const CLEARLY: f64 = 8.0;

/// Halvings of the interval in which the sign changes.
const BISECTIONS: u32 = 60;

/// A gap at one moment, with the bounds that advancement needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct GapBound {
    /// Increases with the gap; zero where the parts touch.
    pub value: f64,
    pub slope: f64,
    /// M ≥ 0: the second derivative is at least −M from this moment to the end of the span.
    pub curvature: f64,
}

/// The first moment in `[from, to]` at which the value is at most `tolerance` and falling. `look` evaluates the gap at
/// a moment.
pub(super) fn first_touch(
    [from, to]: [f64; 2],
    tolerance: f64,
    look: impl Fn(f64) -> GapBound,
) -> Option<f64> {
    let floor = (to - from) / SAMPLES;
    let mut time = from;
    let mut looks = 0;
    loop {
        let seen = look(time);
        // False for NaN, which then ends the search in `free_stretch`.
        if seen.value <= tolerance && seen.slope < 0.0 {
            return Some(time);
        }
        let step = free_stretch(&seen)?;
        looks += 1;
        let close = looks > MAX_ITERATIONS || step == 0.0;
        let next = time + if close { step.max(floor) } else { step };
        if next > to {
            // A touch within rounding of the end is found by the next step.
            return None;
        }
        if next <= time {
            // The step is smaller than the resolution of `time` in `f64`.
            return (seen.slope < 0.0).then_some(time);
        }
        if close && seen.value > 0.0 && look(next).value < 0.0 {
            return Some(bisect([time, next], BISECTIONS, |t| look(t).value > 0.0));
        }
        time = next;
    }
}

/// The time for which the lower bound of the value stays positive; `None` if it never reaches zero.
fn free_stretch(seen: &GapBound) -> Option<f64> {
    let GapBound {
        value,
        slope,
        curvature,
    } = *seen;
    if slope >= 0.0 && value <= 0.0 {
        // The parts overlap or have just touched, and separate: the earliest time at which they may approach again.
        return (curvature > 0.0).then(|| slope / curvature);
    }
    let value = value.max(0.0);
    if slope >= 0.0 {
        let root = slope + (slope * slope + 2.0 * curvature * value).sqrt();
        return (curvature > 0.0).then(|| root / curvature);
    }
    let root = (slope * slope + 2.0 * curvature * value).sqrt() - slope;
    let stretch = 2.0 * value / root;
    stretch.is_finite().then_some(stretch)
}

/// As [`first_touch`], for a gap of which only the value and the maximal closing speed are known. Advances by gap /
/// speed until the gap is at most `tolerance`. Samples are not farther apart than `thin` / speed, up to a limit, so that
/// what is thicker does not pass between two.
pub(super) fn first_touch_of_distance(
    [from, to]: [f64; 2],
    tolerance: f64,
    speed: f64,
    thin: f64,
    gap: impl Fn(f64) -> Option<f64>,
) -> Option<f64> {
    if speed <= 0.0 {
        return None;
    }
    let floor = (to - from) / ((to - from) * speed / thin).clamp(DEAR_SAMPLES, SAMPLES);
    let (mut time, mut last, mut looks) = (from, None, 0);
    while time <= to {
        let seen = match gap(time) {
            Some(seen) => seen,
            // The gap cannot close within the span.
            None if last.is_none() => return None,
            // Parry did not find the gap, though it was small a moment before.
            None if time + floor > time => {
                time += floor;
                continue;
            }
            None => return None,
        };
        if seen <= tolerance {
            let before: f64 = last.unwrap_or(time);
            let ahead = f64::max(CLEARLY * tolerance / speed, (to - from) / SAMPLES);
            let soon = (time + ahead).min(to);
            let closing = last.is_some() || gap(soon).is_none_or(|g| g < seen);
            if closing {
                return Some(if seen < 0.0 {
                    // Until the remaining way is far below the tolerance; zero for parts that overlap from the start.
                    let halvings = (32.0 * speed * (time - before) / tolerance).log2().ceil();
                    let halvings = halvings.clamp(0.0, f64::from(BISECTIONS)) as u32;
                    bisect([before, time], halvings, |t| gap(t).is_none_or(|g| g > 0.0))
                } else {
                    time
                });
            }
        } else {
            last = Some(time);
        }
        looks += 1;
        let step = seen.max(tolerance * 0.5) / speed;
        let patient = looks <= DEAR_ITERATIONS && seen > tolerance;
        let next = time + if patient { step } else { step.max(floor) };
        // The step may be below the resolution of `time` in `f64`.
        let next = if next > time { next } else { time + floor };
        if next <= time {
            return None;
        }
        time = next;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(f: impl Fn(f64) -> [f64; 2], curvature: f64) -> impl Fn(f64) -> GapBound {
        move |t| {
            let [value, slope] = f(t);
            GapBound {
                value,
                slope,
                curvature,
            }
        }
    }

    #[test]
    fn simple_roots_are_found_to_the_last_digit() {
        let line = of(|t| [1.0 - t, -1.0], 0.0);
        assert_eq!(first_touch([0.0, 2.0], 0.0, line), Some(1.0));
        let wave = of(|t| [(5.0 * t).cos() + 0.5, -5.0 * (5.0 * t).sin()], 25.0);
        let found = first_touch([0.0, 2.0], 1e-15, wave).expect("a root");
        let exact = (2.0_f64 * std::f64::consts::PI / 3.0) / 5.0;
        assert!((found - exact).abs() < 1e-15, "{found} {exact}");
    }

    /// Late in a step at high speed, the resolution of time is coarser than the tolerance.
    #[test]
    fn a_root_between_two_representable_times_is_found() {
        for k in 1..100 {
            let at = 3.0 + f64::from(k) * 0.012_345_678_9;
            let fast = of(|t| [1e3 * (at - t) + 1e-14, -1e3], 0.0);
            let found = first_touch([0.0, 6.0], 1e-16, fast).expect("a root");
            assert!((found - at).abs() < 1e-14, "{found} {at}");
        }
    }

    #[test]
    fn a_graze_is_distinguished_from_a_miss() {
        let near = |least: f64| {
            of(
                move |t| [(t - 0.7) * (t - 0.7) + least, 2.0 * (t - 0.7)],
                8.0,
            )
        };
        assert!(first_touch([0.0, 1.0], 1e-15, near(1e-12)).is_none());
        let found = first_touch([0.0, 1.0], 1e-15, near(-1e-12)).expect("a root");
        assert!((found - (0.7 - 1e-6)).abs() < 1e-9, "{found}");
    }

    #[test]
    fn parts_that_separate_touch_only_once_they_approach_again() {
        let hop = of(|t| [t * (1.0 - t), 1.0 - 2.0 * t], 2.0);
        assert_eq!(
            first_touch([0.0, 2.0], 1e-15, &hop).map(|t| (t * 1e9).round()),
            Some(1e9)
        );
        let overlap = of(|t| [t * (1.0 - t) - 0.1, 1.0 - 2.0 * t], 2.0);
        let found = first_touch([0.0, 2.0], 1e-15, overlap).expect("out, and in again");
        assert!((found - 0.887_298_334_620_741_7).abs() < 1e-9, "{found}");
        assert!(first_touch([0.0, 1.0], 1e-9, of(|_| [0.0, 0.0], 0.0)).is_none());
        assert!(first_touch([0.0, 1.0], 1e-9, of(|_| [f64::NAN; 2], 1.0)).is_none());
    }

    #[test]
    fn a_search_without_touch_ends_and_a_late_touch_is_bracketed() {
        let skim = of(
            |t| [1e-13 + 1e-14 * (40.0 * t).sin(), 4e-13 * (40.0 * t).cos()],
            1.0,
        );
        assert!(first_touch([0.0, 1.0], 1e-16, skim).is_none());
        let late = of(
            |t| [1e-13 - (t - 0.5).max(0.0), if t > 0.5 { -1.0 } else { 0.0 }],
            1.0,
        );
        let found = first_touch([0.0, 1.0], 1e-16, late).expect("a root");
        assert!((found - 0.5).abs() < 1e-12, "{found}");
    }

    #[test]
    fn a_touch_is_found_from_distances_alone() {
        let fall = |t: f64| Some(1.0 - t * t);
        let found = first_touch_of_distance([0.0, 2.0], 1e-9, 4.0, 1.0, fall).expect("a root");
        assert!((found - 1.0).abs() < 1e-9, "{found}");
        assert!(first_touch_of_distance([0.0, 2.0], 1e-9, 4.0, 1.0, |_| None).is_none());
        assert!(first_touch_of_distance([0.0, 2.0], 1e-9, 1.0, 1.0, |t| Some(t - 0.1)).is_none());
        let lost = |t: f64| fall(t).filter(|gap| gap.abs() > 0.01);
        let found = first_touch_of_distance([0.0, 2.0], 1e-9, 4.0, 1.0, lost).expect("a root");
        assert!((found - 1.0).abs() < 0.01, "found again behind it: {found}");
        let gone = |t: f64| (t == 0.0).then_some(1.0);
        assert!(first_touch_of_distance([0.0, 2.0], 1e-9, 4.0, 1.0, gone).is_none());
        let still = |span| first_touch_of_distance(span, 1e-9, f64::INFINITY, 1.0, |_| Some(0.1));
        assert!(still([0.0, 0.0]).is_none() && still([1.0, 2.0]).is_none());
    }
}
