//! The laws that detection fields apply to touching parts (§3.3).

use super::error::{BuildError, require};
use super::query::Touch;
use crate::math::{DVec3, Real, to_f64};

/// The law that a detection field applies to two touching, approaching parts.
///
/// If both parts have a field and the laws differ, the one farther down this list applies; of two
/// of the same kind, the larger of each parameter.
///
/// | law | momentum, angular momentum | energy |
/// |---|---|---|
/// | [`Observe`](ContactLaw::Observe) | kept | kept |
/// | [`Paper`](ContactLaw::Paper) | in symmetric cases only | in symmetric cases only |
/// | [`PaperRelative`](ContactLaw::PaperRelative) | for equal masses | for equal masses without spin |
/// | [`Penalty`](ContactLaw::Penalty) | kept | kept to first order in the step; damping reduces it |
/// | [`Impulse`](ContactLaw::Impulse) | kept | kept for a restitution of one without friction, never gained |
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[must_use = "a law does nothing until a field has it"]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum ContactLaw {
    /// Only reports the contact.
    Observe,
    /// The paper's rule, literally: the field around one part gives the other a velocity change along the line
    /// of centres, away from the field, as large as the *other's own* speed at the point of contact. A part
    /// without a field pushes no other part. The rule conserves momentum and energy in symmetric cases only.
    Paper,
    /// The paper's rule, read with the velocity *relative* to the field and along its normal: the
    /// other gets a velocity change along the line of centres as large as the speed at which the
    /// two approach. Two equal masses then exchange their normal velocities, which is the exact
    /// elastic collision; unequal ones do not conserve momentum.
    PaperRelative,
    /// A spring that pushes overlapping parts apart, with a force along the normal of
    /// stiffness · depth + damping · approach speed, never pulling.
    ///
    /// The force at the end of a step acts as an impulse over the step's length: symplectic Euler, stable while
    /// `dt` √(stiffness / effective mass) < 2, and [reported](crate::StepWarning::Stiff) from 0.5 on. Damping
    /// is implicit, for all contacts of connected bodies together: at any strength it stops bodies and does not
    /// reverse them. A swept contact is reported when it begins, and pushes from the end of that step on.
    Penalty {
        /// Force per length of overlap; not negative.
        stiffness: Real,
        /// Force per speed of approach; not negative.
        damping: Real,
    },
    /// Newton's law along the normal, with both bodies' effective masses including rotation:
    /// equal and opposite impulses at one point, so that momentum and angular momentum are
    /// exact, and for a restitution of one without friction the energy too. Contacts that happen
    /// at once are resolved together (Moreau's law of impact; at most 48 connected ones), in rounds
    /// until none approaches, at most 64.
    ///
    /// Friction is Coulomb's: after the normal impulse, an impulse against the slip at the point that
    /// stops it, but at most friction times the normal impulse. It never adds energy.
    Impulse {
        /// Ratio of the normal speeds after and before, from 0 to 1.
        restitution: Real,
        /// Coefficient of friction; not negative.
        friction: Real,
    },
}

impl ContactLaw {
    /// Newton's law without loss: [`ContactLaw::Impulse`] of restitution one, frictionless.
    pub const fn elastic() -> Self {
        Self::restitution(1.0)
    }

    /// [`ContactLaw::Impulse`] of a restitution from 0 to 1, frictionless.
    pub const fn restitution(restitution: Real) -> Self {
        Self::Impulse {
            restitution,
            friction: 0.0,
        }
    }

    /// The same law with Coulomb friction. Laws other than [`ContactLaw::Impulse`] have no friction, and stay
    /// as they are.
    pub const fn with_friction(self, coefficient: Real) -> Self {
        match self {
            Self::Impulse { restitution, .. } => Self::Impulse {
                restitution,
                friction: coefficient,
            },
            other => other,
        }
    }

    /// Returns true if a part may rebound as fast as it approached.
    pub(crate) fn keeps_speed(self) -> bool {
        match self {
            Self::Impulse { restitution, .. } => restitution >= 1.0,
            other => other.is_vector(),
        }
    }

    /// Returns true if the law gives each part a vector of its own, in place of equal and opposite impulses.
    pub(crate) fn is_vector(self) -> bool {
        matches!(self, Self::Paper | Self::PaperRelative)
    }

    /// The vector of a contact field at a part that touches: its change of velocity, in world axes. Zero for
    /// laws that act on both parts at once.
    pub(crate) fn push(self, touch: &Touch) -> DVec3 {
        match self {
            Self::Paper => touch.world_normal * touch.speed,
            Self::PaperRelative => touch.world_normal * touch.approach_speed,
            Self::Observe | Self::Penalty { .. } | Self::Impulse { .. } => DVec3::ZERO,
        }
    }

    /// The law that applies if both parts of a pair have a field.
    pub(crate) fn stronger(self, other: Self) -> Self {
        match (self, other) {
            (
                Self::Impulse {
                    restitution: e,
                    friction: f,
                },
                Self::Impulse {
                    restitution,
                    friction,
                },
            ) => Self::Impulse {
                restitution: e.max(restitution),
                friction: f.max(friction),
            },
            (
                Self::Penalty {
                    stiffness: k,
                    damping: c,
                },
                Self::Penalty { stiffness, damping },
            ) => Self::Penalty {
                stiffness: k.max(stiffness),
                damping: c.max(damping),
            },
            (one, two) if one.rank() >= two.rank() => one,
            (_, two) => two,
        }
    }

    fn rank(self) -> u8 {
        match self {
            Self::Observe => 0,
            Self::Paper => 1,
            Self::PaperRelative => 2,
            Self::Penalty { .. } => 3,
            Self::Impulse { .. } => 4,
        }
    }

    pub(crate) fn validate(&self, field: &str) -> Result<(), BuildError> {
        let not_negative = |quantity: &'static str, value: Real| {
            let fits = value >= 0.0 && value.is_finite();
            let not_negative = "finite and not negative";
            require(fits, field, quantity, not_negative, to_f64(value))
        };
        match *self {
            Self::Observe | Self::Paper | Self::PaperRelative => Ok(()),
            Self::Penalty { stiffness, damping } => {
                not_negative("the stiffness", stiffness)?;
                not_negative("the damping", damping)
            }
            Self::Impulse {
                restitution,
                friction,
            } => {
                let fits = (0.0..=1.0).contains(&restitution);
                let (quantity, value) = ("the restitution", to_f64(restitution));
                require(fits, field, quantity, "from 0 to 1", value)?;
                not_negative("the friction", friction)
            }
        }
    }
}
