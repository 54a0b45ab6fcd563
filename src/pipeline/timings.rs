//! The time that the stages of a step take.

use std::fmt;
use std::time::{Duration, Instant};

/// A stage of a step of the fields, before and after Rapier's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum StepStage {
    /// Edits of the fields are applied, anchors are looked up, and bodies within reach of fields are searched.
    Bookkeeping,
    /// Bodies are read, evaluated and written in one visit, where few fields act on them at their centres.
    Visits,
    /// Bodies are copied, and their sample points moved along.
    Samples,
    /// The fields are evaluated at these points.
    Evaluation,
    /// Motions are computed and written.
    Motion,
    /// Particles of soft bodies are evaluated and pushed.
    SoftBodies,
    /// Hooks are set, and contacts detected and answered.
    Contacts,
    /// Contacts are compared with Rapier's.
    CrossCheck,
    /// The energy is audited.
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

/// The time of each stage of the last step; see [`Fields::timings`](crate::Fields::timings). Rapier's own step is not
/// included: its `Counters` measure that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepTimings([Option<Duration>; StepStage::ALL.len()]);

impl StepTimings {
    /// The time of a stage; `None` if the step left it out.
    pub fn of(&self, stage: StepStage) -> Option<Duration> {
        self.0[stage as usize]
    }

    /// The stages of the step, with their times.
    pub fn stages(&self) -> impl Iterator<Item = (StepStage, Duration)> + '_ {
        let all = StepStage::ALL.into_iter();
        all.filter_map(|stage| Some((stage, self.of(stage)?)))
    }

    /// The sum of all stages.
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

/// Opens a span of `tracing` up to the end of the block, with that feature.
macro_rules! span {
    ($name:literal) => {
        #[cfg(feature = "tracing")]
        let _span = tracing::trace_span!(target: "rapier3d_fields", $name).entered();
    };
}
pub(super) use span;

/// Measures the time of stages, if it is on.
#[derive(Debug, Default)]
pub(super) struct Stopwatch {
    pub on: bool,
    /// The start of the present stage.
    since: Option<Instant>,
    pub times: StepTimings,
}

impl Stopwatch {
    /// Starts to measure a step.
    pub(super) fn start(&mut self) {
        self.times = StepTimings::default();
        self.go_on();
    }

    /// Continues after Rapier's step.
    pub(super) fn go_on(&mut self) {
        self.since = self.on.then(Instant::now);
    }

    /// Adds the time since the last lap to a stage.
    pub(super) fn lap(&mut self, stage: StepStage) {
        if let Some(since) = self.since {
            let now = Instant::now();
            *self.times.0[stage as usize].get_or_insert_default() += now - since;
            self.since = Some(now);
        }
    }

    /// The same, if the step has that stage.
    pub(super) fn lap_if(&mut self, is_there: bool, stage: StepStage) {
        if is_there {
            self.lap(stage);
        }
    }
}
