//! A formula that follows a path.

use super::{Law, alone};
use crate::field::error::{BuildError, POSITIVE, all_finite, finite_vector, require};
use crate::field::query::{Alone, LocalQuery, Single};
use crate::math::{DVec3, Real, Vector, to_dvec3, to_f64};
use crate::number::{Number, Vec3, constant};

/// Towards and along a path of straight pieces: F = k (g − p) + c (speed · t − v), for the goal g
/// on the path, `look_ahead` beyond the point nearest to p, and the direction t of the path there.
///
/// An open path ends at its first and its last point; for a goal beyond them it is the end, and t is zero. Where two
/// points of the path are equally near, the force jumps; at corners its derivatives do.
#[derive(Clone, Debug, PartialEq)]
#[must_use = "setters and operators take the value and return the changed one"]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(from = "PathSettings", into = "PathSettings")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Path {
    pub(crate) points: Vec<DVec3>,
    /// Length of the path up to each point.
    lengths: Vec<f64>,
    pub(crate) closed: bool,
    /// Speed along the path.
    pub speed: Real,
    /// Distance from the nearest point to the goal, along the path; negative to go back.
    pub look_ahead: Real,
    /// k, force per length.
    pub stiffness: Real,
    /// c, force per velocity.
    pub damping: Real,
}

impl Path {
    /// A path through at least two points of the field's frame. If `closed`, a last straight piece leads back to the
    /// first point.
    pub fn new(points: impl IntoIterator<Item = Vector>, closed: bool) -> Self {
        let mut points: Vec<DVec3> = points.into_iter().map(to_dvec3).collect();
        if let (true, Some(first)) = (closed, points.first()) {
            points.push(*first);
        }
        let mut length = 0.0;
        let mut lengths = Vec::with_capacity(points.len());
        for (k, point) in points.iter().enumerate() {
            length += k.checked_sub(1).map_or(0.0, |k| point.distance(points[k]));
            lengths.push(length);
        }
        Path {
            points,
            lengths,
            closed,
            speed: 0.0,
            look_ahead: 0.0,
            stiffness: 1.0,
            damping: 0.0,
        }
    }

    /// Sets the pull towards the goal, force per length. One by default.
    pub fn stiffness(mut self, stiffness: Real) -> Self {
        self.stiffness = stiffness;
        self
    }

    /// Sets the damping of the velocity towards `speed` along the path, force per velocity. None
    /// by default.
    pub fn damping(mut self, damping: Real, speed: Real) -> Self {
        (self.damping, self.speed) = (damping, speed);
        self
    }

    /// Sets the distance from the nearest point to the goal, along the path. Zero by default.
    pub fn look_ahead(mut self, distance: Real) -> Self {
        self.look_ahead = distance;
        self
    }

    /// The place along the path nearest to a point, as a length from its start.
    fn nearest<T: Number<Plain = f64>>(&self, point: Vec3<T>) -> T {
        let mut best: Option<(f64, T)> = None;
        for (k, ends) in self.points.windows(2).enumerate() {
            let along = ends[1] - ends[0];
            let length = along.length();
            let from_start = point - ends[0];
            let mut place = from_start.dot(constant(along)) / length;
            if place.re() <= 0.0 || place.re().is_nan() {
                place = 0.0.into();
            } else if place.re() > length {
                place = length.into();
            }
            let aside = from_start - constant::<T>(along / length) * place;
            let distance2 = aside.dot(aside).re();
            if best.is_none_or(|(least, _)| distance2 < least) {
                best = Some((distance2, place + self.lengths[k]));
            }
        }
        best.map_or(0.0.into(), |(_, place)| place)
    }

    /// The point of the path at a length from its start, and the direction of the path there.
    fn at<T: Number<Plain = f64>>(&self, mut place: T) -> (Vec3<T>, DVec3) {
        let total = self.lengths.last().copied().unwrap_or(0.0);
        let last = self.points.len() - 1;
        if self.closed {
            place = place - (place.re() / total).floor() * total;
        } else if place.re() < 0.0 {
            return (constant(self.points[0]), DVec3::ZERO);
        } else if place.re() >= total {
            return (constant(self.points[last]), DVec3::ZERO);
        }
        let beyond = self
            .lengths
            .partition_point(|length| *length <= place.re())
            .clamp(1, last);
        let start = self.points[beyond - 1];
        let direction = (self.points[beyond] - start).normalize_or_zero();
        let along = constant::<T>(direction) * (place - self.lengths[beyond - 1]);
        (constant::<T>(start) + along, direction)
    }
}

/// The settings of a path, as they are saved.
#[cfg(feature = "serde-serialize")]
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct PathSettings {
    #[cfg_attr(feature = "schemars", schemars(with = "Vec<[f64; 3]>"))]
    points: Vec<Vector>,
    #[serde(default)]
    closed: bool,
    #[serde(default)]
    speed: Real,
    #[serde(default, alias = "predict")]
    look_ahead: Real,
    #[serde(default = "usual_stiffness")]
    stiffness: Real,
    #[serde(default)]
    damping: Real,
}

#[cfg(feature = "serde-serialize")]
fn usual_stiffness() -> Real {
    1.0
}

#[cfg(feature = "serde-serialize")]
impl From<PathSettings> for Path {
    fn from(settings: PathSettings) -> Self {
        Path {
            speed: settings.speed,
            look_ahead: settings.look_ahead,
            stiffness: settings.stiffness,
            damping: settings.damping,
            ..Path::new(settings.points, settings.closed)
        }
    }
}

#[cfg(feature = "serde-serialize")]
impl From<Path> for PathSettings {
    fn from(path: Path) -> Self {
        let points = path.points.iter().copied().map(crate::math::from_dvec3);
        // A closed path has its first point twice.
        let distinct = path.points.len() - usize::from(path.closed && !path.points.is_empty());
        PathSettings {
            points: points.take(distinct).collect(),
            closed: path.closed,
            speed: path.speed,
            look_ahead: path.look_ahead,
            stiffness: path.stiffness,
            damping: path.damping,
        }
    }
}

impl Alone for Path {
    fn vector_alone<T: Single>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let place = self.nearest(local.point) + to_f64(self.look_ahead);
        let (goal, direction) = self.at(place);
        let wanted = constant::<T>(direction * to_f64(self.speed));
        let (k, c) = (to_f64(self.stiffness), to_f64(self.damping));
        (goal - local.point) * T::from(k) + (wanted - local.velocity) * T::from(c)
    }
}

impl Law for Path {
    fn kind(&self) -> &'static str {
        "path"
    }

    alone!();

    fn reads_velocity(&self) -> bool {
        self.damping != 0.0
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        let count = self.points.len();
        let quantity = "the number of points of the path";
        require(count >= 2, field, quantity, "two or more", count as f64)?;
        for point in &self.points {
            let point = crate::math::from_dvec3(*point);
            finite_vector(field, "a coordinate of the path", point)?;
        }
        let distinct = self.points.windows(2).all(|ends| ends[0] != ends[1]);
        let quantity = "the length of each piece of the path";
        require(distinct, field, quantity, POSITIVE, 0.0)?;
        all_finite(
            field,
            &[
                ("the speed", self.speed),
                ("the look-ahead", self.look_ahead),
                ("the stiffness", self.stiffness),
                ("the damping", self.damping),
            ],
        )
    }
}
