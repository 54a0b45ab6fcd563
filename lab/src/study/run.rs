//! What came of a case, moved by one method at one time step.

use super::{Method, Metric};

/// Times of repeated runs on the clock, seconds, on one thread.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timing {
    /// How many runs there were.
    pub repeats: u32,
    /// Half of the runs were faster.
    pub median: f64,
    /// The fastest run.
    pub min: f64,
    /// A quarter of the runs were faster.
    pub lower_quartile: f64,
    /// Three quarters of the runs were faster.
    pub upper_quartile: f64,
}

impl Timing {
    /// The times of some runs, interpolated linearly between two; all zero if there are none.
    pub fn of(mut seconds: Vec<f64>) -> Self {
        seconds.sort_unstable_by(f64::total_cmp);
        Timing {
            repeats: seconds.len() as u32,
            median: quantile(&seconds, 0.5),
            min: quantile(&seconds, 0.0),
            lower_quartile: quantile(&seconds, 0.25),
            upper_quartile: quantile(&seconds, 0.75),
        }
    }

    /// The middle half of the runs, as a share of the median.
    pub fn spread(&self) -> f64 {
        (self.upper_quartile - self.lower_quartile) / self.median
    }
}

/// The value below which a `share` of sorted values lies, interpolated linearly.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return 0.0;
    };
    let place = share * last as f64;
    let (below, above) = (sorted[place as usize], sorted[place.ceil() as usize]);
    // Of two infinities, or when it is the value itself, there is nothing to interpolate.
    if below == above || place.fract() == 0.0 {
        below
    } else {
        below + place.fract() * (above - below)
    }
}

/// An error that was measured; infinite if the run ended in what is not a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// What it is an error of.
    pub metric: Metric,
    /// How large it is, as the metric [defines](Metric::definition) it.
    pub value: f64,
}

impl Measured {
    /// Infinite, if it is not a number.
    pub fn new(metric: Metric, value: f64) -> Self {
        let value = if value.is_nan() { f64::INFINITY } else { value };
        Measured { metric, value }
    }
}

/// One case, moved by one method at one time step: how wrong and how slow it was.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Name of the case.
    pub case: String,
    /// How it was moved.
    pub method: Method,
    /// Bits of the numbers of the world.
    pub precision: u32,
    /// Time step, in the unit of the case.
    pub dt: f64,
    /// Steps made, summed over all worlds of the case; fewer than planned if a step failed.
    pub steps: u64,
    /// Simulated time, summed over all worlds of the case.
    pub simulated: f64,
    /// Evaluations of the fields on all bodies, counted in a run of its own.
    pub evaluations: u64,
    /// Steps of which the crate warned.
    pub warned: u64,
    /// The errors; the first is the one to compare by.
    pub errors: Vec<Measured>,
    /// Time on the clock for all steps, without setting up.
    pub timing: Timing,
}

impl Run {
    /// The error by a metric, if the case has it.
    pub fn error(&self, metric: Metric) -> Option<f64> {
        let measured = self.errors.iter().find(|error| error.metric == metric);
        measured.map(|error| error.value)
    }

    /// Median time on the clock per unit of simulated time, µs.
    pub fn cost(&self) -> f64 {
        1e6 * self.timing.median / self.simulated
    }

    /// Whether the run came to nothing: its first error is as large as the motion itself (the
    /// length of the scene, an ångström, the largest speed) or not a number.
    pub fn diverged(&self) -> bool {
        !self.errors.first().is_some_and(|error| error.value < 1.0)
    }
}
