//! The differences that a cross-check found between the fields and Rapier.

use std::fmt;

use crate::math::{ColliderHandle, Real, Vector};

/// One difference between the sides that rounding does not explain.
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Disagreement {
    /// The number of the step, from 1.
    pub step: u64,
    /// The point of the fields' contact, or of Rapier's if the fields found none; in world space.
    pub world_point: Vector,
    /// The colliders, in the order of their handles.
    pub colliders: [ColliderHandle; 2],
    /// The difference.
    pub difference: Difference,
    /// The difference that the band allows: a length, or for normals an angle in radians.
    pub band: Real,
}

/// A difference, with the values of both sides.
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
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
    /// The depths of the deepest overlap differ.
    Depth {
        /// By the fields.
        field: Real,
        /// By Rapier, contact skins included.
        rapier: Real,
    },
    /// The normals differ: unit vectors from the first collider to the second, in world axes.
    Normal {
        /// By the fields.
        field: Vector,
        /// By Rapier; for a touch within a step, the nearest one of Parry's.
        rapier: Vector,
    },
    /// The points of contact differ, in world space.
    Point {
        /// By the fields.
        field: Vector,
        /// By Rapier: the nearest point that is about as deep. For a touch within a step, the nearest point of a
        /// surface.
        rapier: Vector,
    },
    /// At the time of a touch that swept detection found, the parts do not touch.
    Gap {
        /// The time since the step began.
        time: f64,
        /// Their distance at that time, by Parry; negative if they overlap.
        gap: Real,
    },
    /// The parts overlapped before the time of a touch that swept detection found.
    Late {
        /// The time since the step began.
        time: f64,
        /// An earlier time at which they overlap, by Parry.
        earlier: f64,
        /// The depth of that overlap.
        depth: Real,
    },
    /// The path of a body within a step does not lead to where the body was.
    Way {
        /// The time since the step began.
        time: f64,
        /// The distance between the path and the body at that time.
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
