//! The data of a run from which a page draws it.

use serde::Serialize;

/// A run as it is drawn. Lengths are in counts, whole multiples of [`unit`](Self::unit), which keeps
/// pages small; vectors are in world axes.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Replay {
    /// A short name.
    pub name: String,
    /// A sentence or two about the scene; may be empty.
    pub description: String,
    /// The unit of time; empty where it is not known.
    pub time_unit: String,
    /// The length of one count, in the scene's unit of length.
    pub unit: f64,
    /// The axis that is drawn upwards: 1 is y, 2 is z.
    pub up: usize,
    /// The centre of the box that is shown, in counts.
    pub center: [i64; 3],
    /// Half the size of the box that is shown, in counts.
    pub half: [i64; 3],
    /// The distinct shapes.
    pub shapes: Vec<DrawnShape>,
    /// Bodies, in the order of the world.
    pub bodies: Vec<DrawnBody>,
    /// Floors and walls: flat faces with all moving bodies on one side, as corners in counts,
    /// counter-clockwise as seen from that side.
    pub walls: Vec<Vec<[i64; 3]>>,
    /// The simulated time of each frame.
    pub times: Vec<f64>,
    /// By frame, the changes since the frame before (since zero for the first). For each body that moved: its
    /// number and three differences of its position, then four of its attitude (x, y, z, w, in thousandths) if
    /// it [turns](DrawnBody::turns).
    pub frames: Vec<Vec<i64>>,
    /// By frame, the numbers of the bodies that fell asleep or woke since the frame before.
    pub asleep: Vec<Vec<usize>>,
    /// By frame, the contacts since the frame before: position and [kind](ContactKind), four numbers each.
    pub contacts: Vec<Vec<i64>>,
    /// The fields as arrows; `None` if there is no force.
    pub arrows: Option<Arrows>,
}

/// The side that found a contact: the fields, Rapier, or both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ContactKind {
    /// Both the fields and Rapier, and they agree.
    Agreed = 0,
    /// The cross-check: only the fields found it.
    OnlyFields = 1,
    /// The cross-check: only Rapier found it.
    OnlyRapier = 2,
    /// The cross-check: both found it, but differ in point, depth or normal.
    Differs = 3,
    /// The fields, without a cross-check with Rapier.
    Fields = 4,
    /// Rapier, without a cross-check with the fields.
    Rapier = 5,
}

/// A shape, in the frame of its part.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum DrawnShape {
    /// A ball.
    Ball {
        /// Its radius, in counts.
        radius: f64,
    },
    /// Triangles.
    Mesh {
        /// Counts per unit of `points`.
        scale: f64,
        /// Three coordinates of each point.
        points: Vec<i64>,
        /// Four numbers of each triangle: its points, counter-clockwise as seen from outside, and the bits of the
        /// edges that are creases: 1 from the first point to the second, 2 and 4 the next ones.
        faces: Vec<u32>,
        /// Whether it is convex: then faces that point away from the viewer are hidden.
        convex: bool,
    },
    /// Thin lines.
    Lines {
        /// Counts per unit of `points`.
        scale: f64,
        /// Three coordinates of each point.
        points: Vec<i64>,
        /// The two points of each line.
        lines: Vec<u32>,
    },
}

/// A body.
#[derive(Clone, Debug, Default, Serialize)]
pub struct DrawnBody {
    /// Its name, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Whether it never moves.
    pub fixed: bool,
    /// Whether its attitude can be seen and is therefore in the frames.
    pub turns: bool,
    /// Its parts.
    pub parts: Vec<DrawnPart>,
}

/// A part of a body.
#[derive(Clone, Debug, Serialize)]
pub struct DrawnPart {
    /// The index of its shape in [`Replay::shapes`].
    pub shape: usize,
    /// Its position in the frame of the body, in counts.
    pub at: [f64; 3],
    /// Its attitude in the frame of the body: x, y, z, w.
    pub turn: [f64; 4],
    /// The number of its colour: by body, or by shape for a body of several parts.
    pub color: usize,
    /// Whether it is a sensor, which is drawn translucent.
    pub sensor: bool,
}

/// The force of all fields on a point of unit mass at rest, without charge.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Arrows {
    /// The force that the longest arrow stands for; larger forces are drawn with the same length. Other
    /// lengths are proportional to the square root of the force, but at least a fifth of the longest.
    pub longest: f64,
    /// The moments of sampling, in order of time; only one if nothing changes.
    pub moments: Vec<Moment>,
}

/// Arrows at one moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Moment {
    /// The number of the frame.
    pub frame: usize,
    /// Six numbers of each arrow, in counts: its start, and the vector from there to its end.
    pub arrows: Vec<i64>,
}
