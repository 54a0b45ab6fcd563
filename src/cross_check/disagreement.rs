//! Contacts that one side found and the other did not, or found otherwise.

use std::fmt;

use crate::math::{ColliderHandle, Real, Vector};

/// One difference between the sides that rounding does not explain.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Disagreement {
    /// The number of the step, from 1.
    pub step: u64,
    /// Where the fields found the contact, or Rapier if they did not.
    pub world_point: Vector,
    /// The colliders, in the order of their handles.
    pub colliders: [ColliderHandle; 2],
    /// The difference.
    pub difference: Difference,
    /// How much it may differ there: a length, for normals an angle in radians.
    pub band: Real,
}

/// A difference, with the values of both sides.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Difference {
    /// An overlap that only the fields found.
    OnlyField {
        /// Its depth.
        depth: Real,
    },
    /// An overlap that only Rapier found.
    OnlyRapier {
        /// Its depth.
        depth: Real,
    },
    /// The depth of the deepest overlap.
    Depth {
        /// As the fields have it.
        field: Real,
        /// As Rapier has it, less the contact skins.
        rapier: Real,
    },
    /// The normal there, a unit vector from the first collider to the second.
    Normal {
        /// As the fields have it.
        field: Vector,
        /// As Rapier has it; of a touch within a step, Parry's nearest to it.
        rapier: Vector,
    },
    /// The point of contact, in world coordinates.
    Point {
        /// As the fields have it.
        field: Vector,
        /// The nearest of Rapier's that is about as deep; of a touch within a step, that of a surface.
        rapier: Vector,
    },
    /// The parts do not touch at the time of a touch within a step.
    Gap {
        /// The time, since the step began.
        time: f64,
        /// How far they are apart then, by Parry; negative if they overlap.
        gap: Real,
    },
    /// The parts overlapped before the time of a touch within a step.
    Late {
        /// The time, since the step began.
        time: f64,
        /// An earlier one at which they overlap, by Parry.
        earlier: f64,
        /// How deep.
        depth: Real,
    },
    /// The way of a body within a step does not lead to where it was.
    Way {
        /// The time, since the step began.
        time: f64,
        /// By how much the way is off there.
        error: Real,
    },
}

impl fmt::Display for Disagreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = self.colliders.map(|collider| collider.into_raw_parts().0);
        write!(f, "step {}, colliders {a} and {b}: ", self.step)?;
        match self.difference {
            Difference::OnlyField { depth } => write!(f, "only the fields find it, {depth} deep"),
            Difference::OnlyRapier { depth } => write!(f, "only Rapier finds it, {depth} deep"),
            Difference::Depth { field, rapier } => write!(f, "depth {field}, of Rapier {rapier}"),
            Difference::Normal { field, rapier } => {
                write!(f, "normal {field}, of Rapier {rapier}")
            }
            Difference::Point { field, rapier } => write!(f, "point {field}, of Rapier {rapier}"),
            Difference::Gap { time, gap } => {
                write!(f, "touch at {time}, when the gap is {gap}")
            }
            Difference::Late {
                time,
                earlier,
                depth,
            } => write!(f, "touch at {time}, but {depth} deep at {earlier}"),
            Difference::Way { time, error } => {
                write!(f, "way within the step, at {time} off by {error}")
            }
        }?;
        write!(f, " (band {:.1e})", self.band)
    }
}
