//! How a detection field answers a touch (§3.3).

use super::error::{TreeError, bad};
use crate::math::{Real, to_f64};

/// The law by which a detection field answers two touching, approaching parts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
pub enum ContactLaw {
    /// Only reports the contact.
    Observe,
    /// The paper's rule, literally: the field around one part gives the other a velocity change
    /// along the line of centres, away from the field, as large as the *other's own* speed at
    /// the point of contact. A part without a field pushes nobody. The rule conserves momentum
    /// and energy in symmetric cases only.
    Paper,
    /// Newton's law along the normal, with both bodies' effective masses including rotation:
    /// equal and opposite impulses at one point, so that momentum and angular momentum are
    /// exact, and for a restitution of one the energy too. Frictionless.
    Impulse {
        /// Ratio of the normal speeds after and before, from 0 to 1. Of the two fields of a
        /// touching pair the larger one counts.
        restitution: Real,
    },
}

impl ContactLaw {
    pub(crate) fn validate(&self, field: &str) -> Result<(), TreeError> {
        match *self {
            ContactLaw::Impulse { restitution } if !(0.0..=1.0).contains(&restitution) => {
                let value = to_f64(restitution);
                Err(bad(field, "the restitution", "from 0 to 1", value))
            }
            _ => Ok(()),
        }
    }
}
