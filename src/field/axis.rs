//! Coordinates of a sample beyond x, y and z.

use std::fmt;
use std::sync::Arc;

/// One coordinate of the space a dynamic field is defined on (paper §2.1: fields map Rⁿ to R³).
///
/// A region may constrain any axis and a formula may read any; an operand is constant along the
/// axes it does not name. `X`, `Y`, `Z` and `Speed` are measured in the field's own frame.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Axis {
    /// First coordinate of the sample point, in the field's frame.
    X,
    /// Second coordinate of the sample point, in the field's frame.
    Y,
    /// Third coordinate of the sample point, in the field's frame.
    Z,
    /// Simulated time since the fields were built.
    Time,
    /// Speed of the sample relative to the field's frame at the sample point.
    Speed,
    /// Radius of the sample.
    Radius,
    /// Mass the sample stands for; over the samples of a body it sums to the body's mass.
    Mass,
    /// Electric charge of the sample.
    Charge,
    /// A number of the user's own, declared with
    /// [`FieldsBuilder::axis`](crate::FieldsBuilder::axis) and set per world or per collider.
    User(Arc<str>),
}

impl Axis {
    /// The axis of that name: a built-in one (`"x"`, `"time"`, `"speed"`, …) or a user's own.
    pub fn named(name: &str) -> Self {
        const BUILT_IN: [Axis; 8] = [
            Axis::X,
            Axis::Y,
            Axis::Z,
            Axis::Time,
            Axis::Speed,
            Axis::Radius,
            Axis::Mass,
            Axis::Charge,
        ];
        let found = BUILT_IN.into_iter().find(|axis| axis.name() == name);
        found.unwrap_or_else(|| Axis::User(name.into()))
    }

    /// The name of the axis, in lower case for the built-in ones.
    pub fn name(&self) -> &str {
        match self {
            Axis::X => "x",
            Axis::Y => "y",
            Axis::Z => "z",
            Axis::Time => "time",
            Axis::Speed => "speed",
            Axis::Radius => "radius",
            Axis::Mass => "mass",
            Axis::Charge => "charge",
            Axis::User(name) => name,
        }
    }

    /// Which spatial coordinate this is, if it is one.
    pub(crate) fn spatial(&self) -> Option<usize> {
        match self {
            Axis::X => Some(0),
            Axis::Y => Some(1),
            Axis::Z => Some(2),
            _ => None,
        }
    }
}

/// By its name.
#[cfg(feature = "serde-serialize")]
impl serde::Serialize for Axis {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// By its name.
#[cfg(feature = "serde-serialize")]
impl<'de> serde::Deserialize<'de> for Axis {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Ok(Axis::named(&name))
    }
}

/// By its name.
#[cfg(feature = "schemars")]
impl schemars::JsonSchema for Axis {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Axis".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string" })
    }
}

impl From<&str> for Axis {
    fn from(name: &str) -> Self {
        Axis::named(name)
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
