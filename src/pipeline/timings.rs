//! How long the stages of a step take.

use std::fmt;
use std::time::{Duration, Instant};

/// A stage of a step of the fields, before and after Rapier's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum StepStage {
    /// Edits of the fields are followed, and it is looked up where their anchors are and who is near.
    Bookkeeping,
    /// Bodies are read, evaluated and written in one visit, where few fields pull them at their centres.
    Visits,
    /// Bodies are copied, and the points at which they are sampled moved along.
    Samples,
    /// The fields are evaluated at these points.
    Evaluation,
    /// Motions are worked out and written.
    Motion,
    /// Particles of soft bodies are evaluated and pushed.
    SoftBodies,
    /// Hooks are set, and contacts detected and answered.
    Contacts,
    /// Contacts are compared with Rapier's.
    CrossCheck,
    /// Account is kept of the energy.
    Audit,
}

impl StepStage {
    /// All stages.
    pub const ALL: [StepStage; 9] = [
        StepStage::Bookkeeping,
        StepStage::Visits,
        StepStage::Samples,
        StepStage::Evaluation,
        StepStage::Motion,
        StepStage::SoftBodies,
        StepStage::Contacts,
        StepStage::CrossCheck,
        StepStage::Audit,
    ];
}

/// How long each stage of the last step took; see [`Fields::timings`](crate::Fields::timings). Rapier's own step
/// is none of them: its `Counters` tell of that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepTimings([Option<Duration>; StepStage::ALL.len()]);

impl StepTimings {
    /// How long a stage took; `None` if the step left it out.
    pub fn of(&self, stage: StepStage) -> Option<Duration> {
        self.0[stage as usize]
    }

    /// The stages that the step had, with their times.
    pub fn stages(&self) -> impl Iterator<Item = (StepStage, Duration)> + '_ {
        let all = StepStage::ALL.into_iter();
        all.filter_map(|stage| Some((stage, self.of(stage)?)))
    }

    /// All stages together.
    pub fn total(&self) -> Duration {
        self.stages().map(|(_, time)| time).sum()
    }
}

impl fmt::Display for StepTimings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let micros = |time: Duration| time.as_secs_f64() * 1e6;
        for (stage, time) in self.stages() {
            writeln!(f, "{:12} {:9.1} µs", format!("{stage:?}"), micros(time))?;
        }
        write!(f, "{:12} {:9.1} µs", "all", micros(self.total()))
    }
}

/// Measures stages, if it is on.
#[derive(Debug, Default)]
pub(super) struct Stopwatch {
    pub on: bool,
    /// When the stage began that is under way.
    since: Option<Instant>,
    pub times: StepTimings,
}

impl Stopwatch {
    /// A step begins.
    pub(super) fn start(&mut self) {
        self.times = StepTimings::default();
        self.go_on();
    }

    /// It goes on after Rapier's.
    pub(super) fn go_on(&mut self) {
        self.since = self.on.then(Instant::now);
    }

    /// What was done since the last lap was this stage.
    pub(super) fn lap(&mut self, stage: StepStage) {
        if let Some(since) = self.since {
            let now = Instant::now();
            *self.times.0[stage as usize].get_or_insert_default() += now - since;
            self.since = Some(now);
        }
    }

    /// The same if the step has that stage.
    pub(super) fn lap_if(&mut self, is_there: bool, stage: StepStage) {
        if is_there {
            self.lap(stage);
        }
    }
}
