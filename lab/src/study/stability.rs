//! Cells of the stability map.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// One run of the stability map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StabilityCell {
    /// Bits of the numbers.
    pub precision: u32,
    /// The kind of scene.
    pub kind: String,
    /// The damping.
    pub damping: String,
    /// The scheme that moves it.
    pub scheme: String,
    /// The time step times the fastest rate of the scene.
    pub turn: f64,
    /// A character of the [legend](Self::LEGEND).
    pub class: char,
    /// The largest energy, relative to the initial one.
    #[serde(serialize_with = "finite", deserialize_with = "or_infinite")]
    pub most: f64,
}

/// Replaces infinity by null, as JSON has no infinity.
fn finite<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    value.is_finite().then_some(*value).serialize(to)
}

fn or_infinite<'a, D: Deserializer<'a>>(from: D) -> Result<f64, D::Error> {
    let value: Option<f64> = Deserialize::deserialize(from)?;
    Ok(value.unwrap_or(f64::INFINITY))
}

impl StabilityCell {
    /// The meaning of the classes.
    pub const LEGEND: [(char, &str); 7] = [
        ('.', "stable"),
        ('~', "drifting: gains more than a tenth, and less than all"),
        ('d', "loses more than a tenth, undamped"),
        ('w', "warned of, and keeps its energy"),
        ('X', "warned of before it exploded"),
        ('R', "refused"),
        ('!', "exploded with no warning before"),
    ];
}

/// The largest dt·ω up to which all of `cells` are stable; `None` if there is none.
pub fn safe_turn<'a>(cells: impl Iterator<Item = &'a StabilityCell>) -> Option<f64> {
    let (mut stable, mut first_bad) = (Vec::new(), f64::INFINITY);
    for cell in cells {
        match cell.class {
            '.' => stable.push(cell.turn),
            _ => first_bad = first_bad.min(cell.turn),
        }
    }
    let below = stable.into_iter().filter(|turn| *turn < first_bad);
    below.reduce(f64::max)
}
