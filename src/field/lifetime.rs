//! When a field acts.

use super::BuildError;
use super::error::bad;

/// When a field acts, in simulated time and in steps. Outside of it the field is not defined
/// anywhere.
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
