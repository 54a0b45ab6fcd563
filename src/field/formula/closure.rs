//! A formula of the user's own.

use std::fmt;

use crate::field::axis::Axis;
use crate::field::query::{LocalQuery, Sample};
use crate::math::{DVec3, Real, Vector, from_f64, to_dvec3};

type Function = dyn Fn(&Sample<'_>) -> Vector + Send + Sync;

/// A user's formula, and what it reads.
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

    pub(crate) fn vector(&self, local: &LocalQuery<'_>) -> DVec3 {
        let value = |axis| local.axis(axis).map_or(Real::NAN, from_f64);
        let axes: Vec<Real> = self.axes.iter().map(value).collect();
        to_dvec3((self.function)(&Sample::new(local, &axes)))
    }

    pub(crate) fn reads_velocity(&self) -> bool {
        self.reads_velocity
    }

    pub(crate) fn axes(&self) -> &[Axis] {
        &self.axes
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
