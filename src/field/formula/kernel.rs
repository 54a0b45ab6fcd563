//! The linear kernel of PhysX 2.8.

use super::{Law, alone};
use crate::field::error::{BuildError, all_finite, finite_vector};
use crate::field::query::{Alone, LocalQuery, Single};
use crate::math::{DVec3, Real, Vector, to_dvec3, to_f64};
use crate::number::{Number, Vec3, constant, direction, length, real};

/// For a position p and a velocity v in some coordinates,
/// f_i = \[K + M_p (P − p) + M_v (V − v) + N a\]_i / (1 + l_i |P_i − p_i| + q_i (P_i − p_i)²)
/// (NVIDIA PhysX 2.8, `NxForceFieldLinearKernel`).
///
/// a is a vector of random numbers from 0 to 1. Here it is a hash of the sample's position and time,
/// so that a run repeats bit by bit. Its derivatives are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct LinearKernel {
    /// The coordinates that the components are in.
    pub coordinates: Coordinates,
    /// K.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub constant: Vector,
    /// P.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub position_target: Vector,
    /// M_p, by rows.
    #[cfg_attr(feature = "schemars", schemars(with = "[[f64; 3]; 3]"))]
    pub position_multiplier: [Vector; 3],
    /// V.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub velocity_target: Vector,
    /// M_v, by rows.
    #[cfg_attr(feature = "schemars", schemars(with = "[[f64; 3]; 3]"))]
    pub velocity_multiplier: [Vector; 3],
    /// N.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub noise: Vector,
    /// l.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub falloff_linear: Vector,
    /// q.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub falloff_quadratic: Vector,
}

/// Coordinates around the y axis of the field's frame. In all but the Cartesian ones the
/// components of p, v and f are along an orthonormal triad that turns with the point; its first
/// direction is outward, and where that is not defined the force is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Coordinates {
    /// x, y and z.
    #[default]
    Cartesian,
    /// Outward from the origin, with p = (r, 0, 0); around the y axis; and across both.
    Spherical,
    /// Outward from the y axis, along it, and around it, with p = (ρ, y, 0).
    Cylindrical,
    /// Outward from a ring around the y axis, along the ring, and around it as a tube, with
    /// p = (distance from the ring, 0, 0).
    Toroidal {
        /// The radius of the ring.
        radius: Real,
    },
}

impl Coordinates {
    /// The triad at a point, and the coordinates of the point.
    fn triad<T: Number<Plain = f64>>(self, p: Vec3<T>) -> Option<([Vec3<T>; 3], Vec3<T>)> {
        let zero = T::from(0.0);
        let y = constant::<T>(DVec3::Y);
        let from_axis = Vec3::new(p.x, zero, p.z);
        let (outward, place) = match self {
            Coordinates::Cartesian => {
                let axes = DVec3::AXES.map(constant::<T>);
                return Some((axes, p));
            }
            Coordinates::Spherical => (p, Vec3::new(length(p), zero, zero)),
            Coordinates::Cylindrical => (from_axis, Vec3::new(length(from_axis), p.y, zero)),
            Coordinates::Toroidal { radius } => {
                let from_ring = p - direction(from_axis) * T::from(to_f64(radius));
                (from_ring, Vec3::new(length(from_ring), zero, zero))
            }
        };
        let e1 = direction(outward);
        let around = direction(y.cross(from_axis));
        let is_axis = real(e1) == DVec3::ZERO || real(around) == DVec3::ZERO;
        (!is_axis).then(|| match self {
            Coordinates::Cylindrical => ([e1, y, around], place),
            _ => ([e1, around, e1.cross(around)], place),
        })
    }
}

/// The rows times a vector.
fn times<T: Number>(rows: &[Vector; 3], v: Vec3<T>) -> Vec3<T> {
    let row = |k: usize| constant::<T>(to_dvec3(rows[k])).dot(v);
    Vec3::new(row(0), row(1), row(2))
}

/// Three pseudo-random numbers from 0 to 1.
fn hash(point: DVec3, time: f64) -> DVec3 {
    let mut seed = 0;
    for x in [point.x, point.y, point.z, time] {
        seed = super::random::Random::new(seed ^ x.to_bits()).bits();
    }
    let mut random = super::random::Random::new(seed);
    DVec3::new(random.uniform(), random.uniform(), random.uniform())
}

impl LinearKernel {
    /// Returns true if the vector does not depend on the position.
    pub(super) fn is_placeless(&self) -> bool {
        let of_place = [self.noise, self.falloff_linear, self.falloff_quadratic];
        self.coordinates == Coordinates::Cartesian
            && self.position_multiplier == [Vector::ZERO; 3]
            && of_place == [Vector::ZERO; 3]
    }
}

impl Alone for LinearKernel {
    fn vector_alone<T: Single>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let Some((triad, place)) = self.coordinates.triad(local.point) else {
            return constant(DVec3::ZERO);
        };
        let along = |k: usize| triad[k].dot(local.velocity);
        let velocity = Vec3::new(along(0), along(1), along(2));
        let off = constant::<T>(to_dvec3(self.position_target)) - place;
        let slower = constant::<T>(to_dvec3(self.velocity_target)) - velocity;
        let mut noise = DVec3::ZERO;
        if self.noise != Vector::ZERO {
            noise = to_dvec3(self.noise) * hash(local.local_point(), local.query.time);
        }
        let force = constant::<T>(to_dvec3(self.constant) + noise)
            + times(&self.position_multiplier, off)
            + times(&self.velocity_multiplier, slower);
        let (l, q) = (self.falloff_linear, self.falloff_quadratic);
        let mut sum = Vec3::zero();
        for k in 0..3 {
            let falloff = off[k].abs() * to_f64(l[k]) + off[k] * off[k] * to_f64(q[k]) + 1.0;
            sum += triad[k] * (force[k] / falloff);
        }
        sum
    }
}

impl Law for LinearKernel {
    fn kind(&self) -> &'static str {
        "linear kernel"
    }

    alone!();

    fn reads_velocity(&self) -> bool {
        self.velocity_multiplier != [Vector::ZERO; 3]
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        if let Coordinates::Toroidal { radius } = self.coordinates {
            all_finite(field, &[("the radius of the ring", radius)])?;
        }
        let [p0, p1, p2] = self.position_multiplier;
        let [v0, v1, v2] = self.velocity_multiplier;
        for (quantity, vector) in [
            ("the constant", self.constant),
            ("the position target", self.position_target),
            ("the position multiplier", p0),
            ("the position multiplier", p1),
            ("the position multiplier", p2),
            ("the velocity target", self.velocity_target),
            ("the velocity multiplier", v0),
            ("the velocity multiplier", v1),
            ("the velocity multiplier", v2),
            ("the noise", self.noise),
            ("the linear falloff", self.falloff_linear),
            ("the quadratic falloff", self.falloff_quadratic),
        ] {
            finite_vector(field, quantity, vector)?;
        }
        Ok(())
    }
}
