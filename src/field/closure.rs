//! Functions of the user's as formulas, scalars and predicates.

use std::fmt;
use std::sync::Arc;

use super::axis::Axis;
use super::error::BuildError;
use super::formula::{Law, alone};
use super::query::{Alone, LocalQuery, QueryNumber, Sample, Single};
use crate::math::{DVec3, Real, Vector, from_f64, to_dvec3, to_f64};
use crate::number::{Vec3, chain, constant, differences, real};

type Function<R> = dyn Fn(&Sample<'_>) -> R + Send + Sync;

/// A user's function with the axes it reads: a formula or, by the type of its result, a
/// [scalar](crate::Scalar::closure) or a [predicate](crate::Region::predicate).
///
/// The derivatives of a formula are central differences, with errors of about 10⁻⁴ of the vector in `f32` and 10⁻⁹
/// in `f64` where the formula is smooth. Derivatives by axes other than position and velocity are left out.
///
/// Code cannot be saved. A closure with a name is saved as that name; after reading it has to be
/// [resolved](crate::Tree::resolve) before it can be used.
pub struct Closure<R = Vector> {
    name: Option<Arc<str>>,
    axes: Vec<Axis>,
    reads_velocity: bool,
    /// `None` for a closure that was read and not resolved.
    function: Option<Box<Function<R>>>,
}

/// The results that a closure may have.
pub trait Output: Sized + 'static {
    /// The kind of closure that has this result, for messages.
    const KIND: &'static str;
    /// The result of a closure that is not resolved. No valid tree holds such a closure.
    const NONE: Self;
}

impl Output for Vector {
    const KIND: &'static str = "formula";
    const NONE: Self = Vector::NAN;
}

impl Output for Real {
    const KIND: &'static str = "scalar";
    const NONE: Self = Real::NAN;
}

impl Output for bool {
    const KIND: &'static str = "predicate";
    const NONE: Self = false;
}

impl<R> Closure<R> {
    /// Its name, if it has one.
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    pub(crate) fn new(
        name: Option<&str>,
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> R + Send + Sync + 'static,
    ) -> Arc<Self> {
        let axes: Vec<Axis> = reads.into_iter().collect();
        Arc::new(Closure {
            name: name.map(Arc::from),
            reads_velocity: axes.iter().any(Axis::reads_velocity),
            axes,
            function: Some(Box::new(function)),
        })
    }

    /// A closure whose function is to be looked up by its name.
    #[cfg(feature = "serde-serialize")]
    pub(crate) fn unresolved(name: Arc<str>) -> Self {
        Closure {
            name: Some(name),
            axes: Vec::new(),
            reads_velocity: false,
            function: None,
        }
    }

    pub(crate) fn is_resolved(&self) -> bool {
        self.function.is_some()
    }

    pub(crate) fn axes(&self) -> &[Axis] {
        &self.axes
    }
}

impl<R: Output> Closure<R> {
    /// The result for a sample.
    pub(crate) fn at<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> R {
        let result = |one: LocalQuery<'_>| self.beside(&one, real(one.point), real(one.velocity));
        local.single().map_or(R::NONE, result)
    }

    /// The result for the sample at another point and velocity in the field's frame.
    fn beside<T: Single>(&self, local: &LocalQuery<'_, T>, point: DVec3, velocity: DVec3) -> R {
        let Some(function) = &self.function else {
            return R::NONE;
        };
        let moved = LocalQuery::<f64> {
            point: constant(point),
            velocity: constant(velocity),
            rotation: local.rotation,
            collider: local.collider,
            query: local.query,
        };
        let value = |axis: &Axis| moved.axis(axis).map_or(Real::NAN, from_f64);
        let axes: Vec<Real> = self.axes.iter().map(value).collect();
        function(&Sample::new(local.query, point, velocity, &axes))
    }

    pub(crate) fn validate(&self, field: &str) -> Result<(), BuildError> {
        if self.is_resolved() {
            return Ok(());
        }
        Err(BuildError::Unresolved {
            field: field.into(),
            kind: R::KIND,
            closure: self.name.as_deref().unwrap_or_default().to_owned(),
        })
    }
}

/// The step of a central difference at `x`, for a function computed in [`Real`]: the cube root of
/// its epsilon balances rounding and truncation.
pub(super) fn difference_step(x: f64) -> f64 {
    to_f64(Real::EPSILON).cbrt() * x.abs().max(1.0)
}

impl Alone for Closure {
    fn vector_alone<T: Single>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let (p, v) = (real(local.point), real(local.velocity));
        let inputs = [local.point, local.velocity];
        let inputs: [T; 6] = std::array::from_fn(|k| inputs[k / 3][k % 3]);
        let at = |p, v| to_dvec3(self.beside(local, p, v));
        chain(constant(at(p, v)), inputs, || {
            let here = [p.x, p.y, p.z, v.x, v.y, v.z];
            let steps = here.map(difference_step);
            let moved =
                |[x, y, z, vx, vy, vz]: [f64; 6]| at(DVec3::new(x, y, z), DVec3::new(vx, vy, vz));
            differences(here, steps, moved).map(constant)
        })
    }
}

impl Law for Closure {
    fn kind(&self) -> &'static str {
        "closure"
    }

    alone!();

    fn reads_velocity(&self) -> bool {
        self.reads_velocity
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        Closure::validate(self, field)
    }
}

/// A closure is equal to itself only.
impl<R> PartialEq for Closure<R> {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl<R> fmt::Debug for Closure<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Closure")
            .field("name", &self.name)
            .field("axes", &self.axes)
            .finish_non_exhaustive()
    }
}

#[cfg(feature = "serde-serialize")]
impl<R: Output> serde::Serialize for Closure<R> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.name {
            Some(name) => serializer.serialize_str(name),
            None => Err(serde::ser::Error::custom(format!(
                "a {} is a closure without a name, and cannot be saved",
                R::KIND
            ))),
        }
    }
}

#[cfg(feature = "serde-serialize")]
impl<'de, R> serde::Deserialize<'de> for Closure<R> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Arc::<str>::deserialize(deserializer).map(Closure::unresolved)
    }
}
