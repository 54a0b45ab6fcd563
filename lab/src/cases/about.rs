//! The description of a case.

use crate::study::{Metric, Scene};

/// The description of a case: what it simulates, and how it is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// The name in tables and files.
    pub name: String,
    /// One sentence on the motion and the reference it is compared with.
    pub description: &'static str,
    /// The unit of simulated time.
    pub time_unit: &'static str,
    /// Simulated time, in `time_unit`.
    pub duration: f64,
    /// The longest time step of a study.
    pub longest: f64,
    /// Number of time steps of a study, each half of the one before.
    pub halvings: usize,
    /// Metrics by which methods are compared, each with the error at which their costs are compared.
    pub views: Vec<(Metric, f64)>,
}

impl About {
    /// The time steps of a study, longest first.
    pub fn time_steps(&self) -> Vec<f64> {
        let next = |dt: &f64| Some(0.5 * dt);
        std::iter::successors(Some(self.longest), next)
            .take(self.halvings)
            .collect()
    }

    /// The entry of this case in a report.
    pub fn scene(self) -> Scene {
        Scene {
            name: self.name,
            description: self.description.to_owned(),
            time_unit: self.time_unit.to_owned(),
            views: self.views,
        }
    }
}
