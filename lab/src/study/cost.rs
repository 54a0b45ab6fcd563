//! Costs of features that scenes do not use, and numbers of bodies that run in real time.

use serde::{Deserialize, Serialize};

/// The cost of a feature in a scene that does not need it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ablation {
    /// Bits of the numbers.
    pub precision: u32,
    /// Name of the case.
    pub case: String,
    /// The feature that was switched on.
    pub switch: String,
    /// Number of pairs of timed runs, with the feature and without.
    pub rounds: usize,
    /// Median time of a step without the feature, s.
    pub step: f64,
    /// Lower quartile, median and upper quartile of time with over time without, per pair.
    pub ratios: [f64; 3],
    /// Largest distance between ends of a body with and without, relative to the largest displacement.
    pub change: f64,
}

/// The number of bodies with which a step of a scene still takes at most a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ceiling {
    /// Bits of the numbers.
    pub precision: u32,
    /// The scene, and whether fields or Rapier alone simulate it.
    pub scene: String,
    /// The largest number of bodies with which a step took at most a frame.
    pub count: usize,
    /// Its median time of a step, s.
    pub step: f64,
    /// The smallest number with which a step took longer, and its median time, if there is one.
    pub beyond: Option<Paced>,
    /// Time of a frame, s.
    pub frame: f64,
    /// Wall-clock time after which a probe ends, s.
    pub limit: f64,
}

/// A number of bodies, and the median time of their step, s.
pub type Paced = (usize, f64);

impl Ceiling {
    /// The largest count with which a step, by `probe`, takes at most a frame: by doubling from `least`, then by
    /// bisection until the two ends are within a tenth. `None` if even `least` takes longer. Counts above `most` are
    /// not tried.
    pub fn find(
        (least, most): (usize, usize),
        frame: f64,
        mut probe: impl FnMut(usize) -> Option<f64>,
    ) -> Option<(Paced, Option<Paced>)> {
        let mut pace = |count: usize| probe(count).filter(|it| it.is_finite());
        let mut good: Paced = (least, pace(least).filter(|it| *it <= frame)?);
        let mut bad: Option<Paced> = None;
        loop {
            let next = match bad {
                Some((count, _)) if count * 10 <= good.0 * 11 || count <= good.0 + 1 => break,
                Some((count, _)) => good.0 + (count - good.0) / 2,
                None if good.0 >= most => break,
                None => (2 * good.0).min(most),
            };
            match pace(next) {
                Some(step) if step <= frame => good = (next, step),
                step => bad = Some((next, step.unwrap_or(f64::MAX))),
            }
        }
        Some((good, bad))
    }
}
