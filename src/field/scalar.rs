//! Numbers that depend on the sample, by which vectors are scaled.

use std::sync::Arc;

use super::axis::Axis;
use super::closure::Closure;
use super::error::{BuildError, finite, positive, require};
use super::query::{LocalQuery, QueryNumber, Sample};
use super::region::Region;
use super::stack::Stack;
use crate::math::{Real, to_f64};
use crate::number::{Number, Plain, length};

/// A number for each sample, made from its coordinates by curves: masks, soft edges, falloff curves, time envelopes.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// // Full strength up to 5 length units from the origin, none beyond 8.
/// let falloff = Scalar::distance().smooth(8.0, 5.0);
/// // Swells over the first second, then dies away within a tenth.
/// let envelope = Scalar::time().table([(0.0, 0.0), (1.0, 1.0), (1.1, 0.0)]);
/// let gust = Field::uniform(Vector::X * 20.0).scaled_by(falloff.times(envelope));
/// // A wind zone that rises from its border over half a length unit.
/// let zone = Region::cuboid(Vector::splat(3.0));
/// let soft = Field::uniform(Vector::X).within(zone.clone()).scaled_by(Scalar::depth(zone).ramp(0.0, 0.5));
/// # let _ = (gust, soft);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[must_use = "setters and operators take the value and return the changed one"]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(try_from = "super::saved::ScalarSteps")
)]
pub struct Scalar {
    /// In postfix order, so that neither deep nesting nor its drop can overflow the call stack.
    pub(crate) steps: Vec<ScalarStep>,
}

/// One step of a scalar: a number, or an operation on the numbers before it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[non_exhaustive]
pub enum ScalarStep {
    /// A number.
    Constant(Real),
    /// The coordinate along an axis.
    Axis(Axis),
    /// The distance from the origin.
    Distance,
    /// Depth of the sample in a region.
    Depth(Box<Region>),
    /// A function of the user's.
    Function(Arc<Closure<Real>>),
    /// A function of the number before.
    Curve(Curve),
    /// The sum of the two numbers before.
    Plus,
    /// Their product.
    Times,
    /// The lesser of them.
    Lesser,
    /// The greater of them.
    Greater,
}

/// A function of one number.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[non_exhaustive]
pub enum Curve {
    /// From zero to one.
    Ramp {
        /// The number that becomes zero.
        from: Real,
        /// The number that becomes one.
        to: Real,
        /// True if the curve is level at its ends.
        smooth: bool,
    },
    /// To this power.
    Power(Real),
    /// The exponential of the number times this.
    Exponential(Real),
    /// A bell curve of this width.
    Gaussian(Real),
    /// Straight lines between points.
    Table(Arc<[(Real, Real)]>),
}

impl Scalar {
    /// The same number everywhere.
    pub fn constant(value: Real) -> Self {
        Self::from(ScalarStep::Constant(value))
    }

    /// The coordinate along an axis, in the frame of the field.
    pub fn axis(axis: impl Into<Axis>) -> Self {
        Self::from(ScalarStep::Axis(axis.into()))
    }

    /// Simulated time.
    pub fn time() -> Self {
        Self::axis(Axis::Time)
    }

    /// The distance from the origin of the field's frame.
    pub fn distance() -> Self {
        Self::from(ScalarStep::Distance)
    }

    /// Depth of the sample inside a region of the field's frame, negative outside. Inside one simple solid this is the
    /// distance from its border; otherwise its size is at most that. For a [ball over axes](Region::ball_over) it is
    /// the smallest radius times 1 − ρ, with ρ² = Σ ((a − cₐ)/rₐ)².
    pub fn depth(region: Region) -> Self {
        Self::from(ScalarStep::Depth(Box::new(region)))
    }

    /// A function of the user's own. `reads` lists the axes whose values are in [`Sample::axes`]. Its derivatives are
    /// taken as zero.
    pub fn closure(
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> Real + Send + Sync + 'static,
    ) -> Self {
        Self::from(ScalarStep::Function(Closure::new(None, reads, function)))
    }

    /// Like [`closure`](Self::closure), with a name under which it can be saved; see
    /// [`Registry`](super::Registry).
    pub fn closure_named(
        name: &str,
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> Real + Send + Sync + 'static,
    ) -> Self {
        let closure = Closure::new(Some(name), reads, function);
        Self::from(ScalarStep::Function(closure))
    }

    /// Linear from 0 at `from` to 1 at `to`, and constant beyond. `to` may be less than `from`.
    pub fn ramp(self, from: Real, to: Real) -> Self {
        let smooth = false;
        self.then(ScalarStep::Curve(Curve::Ramp { from, to, smooth }))
    }

    /// Like [`ramp`](Self::ramp), without corners: 3 t² − 2 t³.
    pub fn smooth(self, from: Real, to: Real) -> Self {
        let smooth = true;
        self.then(ScalarStep::Curve(Curve::Ramp { from, to, smooth }))
    }

    /// xⁿ; NaN for x < 0 and fractional n, infinite at 0 for n < 0.
    pub fn power(self, n: Real) -> Self {
        self.then(ScalarStep::Curve(Curve::Power(n)))
    }

    /// exp(`rate` · x).
    pub fn exponential(self, rate: Real) -> Self {
        self.then(ScalarStep::Curve(Curve::Exponential(rate)))
    }

    /// exp(−x²/2 `width`²).
    pub fn gaussian(self, width: Real) -> Self {
        self.then(ScalarStep::Curve(Curve::Gaussian(width)))
    }

    /// Straight lines between points (x, y) of growing x, constant beyond.
    pub fn table(self, points: impl IntoIterator<Item = (Real, Real)>) -> Self {
        let points = points.into_iter().collect();
        self.then(ScalarStep::Curve(Curve::Table(points)))
    }

    /// The sum of the two.
    pub fn plus(self, other: Scalar) -> Self {
        self.combine(other, ScalarStep::Plus)
    }

    /// The product of the two.
    pub fn times(self, other: Scalar) -> Self {
        self.combine(other, ScalarStep::Times)
    }

    /// The lesser of the two.
    pub fn min(self, other: Scalar) -> Self {
        self.combine(other, ScalarStep::Lesser)
    }

    /// The greater of the two.
    pub fn max(self, other: Scalar) -> Self {
        self.combine(other, ScalarStep::Greater)
    }

    fn then(mut self, step: ScalarStep) -> Self {
        self.steps.push(step);
        self
    }

    fn combine(mut self, other: Scalar, step: ScalarStep) -> Self {
        self.steps.extend(other.steps);
        self.then(step)
    }

    /// The number at a sample.
    #[inline(always)]
    pub(crate) fn at<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> T {
        let nan = T::from(f64::NAN);
        let mut stack = Stack::<T, 4>::new(nan);
        for step in &self.steps {
            match step {
                ScalarStep::Constant(value) => stack.push(to_f64(*value).into()),
                ScalarStep::Axis(axis) => stack.push(local.coordinate(axis).unwrap_or(nan)),
                ScalarStep::Distance => stack.push(length(local.point)),
                ScalarStep::Depth(region) => stack.push(region.depth(local)),
                ScalarStep::Function(function) => stack.push(to_f64(function.at(local)).into()),
                ScalarStep::Curve(curve) => stack.change(|top| curve.at(top)),
                ScalarStep::Plus => stack.combine(|left, right| left + right),
                ScalarStep::Times => stack.combine(|left, right| left * right),
                ScalarStep::Lesser => stack.combine(T::lesser),
                ScalarStep::Greater => stack.combine(T::greater),
            }
        }
        stack.top()
    }

    /// Returns true if it can be evaluated at several samples at once.
    pub(crate) fn knows_several(&self) -> bool {
        self.steps.iter().all(|step| match step {
            ScalarStep::Axis(axis) => !matches!(axis, Axis::User(_)),
            ScalarStep::Depth(region) => region.knows_several(),
            ScalarStep::Function(_) => false,
            _ => true,
        })
    }

    /// The axes it names.
    pub(crate) fn axes(&self) -> impl Iterator<Item = &Axis> {
        self.steps.iter().flat_map(|step| {
            let axes: Box<dyn Iterator<Item = &Axis>> = match step {
                ScalarStep::Axis(axis) => Box::new(std::iter::once(axis)),
                ScalarStep::Depth(region) => Box::new(region.axes()),
                ScalarStep::Function(function) => Box::new(function.axes().iter()),
                _ => Box::new(std::iter::empty()),
            };
            axes
        })
    }

    /// Returns true if it is the same at all points of a body.
    pub(crate) fn is_uniform(&self) -> bool {
        let of_place = |step: &ScalarStep| match step {
            ScalarStep::Distance | ScalarStep::Depth(_) | ScalarStep::Function(_) => true,
            ScalarStep::Axis(axis) => !matches!(axis, Axis::Time),
            _ => false,
        };
        !self.steps.iter().any(of_place)
    }

    /// Returns true if it may differ between the colliders of a body at one place.
    pub(crate) fn reads_parts(&self) -> bool {
        self.has_code() || self.axes().any(Axis::is_of_part)
    }

    /// Returns true if it depends on a function of the user's.
    pub(crate) fn has_code(&self) -> bool {
        self.steps.iter().any(|step| match step {
            ScalarStep::Function(_) => true,
            ScalarStep::Depth(region) => region.has_code(),
            _ => false,
        })
    }

    pub(crate) fn validate(&self, field: &str) -> Result<(), BuildError> {
        for step in &self.steps {
            match step {
                ScalarStep::Constant(value) => finite(field, "a number of the scale", *value)?,
                ScalarStep::Depth(region) => region.validate(field)?,
                ScalarStep::Function(function) => function.validate(field)?,
                ScalarStep::Curve(curve) => curve.validate(field)?,
                _ => {}
            }
        }
        Ok(())
    }
}

impl From<ScalarStep> for Scalar {
    fn from(step: ScalarStep) -> Self {
        Scalar { steps: vec![step] }
    }
}

impl From<Real> for Scalar {
    fn from(value: Real) -> Self {
        Scalar::constant(value)
    }
}

/// The value and the slope of straight lines between points.
fn between(points: &[(Real, Real)], x: f64) -> (f64, f64) {
    let above = points.partition_point(|(at, _)| to_f64(*at) <= x);
    let number = |k: usize| (to_f64(points[k].0), to_f64(points[k].1));
    if x.is_nan() {
        return (x, x);
    }
    if above == 0 || above == points.len() {
        return (number(above.saturating_sub(1)).1, 0.0);
    }
    let ((x0, y0), (x1, y1)) = (number(above - 1), number(above));
    let slope = (y1 - y0) / (x1 - x0);
    ((x - x0) * slope + y0, slope)
}

impl Curve {
    #[inline(always)]
    pub(crate) fn at<T: Number>(&self, x: T) -> T {
        match self {
            Curve::Ramp { from, to, smooth } => {
                let (from, to) = (to_f64(*from), to_f64(*to));
                let t = (x - from) / (to - from);
                let bent = if *smooth { t * t * (t * -2.0 + 3.0) } else { t };
                let above = T::select(t.re().below(1.0), bent, 1.0.into());
                T::select(t.re().at_most(0.0), 0.0.into(), above)
            }
            Curve::Power(n) => x.powf(to_f64(*n)),
            Curve::Exponential(rate) => (x * to_f64(*rate)).exp(),
            Curve::Gaussian(width) => {
                let t = x / to_f64(*width);
                (t * t * -0.5).exp()
            }
            Curve::Table(points) => {
                let value = x.re().map(|x| between(points, x).0);
                x.follow(value, || x.re().map(|x| between(points, x).1))
            }
        }
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        match self {
            Curve::Ramp { from, to, .. } => {
                let quantity = "the width of a ramp";
                finite(field, "the start of a ramp", *from)?;
                positive(field, quantity, (to - from).abs())
            }
            Curve::Power(n) => finite(field, "the power of a scale", *n),
            Curve::Exponential(rate) => finite(field, "the rate of a scale", *rate),
            Curve::Gaussian(width) => positive(field, "the width of a scale", *width),
            Curve::Table(points) => {
                let quantity = "the number of points of a table";
                require(!points.is_empty(), field, quantity, "one or more", 0.0)?;
                for (x, y) in points.iter() {
                    finite(field, "a place of a table", *x)?;
                    finite(field, "a value of a table", *y)?;
                }
                for pair in points.windows(2) {
                    let step = pair[1].0 - pair[0].0;
                    positive(field, "the step between places of a table", step)?;
                }
                Ok(())
            }
        }
    }
}
