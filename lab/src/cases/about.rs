//! What a case is.

use crate::study::{Metric, Scene};

/// What a case is, and how it is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// The name in tables and files.
    pub name: String,
    /// A sentence on what moves, and on what the reference is.
    pub description: &'static str,
    /// The unit of simulated time.
    pub time_unit: &'static str,
    /// Simulated time.
    pub duration: f64,
    /// The longest time step to study it at.
    pub longest: f64,
    /// How many steps to study it at, each half of the one before.
    pub halvings: usize,
    /// What to compare by, and at which error.
    pub views: Vec<(Metric, f64)>,
}

impl About {
    /// The time steps to study it at.
    pub fn time_steps(&self) -> Vec<f64> {
        let next = |dt: &f64| Some(0.5 * dt);
        std::iter::successors(Some(self.longest), next)
            .take(self.halvings)
            .collect()
    }

    /// What a report says of it.
    pub fn scene(self) -> Scene {
        Scene {
            name: self.name,
            description: self.description.to_owned(),
            time_unit: self.time_unit.to_owned(),
            views: self.views,
        }
    }
}
