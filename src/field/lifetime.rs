//! When a field acts.

use super::BuildError;
use super::error::bad;
use crate::math::{Real, to_f64};

/// When a field acts, in simulated time and in steps. Outside of it the field is not defined
/// anywhere.
///
/// A step in which a field begins or ends has it all along, with its vector times the share of the
/// step in which it acts: the impulse of a constant force is the force times the overlap with the
/// step, however short, and under every [`Scheme`](crate::Scheme). What is asked about a moment has it
/// whole or not at all, and so have contacts, which are answered at a moment.
///
/// At the end of the step in which its time or its steps are over, a field leaves its
/// [set](crate::FieldSet), and its handle finds it no more: who goes back in time puts back the set
/// with the state.
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
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Lifetime {
    /// The first moment at which it acts; −∞ by default.
    #[cfg_attr(feature = "serde-serialize", serde(with = "never_before"))]
    pub from: f64,
    /// The moment from which on it does not act any more; ∞ by default.
    #[cfg_attr(feature = "serde-serialize", serde(with = "never_after"))]
    pub until: f64,
    /// In how many steps it still acts; then it leaves its set. `None` by default: in all.
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

    /// So many steps.
    pub fn steps(steps: u32) -> Self {
        Lifetime {
            steps: Some(steps),
            ..Lifetime::ALWAYS
        }
    }

    /// Whether a field acts at a moment of simulated time.
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

    /// Whether it is over for good from a moment on.
    pub(crate) fn is_over_at(&self, time: f64) -> bool {
        self.until <= time || self.steps == Some(0)
    }

    /// Whether it begins or ends in a span.
    pub(crate) fn changes_in(&self, span: Span) -> bool {
        let within = |time: f64| span.start <= time && time <= span.end;
        within(self.from) || within(self.until)
    }

    /// Whether time makes no difference.
    pub(crate) fn is_timeless(&self) -> bool {
        self.from == f64::NEG_INFINITY && self.until == f64::INFINITY
    }

    pub(super) fn validate(&self, field: &str) -> Result<(), BuildError> {
        if self.from < self.until {
            return Ok(());
        }
        let below = "less than its end";
        Err(bad(field, "the start of the lifetime", below, self.from))
    }
}

/// What a lifetime is asked about: a step, or a moment, which ends where it starts.
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

/// Infinities as `None`: JSON knows none.
#[cfg(feature = "serde-serialize")]
macro_rules! bound {
    ($name:ident, $none:expr) => {
        mod $name {
            use serde::{Deserialize, Deserializer, Serialize, Serializer};

            pub fn serialize<S: Serializer>(bound: &f64, serializer: S) -> Result<S::Ok, S::Error> {
                (*bound != $none).then_some(*bound).serialize(serializer)
            }

            pub fn deserialize<'de, D: Deserializer<'de>>(
                deserializer: D,
            ) -> Result<f64, D::Error> {
                let bound: Option<f64> = Option::deserialize(deserializer)?;
                Ok(bound.unwrap_or($none))
            }
        }
    };
}

#[cfg(feature = "serde-serialize")]
bound!(never_before, f64::NEG_INFINITY);
#[cfg(feature = "serde-serialize")]
bound!(never_after, f64::INFINITY);
