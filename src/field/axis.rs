//! The coordinates of a sample that regions and formulas may read.

use std::fmt;
use std::sync::Arc;

/// One coordinate of the space a dynamic field is defined on (paper §2.1: fields map Rⁿ to R³).
///
/// A region may constrain any axis and a formula may read any; a field is constant along the axes it does not name.
/// `X`, `Y`, `Z`, and axes of speed and approach, are measured in the field's own frame: for a field on a body they
/// are relative to that body. A *part* is the share of a body that belongs to one collider.
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
    /// Component of the sample's velocity relative to the field's frame, along its x axis.
    VelocityX,
    /// The same along y.
    VelocityY,
    /// The same along z.
    VelocityZ,
    /// Distance of the sample point from the field's origin.
    Distance,
    /// Speed at which the sample approaches the field's origin; negative while it moves away.
    ClosingSpeed,
    /// Time until the sample is nearest to the field's origin, if both keep their velocities. Negative after
    /// that moment, infinite for a sample that does not move relative to the origin.
    TimeToClosest,
    /// Distance of the sample from the field's origin at the moment of [`TimeToClosest`](Axis::TimeToClosest).
    ClosestDistance,
    /// Radius of the part that is sampled.
    Radius,
    /// Mass of the part that is sampled, whatever the number of samples. The masses of all parts of a body add up to
    /// the mass of the body.
    Mass,
    /// Electric charge of the part that is sampled.
    Charge,
    /// A number of the user's own, declared with
    /// [`FieldsBuilder::axis`](crate::FieldsBuilder::axis) and set per world or per collider.
    User(Arc<str>),
}

impl Axis {
    /// The axis of that name: a built-in one (`"x"`, `"time"`, `"speed"`, …) or a user's own.
    pub fn named(name: &str) -> Self {
        let mut built_in = [Axis::X, Axis::Y, Axis::Z].into_iter().chain(Axis::SLOTS);
        let found = built_in.find(|axis| axis.name() == name);
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
            Axis::VelocityX => "vx",
            Axis::VelocityY => "vy",
            Axis::VelocityZ => "vz",
            Axis::Distance => "distance",
            Axis::ClosingSpeed => "closing_speed",
            Axis::TimeToClosest => "time_to_closest",
            Axis::ClosestDistance => "closest_distance",
            Axis::Radius => "radius",
            Axis::Mass => "mass",
            Axis::Charge => "charge",
            Axis::User(name) => name,
        }
    }

    /// All built-in axes but x, y and z.
    pub(super) const SLOTS: [Axis; 12] = [
        Axis::Time,
        Axis::Speed,
        Axis::VelocityX,
        Axis::VelocityY,
        Axis::VelocityZ,
        Axis::Distance,
        Axis::ClosingSpeed,
        Axis::TimeToClosest,
        Axis::ClosestDistance,
        Axis::Radius,
        Axis::Mass,
        Axis::Charge,
    ];

    /// Returns true if it depends on the velocity of the sample.
    pub(crate) fn reads_velocity(&self) -> bool {
        use Axis::*;
        matches!(
            self,
            Speed
                | VelocityX
                | VelocityY
                | VelocityZ
                | ClosingSpeed
                | TimeToClosest
                | ClosestDistance
        )
    }

    /// Returns true if it may differ between the colliders of a body at one place.
    pub(crate) fn is_of_part(&self) -> bool {
        use Axis::*;
        matches!(self, Radius | Mass | Charge | User(_))
    }

    /// Returns true if it is measured in the field's own frame, and so differs from field to field.
    pub(crate) fn reads_frame(&self) -> bool {
        matches!(self, Axis::Distance) || self.spatial().is_some() || self.reads_velocity()
    }

    /// The number of its spatial coordinate: 0, 1 or 2 for x, y or z; `None` for other axes.
    pub(crate) fn spatial(&self) -> Option<usize> {
        match self {
            Axis::X => Some(0),
            Axis::Y => Some(1),
            Axis::Z => Some(2),
            _ => None,
        }
    }
}

/// Saved as its name.
#[cfg(feature = "serde-serialize")]
impl serde::Serialize for Axis {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// Read from its name.
#[cfg(feature = "serde-serialize")]
impl<'de> serde::Deserialize<'de> for Axis {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Ok(Axis::named(&name))
    }
}

/// A string.
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
