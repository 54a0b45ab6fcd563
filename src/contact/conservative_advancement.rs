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
/// tolerances. Parts farther apart than this have separated.
pub(super) const CLEARLY: f64 = 8.0;

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

/// A gap at one moment of which only the value is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap<F> {
    pub value: f64,
    /// Returns a moment until which the gap stays above a level; infinite if it does so to the end of the span.
    pub stays_above: F,
}

/// The gap of two convex parts along a fixed direction, which is never above the gap, by its values at both ends of a
/// time. It is the least of the differences of points that move smoothly, so between the ends it is at most as far below
/// the chord as a parabola of this curvature.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chord {
    pub gaps: [f64; 2],
    pub duration: f64,
    /// An upper bound of the acceleration of the points along the direction.
    pub curvature: f64,
}

impl Chord {
    /// The time for which the gap stays positive; infinite if it does so to the end.
    pub(super) fn stays_positive(&self) -> f64 {
        let [first, last] = self.gaps;
        // The bound is first − fall s + dip s², where s is the share of the duration.
        let dip = 0.5 * self.curvature * self.duration * self.duration;
        let fall = first - last + dip;
        if first <= 0.0 || !(fall.is_finite() && dip.is_finite()) {
            return 0.0;
        }
        let root = fall * fall - 4.0 * dip * first;
        let share = 2.0 * first / (fall + root.sqrt());
        if fall <= 0.0 || root < 0.0 || share > 1.0 {
            f64::INFINITY
        } else {
            share * self.duration
        }
    }
}

/// A search for the first touch by values of the gap alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct ValueSearch {
    pub span: [f64; 2],
    /// A smaller gap counts as touching.
    pub tolerance: f64,
    /// The maximal closing speed.
    pub speed: f64,
    /// Samples are not farther apart than the time of this way, up to a limit, so that what is thicker does not pass
    /// between two.
    pub thin: f64,
    /// Parts that overlap at the start and do not approach then touch once they are deeper by this, or have been apart.
    pub bearable: f64,
}

impl ValueSearch {
    /// As [`first_touch`]. Advances by what the speed and the gap along a direction allow until the gap is at most the
    /// tolerance.
    pub(super) fn first_touch<F: Fn(f64) -> f64>(
        &self,
        gap: impl Fn(f64) -> Option<Gap<F>>,
    ) -> Option<f64> {
        let ValueSearch {
            span: [from, to],
            tolerance,
            speed,
            ..
        } = *self;
        if speed <= 0.0 {
            return None;
        }
        let floor = (to - from) / ((to - from) * speed / self.thin).clamp(DEAR_SAMPLES, SAMPLES);
        let value_at = |time| gap(time).map(|seen| seen.value);
        // The gap at which the parts touch, and the last moment at which they had not reached it.
        let (mut level, mut before): (f64, Option<f64>) = (0.0, None);
        let (mut time, mut looks) = (from, 0);
        while time <= to {
            let seen = match gap(time) {
                Some(seen) => seen,
                // The gap cannot close within the span.
                None if before.is_none() => return None,
                // Parry did not find the gap, though it was small a moment before.
                None if time + floor > time => {
                    time += floor;
                    continue;
                }
                None => return None,
            };
            let value = seen.value;
            if value > CLEARLY * tolerance {
                level = 0.0;
            }
            if value - level <= tolerance {
                if let Some(before) = before {
                    let crossed = value < level;
                    let touch = || self.crossing([before, time], level, value_at);
                    return Some(if crossed { touch() } else { time });
                }
                if self.closes(time, &seen, value_at) {
                    return Some(time);
                }
                level = value - self.bearable.max(2.0 * tolerance);
                // They may have separated a moment later, and then touch again at the surface.
                before = Some(time);
                time += floor;
                continue;
            }
            before = Some(time);
            looks += 1;
            let free = (seen.stays_above)(level);
            if free == f64::INFINITY {
                return None;
            }
            let step = (value - level).max(tolerance * 0.5) / speed;
            let step = step.max(free - time);
            let patient = looks <= DEAR_ITERATIONS && value - level > tolerance;
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

    /// The moment between two at which the gap falls below a level.
    fn crossing(
        &self,
        [before, after]: [f64; 2],
        level: f64,
        value_at: impl Fn(f64) -> Option<f64>,
    ) -> f64 {
        // Until the remaining way is far below the tolerance.
        let ways = 32.0 * self.speed * (after - before) / self.tolerance;
        let halvings = ways.log2().ceil().clamp(0.0, f64::from(BISECTIONS));
        bisect([before, after], halvings as u32, |t| {
            value_at(t).is_none_or(|value| value > level)
        })
    }

    /// Returns true if parts that overlap at a moment approach then.
    fn closes<F: Fn(f64) -> f64>(
        &self,
        time: f64,
        seen: &Gap<F>,
        value_at: impl Fn(f64) -> Option<f64>,
    ) -> bool {
        if (seen.stays_above)(seen.value - 2.0 * self.tolerance) == f64::INFINITY {
            return false;
        }
        let [from, to] = self.span;
        let ahead = f64::max(CLEARLY * self.tolerance / self.speed, (to - from) / SAMPLES);
        let soon = (time + ahead).min(to);
        value_at(soon).is_none_or(|value| value < seen.value)
    }
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

    fn values(span: [f64; 2], speed: f64, gap: impl Fn(f64) -> Option<f64>) -> Option<f64> {
        let search = ValueSearch {
            span,
            tolerance: 1e-9,
            speed,
            thin: 1.0,
            bearable: 0.25,
        };
        search.first_touch(|time| {
            let stays_above = move |_| time;
            gap(time).map(|value| Gap { value, stays_above })
        })
    }

    #[test]
    fn a_touch_is_found_from_distances_alone() {
        let fall = |t: f64| Some(1.0 - t * t);
        let found = values([0.0, 2.0], 4.0, fall).expect("a root");
        assert!((found - 1.0).abs() < 1e-9, "{found}");
        assert!(values([0.0, 2.0], 4.0, |_| None).is_none());
        assert!(values([0.0, 2.0], 1.0, |t| Some(t - 0.1)).is_none());
        let lost = |t: f64| fall(t).filter(|gap| gap.abs() > 0.01);
        let found = values([0.0, 2.0], 4.0, lost).expect("a root");
        assert!((found - 1.0).abs() < 0.01, "found again behind it: {found}");
        let gone = |t: f64| (t == 0.0).then_some(1.0);
        assert!(values([0.0, 2.0], 4.0, gone).is_none());
        let still = |span| values(span, f64::INFINITY, |_| Some(0.1));
        assert!(still([0.0, 0.0]).is_none() && still([1.0, 2.0]).is_none());
    }

    /// Overlapping parts that do not approach at first, but later.
    #[test]
    fn parts_that_overlap_touch_again_once_deeper_or_after_they_were_apart() {
        let at = |found: Option<f64>| found.map(|time| (time * 1e6).round() / 1e6);
        // They approach at once.
        assert_eq!(values([0.0, 2.0], 1.0, |t| Some(-0.1 - 0.5 * t)), Some(0.0));
        // This one is always below zero, and deeper by 0.25 than at first from 0.4 + √0.66 on.
        let hop = |t: f64| Some(-0.1 + 0.4 * t - 0.5 * t * t);
        assert_eq!(at(values([0.0, 2.0], 2.0, hop)), Some(1.212_404));
        let apart = |t: f64| Some(-0.1 + t - t * t);
        assert_eq!(at(values([0.0, 2.0], 4.0, apart)), Some(0.887_298));
    }

    /// The gap along a direction saves looks, and finds the same touch.
    #[test]
    fn a_gap_along_a_direction_lets_the_search_advance_farther() {
        let looks = std::cell::Cell::new(0);
        let search = |less: Option<f64>, gravity: f64| {
            looks.set(0);
            let search = ValueSearch {
                span: [0.0, 1.0],
                tolerance: 1e-9,
                speed: 50.0,
                thin: 1.0,
                bearable: 0.1,
            };
            let gap = |t: f64| 0.3 - t + 0.5 * gravity * t * t;
            let found = search.first_touch(|t| {
                looks.set(looks.get() + 1);
                let chord = less.map(|less| Chord {
                    gaps: [gap(t) - less, gap(1.0) - less],
                    duration: 1.0 - t,
                    curvature: gravity.max(0.0),
                });
                let stays_above = move |level| {
                    let chord = chord.map(|chord| Chord {
                        gaps: chord.gaps.map(|gap| gap - level),
                        ..chord
                    });
                    t + chord.map_or(0.0, |chord| chord.stays_positive())
                };
                let value = gap(t);
                Some(Gap { value, stays_above })
            });
            (found.map(|time| (time * 1e6).round() / 1e6), looks.get())
        };
        assert_eq!(search(Some(0.0), 0.0), (Some(0.3), 2));
        let (slowly, slow_looks) = search(None, 0.0);
        assert!(slowly == Some(0.3) && slow_looks > 32, "{slow_looks}");
        // It never closes: 0.3 − t + t² is at least 0.05.
        assert_eq!(search(Some(0.0), 2.0), (None, 1));
        let (sooner, few) = search(Some(0.0), 1.0);
        assert!(sooner == Some(0.367_544) && few < 10, "{sooner:?} {few}");
        // A gap along a direction that is far below the gap does not lead beyond the touch.
        assert_eq!(search(Some(0.2), 0.0).0, Some(0.3));
        assert_eq!(search(Some(0.7), 0.0).0, Some(0.3));
    }

    /// Against samples of functions with a given curvature.
    #[test]
    fn a_chord_bounds_every_function_of_its_curvature() {
        for k in 0..400 {
            let [bend, slope, wave] = [5, 7, 11].map(|m| f64::from(k % m) - 0.4 * f64::from(m));
            let value = |t: f64| 0.6 + slope * t + 0.5 * bend * t * t - (wave * t).cos() * 0.2;
            let chord = Chord {
                gaps: [value(0.0), value(0.8)],
                duration: 0.8,
                curvature: bend.max(0.0) + 0.2 * wave * wave,
            };
            let free = chord.stays_positive().min(0.8);
            for step in 0..100 {
                let time = free * f64::from(step) / 100.0;
                assert!(value(time) > 0.0, "{k}: {time} of {free}");
            }
        }
        let chord = |gaps, curvature| Chord {
            gaps,
            duration: 2.0,
            curvature,
        };
        assert_eq!(chord([1.0, -1.0], 0.0).stays_positive(), 1.0);
        assert_eq!(chord([1.0, 1.0], 1.9).stays_positive(), f64::INFINITY);
        assert!(chord([1.0, 1.0], 2.1).stays_positive() < 1.0);
        for never in [[0.0, 1.0], [-1.0, 1.0], [f64::NAN, 1.0], [1.0, f64::NAN]] {
            assert_eq!(chord(never, 0.0).stays_positive(), 0.0, "{never:?}");
        }
        assert_eq!(chord([1.0, -1.0], f64::NAN).stays_positive(), 0.0);
    }
}
