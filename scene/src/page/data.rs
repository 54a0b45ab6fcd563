//! What a page is told of a run.

use serde::Serialize;

/// A run as it is drawn. Lengths are whole numbers of [`unit`](Self::unit), so that they take few
/// letters; vectors are in world axes.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Replay {
    /// A few words.
    pub name: String,
    /// A sentence or two on what is to be seen; may be empty.
    pub description: String,
    /// The unit of time; empty where it is not known.
    pub time_unit: String,
    /// The length of one count, in the scene's unit of length.
    pub unit: f64,
    /// The axis that is drawn upwards: 1 is y, 2 is z.
    pub up: usize,
    /// The middle of what is shown, in counts.
    pub center: [i64; 3],
    /// Half the size of the box that is shown, in counts.
    pub half: [i64; 3],
    /// Shapes, each once.
    pub shapes: Vec<DrawnShape>,
    /// Bodies, in the order of the world.
    pub bodies: Vec<DrawnBody>,
    /// Floors and walls: flat faces with all that moves on one side, as corners in counts, counter-clockwise
    /// as seen from that side.
    pub walls: Vec<Vec<[i64; 3]>>,
    /// The simulated time of each frame.
    pub times: Vec<f64>,
    /// What changed since the frame before, which for the first is zero everywhere. For each body that moved its number and three
    /// differences of its place; four more of its attitude (x, y, z, w, in thousandths) if it
    /// [turns](DrawnBody::turns).
    pub frames: Vec<Vec<i64>>,
    /// By frame, the numbers of the bodies that fell asleep or woke since the frame before.
    pub asleep: Vec<Vec<usize>>,
    /// By frame, the contacts since the frame before: place and [kind](ContactKind), four numbers each.
    pub contacts: Vec<Vec<i64>>,
    /// Fields, if there is any force.
    pub arrows: Option<Arrows>,
}

/// Who found a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ContactKind {
    /// Both the fields and Rapier, and they agree.
    Agreed = 0,
    /// The cross-check: only the fields found it.
    OnlyFields = 1,
    /// The cross-check: only Rapier found it.
    OnlyRapier = 2,
    /// The cross-check: both found it, but differ in where, how deep or which way.
    Differs = 3,
    /// The fields; nobody asked whether Rapier agrees.
    Fields = 4,
    /// Rapier; nobody asked whether the fields agree.
    Rapier = 5,
}

/// One geometry, around the origin of its part.
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
        /// How many counts one unit of `points` is.
        scale: f64,
        /// Three coordinates of each point.
        points: Vec<i64>,
        /// Four numbers of each triangle: its points, counter-clockwise as seen from outside, and which of its
        /// edges are creases, as bits: 1 from the first point to the second, 2 and 4 the next ones.
        faces: Vec<u32>,
        /// Whether it is convex: then what faces away is hidden.
        convex: bool,
    },
    /// Thin lines.
    Lines {
        /// How many counts one unit of `points` is.
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
    /// Whether it stays where it is.
    pub fixed: bool,
    /// Whether its attitude can be seen, and is in the frames.
    pub turns: bool,
    /// What it consists of.
    pub parts: Vec<DrawnPart>,
}

/// A part of a body.
#[derive(Clone, Debug, Serialize)]
pub struct DrawnPart {
    /// The number of its shape.
    pub shape: usize,
    /// Its place in the axes of the body, in counts.
    pub at: [f64; 3],
    /// Its attitude there: x, y, z, w.
    pub turn: [f64; 4],
    /// The number of its colour: bodies, or parts of different shape, are told apart.
    pub color: usize,
    /// Whether it only senses: it is drawn as glass.
    pub sensor: bool,
}

/// The force of all fields on a resting point of unit mass and no charge.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Arrows {
    /// The force that the longest arrow stands for; larger ones are drawn as long. The length of
    /// others is as the square root of the force, but a fifth of the longest at least.
    pub longest: f64,
    /// Moments at which it was sampled, in the order of time; one where nothing changes.
    pub moments: Vec<Moment>,
}

/// Arrows at one moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Moment {
    /// The number of the frame.
    pub frame: usize,
    /// Six numbers of each arrow: where it begins, and from there to its end.
    pub arrows: Vec<i64>,
}
