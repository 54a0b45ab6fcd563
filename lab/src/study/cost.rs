//! What runs cost besides their errors: what a scene leaves out, and how many bodies keep pace.

use serde::{Deserialize, Serialize};

/// What one more thing would cost a scene that does not need it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ablation {
    /// Bits of the numbers.
    pub precision: u32,
    /// Name of the case.
    pub case: String,
    /// What was switched on.
    pub switch: String,
    /// Pairs of runs on the clock, with and without.
    pub rounds: usize,
    /// Seconds of a step without, median.
    pub step: f64,
    /// Time with over time without, of each pair: a quarter are less, half, three quarters.
    pub ratios: [f64; 3],
    /// The farthest that a body ends from where it ends without, as a share of the farthest way.
    pub change: f64,
}

/// How many bodies a scene may have for a step to take no longer than a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ceiling {
    /// Bits of the numbers.
    pub precision: u32,
    /// What is simulated, and by whom.
    pub scene: String,
    /// The largest number that kept pace.
    pub count: usize,
    /// Its median step, seconds.
    pub step: f64,
    /// The smallest number that did not, and its median step, if there is one.
    pub beyond: Option<Paced>,
    /// Seconds of a frame.
    pub frame: f64,
    /// Seconds on the clock that steps of a probe may take.
    pub limit: f64,
}

/// A number of bodies, and the median of their step in seconds.
pub type Paced = (usize, f64);

impl Ceiling {
    /// The largest count whose step, as `probe` measures it, takes no longer than a frame: by doubling
    /// from `least`, then by bisection until the two ends are within a tenth; nothing if not even the
    /// least does. No more than `most` bodies are tried.
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
