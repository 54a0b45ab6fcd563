//! A formula of the user's own.

use std::fmt;

use super::Law;
use crate::field::axis::Axis;
use crate::field::error::BuildError;
use crate::field::number::{Number, Vec3, chain, differences, real};
use crate::field::query::{LocalQuery, Sample};
use crate::math::{DVec3, Real, Vector, from_f64, to_dvec3, to_f64};

type Function = dyn Fn(&Sample<'_>) -> Vector + Send + Sync;

/// A user's formula, and what it reads.
///
/// Its derivatives are central differences: good to some 10⁻⁴ of the vector in `f32`, 10⁻⁹ in
/// `f64`, where it is smooth. Derivatives by other axes than place and velocity are left out.
pub struct Closure {
    function: Box<Function>,
    axes: Vec<Axis>,
    reads_velocity: bool,
}

impl Closure {
    pub(crate) fn new(
        axes: Vec<Axis>,
        function: impl Fn(&Sample<'_>) -> Vector + Send + Sync + 'static,
    ) -> Self {
        Closure {
            function: Box::new(function),
            reads_velocity: axes.contains(&Axis::Speed),
            axes,
        }
    }

    fn at<T: Number>(&self, local: &LocalQuery<'_, T>, point: DVec3, velocity: DVec3) -> DVec3 {
        let value = |axis: &Axis| match axis {
            Axis::X => from_f64(point.x),
            Axis::Y => from_f64(point.y),
            Axis::Z => from_f64(point.z),
            Axis::Speed => from_f64(velocity.length()),
            _ => local.axis(axis).map_or(Real::NAN, from_f64),
        };
        let axes: Vec<Real> = self.axes.iter().map(value).collect();
        let sample = Sample::new(local.query, point, velocity, &axes);
        to_dvec3((self.function)(&sample))
    }
}

/// The step of a central difference at `x`, for a function computed in [`Real`]: the cube root of
/// its rounding balances that against the truncation.
pub(super) fn difference_step(x: f64) -> f64 {
    to_f64(Real::EPSILON).cbrt() * x.abs().max(1.0)
}

impl Law for Closure {
    fn kind(&self) -> &'static str {
        "closure"
    }

    fn vector<T: Number>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let (p, v) = (real(&local.point), real(&local.velocity));
        let inputs = [local.point, local.velocity];
        let inputs: [T; 6] = std::array::from_fn(|k| inputs[k / 3][k % 3]);
        chain(self.at(local, p, v), inputs, || {
            let at = [p.x, p.y, p.z, v.x, v.y, v.z];
            differences(at, at.map(difference_step), |[x, y, z, vx, vy, vz]| {
                self.at(local, DVec3::new(x, y, z), DVec3::new(vx, vy, vz))
            })
        })
    }

    fn reads_velocity(&self) -> bool {
        self.reads_velocity
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn validate(&self, _: &str) -> Result<(), BuildError> {
        Ok(())
    }
}

/// Equal to itself only.
impl PartialEq for Closure {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl fmt::Debug for Closure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Closure")
            .field("axes", &self.axes)
            .finish_non_exhaustive()
    }
}
