//! The result of a case, moved by one method at one time step.

use super::{Method, Metric};

/// Wall-clock times of repeated runs on one thread, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timing {
    /// Number of runs.
    pub repeats: u32,
    /// Median.
    pub median: f64,
    /// The fastest run.
    pub min: f64,
    /// Lower quartile: a quarter of the runs were faster.
    pub lower_quartile: f64,
    /// Upper quartile: three quarters of the runs were faster.
    pub upper_quartile: f64,
}

impl Timing {
    /// Computes the quantiles of the times of runs by linear interpolation; all are zero without runs.
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

    /// The distance between the quartiles, relative to the median.
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
    // Interpolation between two infinities would give NaN.
    if below == above || place.fract() == 0.0 {
        below
    } else {
        below + place.fract() * (above - below)
    }
}

/// A measured error; infinite if the run ended in NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The metric of the error.
    pub metric: Metric,
    /// The value, by the [definition](Metric::definition) of the metric.
    pub value: f64,
}

impl Measured {
    /// An error; NaN becomes infinity.
    pub fn new(metric: Metric, value: f64) -> Self {
        let value = if value.is_nan() { f64::INFINITY } else { value };
        Measured { metric, value }
    }
}

/// A case, moved by one method at one time step, with its errors and times.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Name of the case.
    pub case: String,
    /// The method that moved it.
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
    /// Number of steps that gave a warning.
    pub warned: u64,
    /// The errors; methods are compared by the first.
    pub errors: Vec<Measured>,
    /// Wall-clock time of all steps, without setting up.
    pub timing: Timing,
}

impl Run {
    /// The error by a metric, if the run has it.
    pub fn error(&self, metric: Metric) -> Option<f64> {
        let measured = self.errors.iter().find(|error| error.metric == metric);
        measured.map(|error| error.value)
    }

    /// Median wall-clock time per unit of simulated time, µs.
    pub fn cost(&self) -> f64 {
        1e6 * self.timing.median / self.simulated
    }

    /// Whether the first error is as large as the motion itself (the length of the scene, an ångström, the largest
    /// speed), or infinite.
    pub fn diverged(&self) -> bool {
        !self.errors.first().is_some_and(|error| error.value < 1.0)
    }
}
