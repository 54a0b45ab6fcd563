//! Numbers, vectors and poses as they stand in files.

use std::fmt;

use serde::de::{Unexpected, Visitor};
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::error::{FileError, content};
use super::fields::math::{Pose, Real, Rotation, Vector, from_f64};

/// A finite number. JSON has no others, and a number too large for [`Real`] is an error with its
/// place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Num(pub Real);

/// x, y and z.
pub(super) type Triple = [Num; 3];

/// A rotation as a quaternion: w, x, y and z.
pub(super) type Quad = [Num; 4];

impl Serialize for Num {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if !self.0.is_finite() {
            let message = format!("{} is not finite, and cannot stand in a file", self.0);
            return Err(S::Error::custom(message));
        }
        self.0.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Num {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // With these, the reader rounds once, directly to the width of `Real`.
        match size_of::<Real>() {
            4 => deserializer.deserialize_f32(NumVisitor),
            _ => deserializer.deserialize_f64(NumVisitor),
        }
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Num {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Number".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "number" })
    }
}

struct NumVisitor;

impl Visitor<'_> for NumVisitor {
    type Value = Num;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a finite number of at most {:e}", Real::MAX)
    }

    fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Num, E> {
        let number = from_f64(value);
        if !number.is_finite() {
            return Err(E::invalid_value(Unexpected::Float(value), &self));
        }
        Ok(Num(number))
    }

    fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<Num, E> {
        self.visit_f64(value as f64)
    }

    fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<Num, E> {
        self.visit_f64(value as f64)
    }
}

pub(super) fn num(x: &Real) -> Num {
    Num(*x)
}

pub(super) fn vector([x, y, z]: Triple) -> Vector {
    Vector::new(x.0, y.0, z.0)
}

pub(super) fn triple(v: Vector) -> Triple {
    v.to_array().map(Num)
}

/// `None` for a positive zero, which files leave out.
pub(super) fn unless_zero(v: Vector) -> Option<Triple> {
    let zero = v.to_array().iter().all(|x| x.to_bits() == 0);
    (!zero).then(|| triple(v))
}

/// `None` for the default, which files leave out.
pub(super) fn unless<T: PartialEq>(value: T, usual: T) -> Option<T> {
    (value != usual).then_some(value)
}

pub(super) fn unless_num(value: Real, usual: Real) -> Option<Num> {
    (value.to_bits() != usual.to_bits()).then_some(Num(value))
}

pub(super) fn rotation([w, x, y, z]: Quad) -> Rotation {
    Rotation::from_xyzw(x.0, y.0, z.0, w.0)
}

/// `None` for the identity.
pub(super) fn quad(r: Rotation) -> Option<Quad> {
    unless(
        [Num(r.w), Num(r.x), Num(r.y), Num(r.z)],
        [Num(1.0), Num(0.0), Num(0.0), Num(0.0)],
    )
}

/// The pose of an optional position and an optional rotation.
pub(super) fn pose(at: Option<Triple>, turned: Option<Quad>) -> Result<Pose, FileError> {
    let turned = turned.map_or(Rotation::IDENTITY, rotation);
    let length = turned.length();
    // Rounded quaternions are accepted; others would change lengths.
    if length.is_nan() || (length - 1.0).abs() > 1e-3 {
        let message =
            format!("expected a quaternion [w, x, y, z] of length one, but its length is {length}");
        return Err(content(message).within("rotation"));
    }
    let at = at.map_or(Vector::ZERO, vector);
    Ok(Pose::from_parts(at, turned))
}

/// The largest coordinate of positions, velocities and forces; its square is finite in both precisions.
const FARTHEST: Real = 1e15;

fn refused<T>(name: &str, expected: &str, found: impl fmt::Display) -> Result<T, FileError> {
    Err(content(format!("expected {expected}, found {found}")).within(name))
}

/// A number that is zero or more.
pub(super) fn not_negative(name: &str, number: Num) -> Result<Real, FileError> {
    if number.0 >= 0.0 {
        return Ok(number.0);
    }
    refused(name, "zero or more", number.0)
}

/// A number that is more than zero.
pub(super) fn positive(name: &str, number: Num) -> Result<Real, FileError> {
    if number.0 > 0.0 {
        return Ok(number.0);
    }
    refused(name, "more than zero", number.0)
}

/// A count within bounds.
pub(super) fn count(name: &str, number: usize, least: usize) -> Result<usize, FileError> {
    /// With a larger count, a step would take too long.
    const MOST: usize = 10_000;
    if (least..=MOST).contains(&number) {
        return Ok(number);
    }
    refused(name, &format!("from {least} to {MOST}"), number)
}

/// A position, a velocity or a force.
pub(super) fn bounded(name: &str, value: Option<Triple>) -> Result<Vector, FileError> {
    let v = value.map_or(Vector::ZERO, vector);
    if v.abs().max_element() <= FARTHEST {
        return Ok(v);
    }
    refused(name, &format!("coordinates of at most {FARTHEST:e}"), v)
}

/// A pose for Rapier: its position is bounded, and its rotation is normalised, unless its length is one
/// but for some roundings.
pub(super) fn placed(at: Option<Triple>, turned: Option<Quad>) -> Result<Pose, FileError> {
    bounded("at", at)?;
    let mut pose = pose(at, turned)?;
    if (pose.rotation.length() - 1.0).abs() > 8.0 * Real::EPSILON {
        pose.rotation = pose.rotation.normalize();
    }
    Ok(pose)
}
