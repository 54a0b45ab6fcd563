//! Comparison of runs: order of convergence, time at equal error, and the method to use.

use super::{Method, Metric, Run};

/// The order of convergence: error ~ dt^order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderFit {
    /// Slope of log error against log dt, by least squares.
    pub order: f64,
    /// Runs that it was fitted to.
    pub points: usize,
    /// The smallest error, if errors stop falling there because of rounding.
    pub floor: Option<f64>,
}

/// Errors have stopped falling if half the step leaves more than this share.
const STALLED: f64 = 0.8;

/// Errors within this factor of the floor depend on rounding as well as on the step.
const ABOVE_FLOOR: f64 = 10.0;

/// Errors above this are too close to the size of the motion to show an order.
const ASYMPTOTIC: f64 = 0.3;

/// Fits the order of convergence to pairs of time step and error.
///
/// Leaves out errors that do not show the order: those above 0.3 (of a whole), and those within ten times the floor,
/// where a smaller step no longer helps. `None` if fewer than two points remain.
pub fn fit_order(points: &[(f64, f64)]) -> Option<OrderFit> {
    let mut points: Vec<(f64, f64)> = points.to_vec();
    points.retain(|(dt, error)| *dt > 0.0 && *error > 0.0 && *error < ASYMPTOTIC);
    points.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    let stalled = points.windows(2).position(|w| w[1].1 > STALLED * w[0].1);
    let floor = stalled.map(|place| {
        let rest = points[place..].iter().map(|(_, error)| *error);
        rest.fold(f64::INFINITY, f64::min)
    });
    if let (Some(place), Some(floor)) = (stalled, floor) {
        points.truncate(place + 1);
        points.retain(|(_, error)| *error > ABOVE_FLOOR * floor);
    }
    if points.len() < 2 {
        return None;
    }
    let logs = || points.iter().map(|(dt, error)| (dt.ln(), error.ln()));
    let count = points.len() as f64;
    let (x, y) = logs().fold((0.0, 0.0), |sum, (x, y)| (sum.0 + x, sum.1 + y));
    let (x, y) = (x / count, y / count);
    let covariance: f64 = logs().map(|(u, v)| (u - x) * (v - y)).sum();
    let variance: f64 = logs().map(|(u, _)| (u - x).powi(2)).sum();
    Some(OrderFit {
        order: covariance / variance,
        points: points.len(),
        floor,
    })
}

/// Least time at which the error is at most `error`, by log-log interpolation of pairs of time and error; `None` if it
/// never is.
pub fn time_at_error(points: &[(f64, f64)], error: f64) -> Option<f64> {
    let mut points: Vec<(f64, f64)> = points.to_vec();
    points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let place = points.iter().position(|(_, found)| *found <= error)?;
    let (time, reached) = points[place];
    let Some((earlier, missed)) = place.checked_sub(1).map(|before| points[before]) else {
        return Some(time);
    };
    if !missed.is_finite() || reached <= 0.0 {
        return Some(time);
    }
    let share = (missed / error).ln() / (missed / reached).ln();
    Some(earlier * (time / earlier).powf(share))
}

/// Comparison of the methods of a case, in one precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The case.
    pub case: String,
    /// The error at which times are compared.
    pub target: f64,
    /// The metric of the error.
    pub metric: Metric,
    /// Methods that reach the target, and their [cost](Run::cost) there; the fastest first.
    pub reached: Vec<(Method, f64)>,
    /// Methods of which no run reaches the target.
    pub missed: Vec<Method>,
    /// Methods that another one beats in time at every error they reach, each with that other. All other methods form
    /// the Pareto front.
    pub dominated: Vec<(Method, Method)>,
}

/// Compares the methods of one case at an error of `target`, and over all errors.
pub fn compare(runs: &[Run], case: &str, metric: Metric, target: f64) -> Verdict {
    let of_case = || runs.iter().filter(|run| run.case == case);
    let points = |method: Method| -> Vec<(f64, f64)> {
        let runs = of_case().filter(|run| run.method == method && !run.diverged());
        runs.filter_map(|run| Some((run.cost(), run.error(metric)?)))
            .collect()
    };
    let has = |method: &Method| of_case().any(|run| run.method == *method);
    let methods: Vec<Method> = Method::ALL.into_iter().filter(has).collect();
    let beaten = |method: Method, other: Method| {
        let others = points(other);
        let faster = |(cost, error): &(f64, f64)| {
            time_at_error(&others, *error).is_some_and(|time| time < *cost)
        };
        method != other && points(method).iter().all(faster)
    };
    let mut verdict = Verdict {
        case: case.to_owned(),
        target,
        metric,
        reached: Vec::new(),
        missed: Vec::new(),
        dominated: Vec::new(),
    };
    for &method in &methods {
        match time_at_error(&points(method), target) {
            Some(time) => verdict.reached.push((method, time)),
            None => verdict.missed.push(method),
        }
    }
    verdict.reached.sort_by(|a, b| a.1.total_cmp(&b.1));
    // In order of cost, so that the best of several is the one that is listed.
    let better: Vec<Method> = verdict.reached.iter().map(|(method, _)| *method).collect();
    for &method in &methods {
        let by = better.iter().find(|other| beaten(method, **other));
        verdict.dominated.extend(by.map(|other| (method, *other)));
    }
    verdict
}

impl Verdict {
    /// The fastest method of this crate, or the fastest of the others, and its cost.
    pub fn best(&self, ours: bool) -> Option<(Method, f64)> {
        let mut reached = self.reached.iter().copied();
        reached.find(|(method, _)| method.is_ours() == ours)
    }

    /// The cost of a method at the target.
    pub fn cost(&self, method: Method) -> Option<f64> {
        let mut reached = self.reached.iter();
        reached.find(|it| it.0 == method).map(|it| it.1)
    }
}

/// The advice as a sentence: the method to use, and how much it saves.
impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (case, error, target) = (&self.case, self.metric.name(), self.target);
        let Some(((best, cost), others)) = self.reached.split_first() else {
            return write!(
                f,
                "{case}: no method keeps the error ({error}) to {target:e}."
            );
        };
        write!(
            f,
            "{case}: for an error ({error}) of {target:e} use {}",
            best.name()
        )?;
        for (place, (method, time)) in others.iter().enumerate() {
            let lead = if place == 0 { "; it is" } else { "," };
            write!(
                f,
                "{lead} {:.1} × cheaper than {}",
                time / cost,
                method.name()
            )?;
        }
        if let Some((first, rest)) = self.missed.split_first() {
            write!(f, "; not reached by {}", first.name())?;
            rest.iter()
                .try_for_each(|it| write!(f, ", {}", it.name()))?;
        }
        write!(f, ".")
    }
}
