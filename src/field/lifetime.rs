//! The time at which a field acts.

use super::BuildError;
use super::error::require;
use crate::math::{Real, to_f64};

/// The time in which a field acts, in simulated time and in steps. At other times the field is defined nowhere.
///
/// In a step in which a field begins or ends, its vector is multiplied by the share of the step in which it
/// acts: the impulse of a constant force is the force times the overlap with the step, however short, and under
/// every [`Scheme`](crate::Scheme). At a single moment, as in queries and contacts, the field acts fully or not at all.
///
/// At the end of the step in which its time or its steps are over, a field is removed from its
/// [set](crate::FieldSet). To go back in time, restore the set together with the state.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// // An explosion: one step, then the field leaves its set.
/// let blast = Field::radial(30.0, -1.0)
///     .within(Region::ball(5.0))
///     .force_mode(ForceMode::VelocityChange)
///     .lifetime(Lifetime::steps(1));
/// let gust = Field::uniform(Vector::X).lifetime(Lifetime::between(2.0, 3.5));
/// # let _ = (blast, gust);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Lifetime {
    /// The first moment at which it acts; −∞ by default.
    #[cfg_attr(
        feature = "serde-serialize",
        serde(with = "super::saved::never_before")
    )]
    pub from: f64,
    /// The moment at which it stops acting; ∞ by default.
    #[cfg_attr(feature = "serde-serialize", serde(with = "super::saved::never_after"))]
    pub until: f64,
    /// The number of steps in which it still acts. `None` by default: no limit.
    pub steps: Option<u32>,
}

impl Lifetime {
    /// Always.
    pub const ALWAYS: Lifetime = Lifetime {
        from: f64::NEG_INFINITY,
        until: f64::INFINITY,
        steps: None,
    };

    /// From one moment of simulated time, inclusive, to another, exclusive.
    pub fn between(from: f64, until: f64) -> Self {
        Lifetime {
            from,
            until,
            ..Lifetime::ALWAYS
        }
    }

    /// For this number of steps.
    pub fn steps(steps: u32) -> Self {
        Lifetime {
            steps: Some(steps),
            ..Lifetime::ALWAYS
        }
    }

    /// Returns true if a field acts at a moment of simulated time (s).
    pub fn holds_at(&self, time: f64) -> bool {
        self.from <= time && time < self.until && self.steps != Some(0)
    }

    /// The share of a span in which a field acts.
    pub(crate) fn share_of(&self, span: Span) -> f64 {
        let Span { start, end } = span;
        if end <= start || self.steps == Some(0) || self.is_timeless() {
            return f64::from(u8::from(self.holds_at(start)));
        }
        let overlap = self.until.min(end) - self.from.max(start);
        (overlap / (end - start)).max(0.0)
    }

    /// Returns true if it is over at a moment, and stays so.
    pub(crate) fn is_over_at(&self, time: f64) -> bool {
        self.until <= time || self.steps == Some(0)
    }

    /// Returns true if it begins or ends in a span.
    pub(crate) fn changes_in(&self, span: Span) -> bool {
        let within = |time: f64| span.start <= time && time <= span.end;
        within(self.from) || within(self.until)
    }

    /// Returns true if it does not depend on simulated time; it may have a limit of steps.
    pub(crate) fn is_timeless(&self) -> bool {
        self.from == f64::NEG_INFINITY && self.until == f64::INFINITY
    }

    pub(super) fn validate(&self, field: &str) -> Result<(), BuildError> {
        let (quantity, below) = ("the start of the lifetime", "less than its end");
        require(self.from < self.until, field, quantity, below, self.from)
    }
}

/// The time for which a lifetime is evaluated: a step, or a moment, which ends where it starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Span {
    pub start: f64,
    pub end: f64,
}

impl Span {
    /// A moment.
    pub(crate) fn at(time: f64) -> Self {
        Span {
            start: time,
            end: time,
        }
    }

    /// A step that begins at a time.
    pub(crate) fn step(start: f64, dt: Real) -> Self {
        let end = start + to_f64(dt);
        Span { start, end }
    }
}

impl Default for Lifetime {
    fn default() -> Self {
        Lifetime::ALWAYS
    }
}
