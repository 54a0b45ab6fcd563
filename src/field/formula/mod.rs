//! The algebraic component of a field: the function from a sample to a vector.

mod closure;
mod radial;
mod velocity;

use std::sync::Arc;

pub use closure::Closure;
pub use radial::{Profile, Radial};

use super::axis::Axis;
use super::contact::ContactLaw;
use super::error::{TreeError, finite};
use super::query::LocalQuery;
use crate::math::{DVec3, Real, Vector, to_dvec3, to_f64};

/// What a field does where it is defined. Made by the constructors of [`Field`](crate::Field).
///
/// Each formula maps the sample, seen in the field's own frame, to a vector in that frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Formula {
    /// The same vector everywhere.
    Uniform(Vector),
    /// Along the line through the field's origin, by a profile of the distance.
    Radial(Radial),
    /// F = −k (r − L) d/r − c v, with v relative to the field's frame; for a rest length L of
    /// zero, F = −k d − c v. Potential k (r − L)²/2, of the spring alone.
    Spring {
        /// k, force per length.
        stiffness: Real,
        /// c, force per velocity; isotropic.
        damping: Real,
        /// L.
        rest_length: Real,
    },
    /// F = −(c₁ + c₂ |v|) v, with v relative to the field's frame.
    Drag {
        /// c₁, force per velocity.
        linear: Real,
        /// c₂, force per velocity squared.
        quadratic: Real,
    },
    /// F = v × B, with v relative to the field's frame; coupled to the charge by default.
    Magnetic(Vector),
    /// A function of the user's.
    Closure(Arc<Closure>),
    /// Detects who touches the collider the field is anchored to (§3.3), and answers by a law.
    /// Where nothing touches, and as a force, it is zero.
    Contact(ContactLaw),
}

impl Formula {
    /// The vector at a sample, in the field's frame.
    pub(crate) fn vector(&self, local: &LocalQuery<'_>) -> DVec3 {
        match self {
            Formula::Uniform(vector) => to_dvec3(*vector),
            Formula::Radial(radial) => local.point * radial.factor(local.point.length_squared()),
            Formula::Spring {
                stiffness,
                damping,
                rest_length,
            } => {
                let (k, l) = (to_f64(*stiffness), to_f64(*rest_length));
                radial::spring(local.point, k, l) - local.velocity * to_f64(*damping)
            }
            Formula::Drag { linear, quadratic } => {
                velocity::drag(local.velocity, to_f64(*linear), to_f64(*quadratic))
            }
            Formula::Magnetic(b) => local.velocity.cross(to_dvec3(*b)),
            Formula::Closure(closure) => closure.vector(local),
            Formula::Contact(_) => DVec3::ZERO,
        }
    }

    /// The potential at a sample, F = −∇U, where the formula has one.
    pub(crate) fn potential(&self, local: &LocalQuery<'_>) -> Option<f64> {
        match self {
            Formula::Uniform(vector) => Some(-to_dvec3(*vector).dot(local.point)),
            Formula::Radial(radial) => Some(radial.potential(local.point.length_squared())),
            Formula::Spring {
                stiffness,
                rest_length,
                ..
            } => {
                let stretch = local.point.length() - to_f64(*rest_length);
                Some(to_f64(*stiffness) * stretch * stretch / 2.0)
            }
            // A magnetic field does no work, and a detection field is no force.
            Formula::Magnetic(_) | Formula::Contact(_) => Some(0.0),
            Formula::Drag { .. } | Formula::Closure(_) => None,
        }
    }

    /// Whether the vector depends on the velocity of the probe.
    pub(crate) fn reads_velocity(&self) -> bool {
        match self {
            Formula::Spring { damping, .. } => *damping != 0.0,
            Formula::Drag { .. } | Formula::Magnetic(_) => true,
            Formula::Closure(closure) => closure.reads_velocity(),
            Formula::Uniform(_) | Formula::Radial(_) | Formula::Contact(_) => false,
        }
    }

    /// Whether the vector is the same at all points of a body.
    pub(crate) fn is_uniform(&self) -> bool {
        matches!(self, Formula::Uniform(_))
    }

    /// The axes the formula names beyond those every formula may read.
    pub(crate) fn axes(&self) -> &[Axis] {
        match self {
            Formula::Closure(closure) => closure.axes(),
            _ => &[],
        }
    }

    /// The formula's name, for messages and plans.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Formula::Uniform(_) => "uniform",
            Formula::Radial(radial) => radial.kind(),
            Formula::Spring { .. } => "spring",
            Formula::Drag { .. } => "drag",
            Formula::Magnetic(_) => "magnetic",
            Formula::Closure(_) => "closure",
            Formula::Contact(_) => "contact",
        }
    }

    pub(crate) fn validate(&self, field: &str) -> Result<(), TreeError> {
        let all_finite = |values: &[(&'static str, Real)]| {
            values
                .iter()
                .try_for_each(|(quantity, value)| finite(field, quantity, *value))
        };
        match self {
            Formula::Uniform(v) | Formula::Magnetic(v) => v
                .to_array()
                .iter()
                .try_for_each(|x| finite(field, "a component of the vector", *x)),
            Formula::Radial(radial) => radial.validate(field),
            Formula::Spring {
                stiffness,
                damping,
                rest_length,
            } => all_finite(&[
                ("the stiffness", *stiffness),
                ("the damping", *damping),
                ("the rest length", *rest_length),
            ]),
            Formula::Drag { linear, quadratic } => all_finite(&[
                ("the linear drag coefficient", *linear),
                ("the quadratic drag coefficient", *quadratic),
            ]),
            Formula::Contact(law) => law.validate(field),
            Formula::Closure(_) => Ok(()),
        }
    }
}
