//! The formulas: functions from a sample, in the field's frame, to a vector in that frame.

mod buoyancy;
#[cfg(feature = "expression")]
mod expression;
mod grid;
mod kernel;
mod law;
mod nearest;
mod path;
mod radial;
mod random;
mod simple;
mod swirl;
mod turbulence;
mod velocity;

use std::sync::Arc;

pub use buoyancy::Buoyancy;
#[cfg(feature = "expression")]
pub use expression::Expression;
pub use grid::Grid;
pub use kernel::{Coordinates, LinearKernel};
pub(crate) use law::{Law, alone};
pub use nearest::Nearest;
pub use path::Path;
pub use radial::{Profile, Radial};
pub use simple::{Spring, Uniform};
pub use swirl::Swirl;
pub use turbulence::Turbulence;
pub use velocity::{Drag, Magnetic};

use super::axis::Axis;
use super::closure::Closure;
use super::contact::ContactLaw;
use super::error::{BuildError, require};
use super::query::{LocalQuery, QueryNumber, Single};
use crate::math::{DVec3, Real, to_f64};
use crate::number::{Plain, Vec3, constant, length};

/// The vector of a field where it is defined. Made by the constructors of [`Field`](crate::Field).
///
/// Each formula maps the sample, seen in the field's own frame, to a vector in that frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub enum Formula {
    /// The same vector everywhere.
    Uniform(Uniform),
    /// Along the line through the field's origin, by a profile of the distance.
    Radial(Radial),
    /// Like a radial field, from the nearest point of a shape.
    Nearest(Nearest),
    /// A spring and damper to the field's origin.
    Spring(Spring),
    /// Drag in a medium that rests in the field's frame.
    Drag(Drag),
    /// Drag in a medium that flows.
    Wind(Wind),
    /// The magnetic part of the Lorentz force.
    Magnetic(Magnetic),
    /// Around, towards and along the y axis: spin, vortex, updraft.
    Swirl(Swirl),
    /// The weight of the fluid that the sample displaces.
    Buoyancy(Buoyancy),
    /// A random flow without sources.
    Turbulence(Arc<Turbulence>),
    /// Towards and along a path.
    Path(Arc<Path>),
    /// Vectors on a regular grid.
    Grid(Arc<Grid>),
    /// The linear kernel of PhysX 2.8.
    LinearKernel(Box<LinearKernel>),
    /// A function of the user's.
    Closure(Arc<Closure>),
    /// The law of a detection field for parts that touch its collider (§3.3): for the paper's laws the
    /// change of velocity of a touching part, and zero for other parts.
    Contact(ContactLaw),
    /// Three expressions, given as text.
    // Last, so that the numbers of variants do not depend on the feature.
    #[cfg(feature = "expression")]
    Expression(Arc<Expression>),
}

/// Evaluates an expression for the law of any formula, with another expression for a wind if one is given.
macro_rules! with_law {
    ($formula:expr, $law:ident => $result:expr) => {
        with_law!($formula, $law => $result, wind: $result)
    };
    ($formula:expr, $law:ident => $result:expr, wind: $of_wind:expr) => {
        match $formula {
            Formula::Uniform($law) => $result,
            Formula::Radial($law) => $result,
            Formula::Nearest($law) => $result,
            Formula::Spring($law) => $result,
            Formula::Drag($law) => $result,
            Formula::Wind($law) => $of_wind,
            Formula::Magnetic($law) => $result,
            Formula::Swirl($law) => $result,
            Formula::Buoyancy($law) => $result,
            Formula::Turbulence($law) => $result,
            Formula::Path($law) => $result,
            Formula::Grid($law) => $result,
            Formula::LinearKernel($law) => $result,
            #[cfg(feature = "expression")]
            Formula::Expression($law) => $result,
            Formula::Closure($law) => $result,
            Formula::Contact($law) => $result,
        }
    };
}

impl Formula {
    /// The vector at a sample, in the field's frame.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(crate) fn vector<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        with_law!(self, law => law.vector(local))
    }

    /// The vector as the flow of a wind. A separate function, since a recursive one would not be inlined.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn flow<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        with_law!(self, law => law.vector(local), wind: law.within_a_wind(local))
    }

    /// The vector times a strength, before a law's own bound is applied.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(crate) fn times<T: QueryNumber>(
        &self,
        strength: f64,
        local: &LocalQuery<'_, T>,
    ) -> Vec3<T> {
        with_law!(self, law => law.times(strength, local))
    }

    /// Returns true if it can be evaluated at several samples at once.
    pub(crate) fn knows_several(&self) -> bool {
        with_law!(self, law => law.knows_several())
    }

    /// The potential at a sample, for a strength of one; `None` if the formula has none.
    pub(crate) fn potential<T: Single>(&self, local: &LocalQuery<'_, T>) -> Option<T> {
        with_law!(self, law => law.potential(local))
    }

    pub(crate) fn reads_velocity(&self) -> bool {
        with_law!(self, law => law.reads_velocity())
    }

    pub(crate) fn axes(&self) -> &[Axis] {
        with_law!(self, law => law.axes())
    }

    pub(crate) fn kind(&self) -> &'static str {
        with_law!(self, law => law.kind())
    }

    pub(crate) fn validate(&self, field: &str) -> Result<(), BuildError> {
        with_law!(self, law => law.validate(field))
    }

    /// Returns true if the vector is the same at all points of a body.
    pub(crate) fn is_uniform(&self) -> bool {
        matches!(self, Formula::Uniform(_))
    }

    /// Returns true if the vector is linear in position and velocity: a constant plus terms proportional to them.
    pub(crate) fn is_linear(&self) -> bool {
        match self {
            Formula::Uniform(_) | Formula::Magnetic(_) => true,
            Formula::Radial(radial) => radial.is_linear(),
            Formula::Spring(spring) => spring.rest_length == 0.0,
            Formula::Drag(drag) => drag.quadratic == 0.0,
            Formula::Wind(wind) => {
                let flows = wind.flow.is_linear() && wind.speed_cap == Real::INFINITY;
                flows && wind.drag.quadratic == 0.0
            }
            _ => false,
        }
    }

    /// Returns true if the vector does not change when the field's frame is translated.
    pub(crate) fn is_placeless(&self) -> bool {
        match self {
            Formula::Uniform(_) | Formula::Drag(_) | Formula::Magnetic(_) => true,
            Formula::Wind(wind) => wind.flow.is_placeless(),
            Formula::LinearKernel(kernel) => kernel.is_placeless(),
            _ => false,
        }
    }

    /// Returns true if the vector may be the velocity of a medium: it depends neither on a touch nor on the velocity or
    /// the volume of the sample.
    fn is_flow(&self) -> bool {
        use Formula::*;
        !matches!(self, Contact(_) | Drag(_) | Magnetic(_) | Buoyancy(_))
    }

    /// Returns true if the vector depends on the volume of the sample.
    pub(crate) fn reads_volume(&self) -> bool {
        match self {
            Formula::Buoyancy(_) => true,
            Formula::Wind(wind) => wind.flow.reads_volume(),
            _ => false,
        }
    }

    /// Returns true if the vector may differ between the colliders of a body at one place.
    pub(crate) fn reads_parts(&self) -> bool {
        match self {
            Formula::Closure(_) | Formula::Buoyancy(_) => true,
            Formula::Wind(wind) => wind.flow.reads_parts(),
            formula => formula.axes().iter().any(Axis::is_of_part),
        }
    }

    /// Returns true if the vector may depend on time, apart from the axes it names.
    pub(crate) fn reads_time(&self) -> bool {
        match self {
            Formula::Turbulence(law) => law.turnover != 0.0,
            Formula::Wind(wind) => wind.flow.reads_time(),
            Formula::Closure(_) => true,
            _ => false,
        }
    }

    /// Returns true if it is known to be zero wherever it is defined.
    pub(crate) fn is_zero(&self) -> bool {
        use crate::math::Vector;
        match self {
            Formula::Uniform(law) => law.vector == Vector::ZERO,
            Formula::Radial(law) => law.unit().0 == 0.0,
            Formula::Drag(law) => law.linear == 0.0 && law.quadratic == 0.0,
            Formula::Magnetic(law) => law.field == Vector::ZERO,
            _ => false,
        }
    }
}

/// Drag relative to a flow: F = (c₁ + c₂ |w|) w for the velocity w = u − v of the flow u past the
/// sample. Where |w| is above the cap, w is shortened to it, so that the force has a bound.
///
/// The flow is another formula's vector, read as a velocity in the field's frame.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct Wind {
    /// u.
    #[cfg_attr(feature = "serde-serialize", serde(with = "crate::field::saved::flow"))]
    pub flow: Box<Formula>,
    /// c₁ and c₂.
    pub drag: Drag,
    /// The length to which w is shortened (m/s); may be infinite.
    #[cfg_attr(
        feature = "serde-serialize",
        serde(with = "crate::field::saved::upper")
    )]
    pub speed_cap: Real,
}

impl Wind {
    #[inline(never)]
    fn within_a_wind<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        self.vector(local)
    }
}

impl Law for Wind {
    fn kind(&self) -> &'static str {
        "wind"
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn vector<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let past = local.velocity - self.flow.flow(local);
        let cap = to_f64(self.speed_cap);
        if cap == f64::INFINITY {
            return self.drag.force(past);
        }
        let speed = length(past);
        let shortened = past * (speed.recip() * cap);
        let within = speed.re().at_most(cap);
        self.drag.force(Vec3::select(within, past, shortened))
    }

    fn knows_several(&self) -> bool {
        !matches!(*self.flow, Formula::Wind(_)) && self.flow.knows_several()
    }

    fn reads_velocity(&self) -> bool {
        true
    }

    fn axes(&self) -> &[Axis] {
        self.flow.axes()
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        let cap = to_f64(self.speed_cap);
        require(cap >= 0.0, field, "the speed cap", "zero or more", cap)?;
        if !self.flow.is_flow() {
            return Err(BuildError::Misfit {
                field: field.into(),
                setter: "as_wind",
                formula: self.flow.kind(),
            });
        }
        self.flow.validate(field)?;
        self.drag.validate(field)
    }
}

impl Law for ContactLaw {
    fn kind(&self) -> &'static str {
        "contact"
    }

    fn vector<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        // Only a single sample has touches.
        let push = local.touch().map_or(DVec3::ZERO, |it| self.push(it));
        constant(local.rotation.inverse() * push)
    }

    fn potential<T: Single>(&self, _: &LocalQuery<'_, T>) -> Option<T> {
        Some(0.0.into())
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        ContactLaw::validate(self, field)
    }
}

#[cfg(test)]
mod tests;
