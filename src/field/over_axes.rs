//! Half-spaces and balls over any axes.

use super::axis::Axis;
use super::boundary::Normal;
use super::error::{BuildError, finite, positive, require, rigid};
use super::query::{LocalQuery, QueryNumber, Single};
use crate::math::{DVec3, Pose, Real, to_dpose3, to_f64};
use crate::number::{Vec3, rotate};

/// A half-space or a ball over several axes, in a frame of its own.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct OverAxes {
    /// The axes.
    pub axes: Vec<Axis>,
    /// The set.
    pub shape: Shape,
    /// Its frame, in that of the field.
    pub pose: Pose,
}

/// A set over several axes. Each list has one number for each axis.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[non_exhaustive]
pub enum Shape {
    /// The sum of coordinates times coefficients is at most the offset.
    HalfSpace {
        /// The coefficient of each axis.
        coefficients: Vec<Real>,
        /// The greatest sum.
        offset: Real,
    },
    /// An ellipsoid.
    Ball {
        /// The coordinate of the centre on each axis.
        centre: Vec<Real>,
        /// The radius along each axis.
        radii: Vec<Real>,
    },
}

impl OverAxes {
    pub(crate) fn half_space(
        coefficients: impl IntoIterator<Item = (Axis, Real)>,
        offset: Real,
    ) -> Self {
        let (axes, coefficients) = coefficients.into_iter().unzip();
        let shape = Shape::HalfSpace {
            coefficients,
            offset,
        };
        OverAxes {
            axes,
            shape,
            pose: Pose::IDENTITY,
        }
    }

    pub(crate) fn ball(ball: impl IntoIterator<Item = (Axis, Real, Real)>) -> Self {
        let (mut axes, mut centre, mut radii) = (Vec::new(), Vec::new(), Vec::new());
        for (axis, middle, radius) in ball {
            axes.push(axis);
            centre.push(middle);
            radii.push(radius);
        }
        OverAxes {
            axes,
            shape: Shape::Ball { centre, radii },
            pose: Pose::IDENTITY,
        }
    }

    #[cfg(feature = "serde-serialize")]
    pub(super) fn has_equal_lengths(&self) -> bool {
        let axes = self.axes.len();
        match &self.shape {
            Shape::HalfSpace { coefficients, .. } => coefficients.len() == axes,
            Shape::Ball { centre, radii } => centre.len() == axes && radii.len() == axes,
        }
    }

    /// The sample point in the frame of the set.
    #[inline(always)]
    fn point<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let pose = to_dpose3(&self.pose);
        rotate(pose.rotation.inverse(), local.point - pose.translation)
    }

    #[inline(always)]
    fn coordinates<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> impl Iterator<Item = T> {
        let point = self.point(local);
        self.axes.iter().map(move |axis| match axis.spatial() {
            Some(k) => point[k],
            None => local.coordinate(axis).unwrap_or(f64::NAN.into()),
        })
    }

    /// Signed distance of the sample from the border, negative inside. For a ball its size is only a lower bound: it is
    /// (ρ − 1) times the smallest radius, with ρ² = Σ ((a − cₐ)/rₐ)².
    #[inline(always)]
    pub(crate) fn excess<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> T {
        let coordinates = self.coordinates(local);
        match &self.shape {
            Shape::HalfSpace {
                coefficients,
                offset,
            } => {
                let mut sum = T::from(-to_f64(*offset));
                let mut steepness = 0.0;
                for (x, c) in coordinates.zip(coefficients) {
                    sum = sum + x * to_f64(*c);
                    steepness += to_f64(*c) * to_f64(*c);
                }
                sum / steepness.sqrt()
            }
            Shape::Ball { centre, radii } => {
                let mut sum = T::from(0.0);
                let mut smallest = f64::INFINITY;
                for ((x, c), r) in coordinates.zip(centre).zip(radii) {
                    let along = (x - to_f64(*c)) / to_f64(*r);
                    sum = sum + along * along;
                    smallest = smallest.min(to_f64(*r));
                }
                (sum.sqrt() - 1.0) * smallest
            }
        }
    }

    /// The direction of the steepest way out, in the space of all axes.
    pub(crate) fn outward<T: Single>(&self, local: &LocalQuery<'_, T>) -> Normal {
        let slopes: Vec<f64> = match &self.shape {
            Shape::HalfSpace { coefficients, .. } => {
                coefficients.iter().map(|c| to_f64(*c)).collect()
            }
            Shape::Ball { centre, radii } => {
                let slope = |((x, c), r): ((T, &Real), &Real)| {
                    (x.re() - to_f64(*c)) / (to_f64(*r) * to_f64(*r))
                };
                let coordinates = self.coordinates(local);
                coordinates.zip(centre).zip(radii).map(slope).collect()
            }
        };
        let mut in_space = DVec3::ZERO;
        let mut normal = local.spatial_normal(DVec3::ZERO);
        for (axis, slope) in self.axes.iter().zip(slopes) {
            match axis.spatial() {
                Some(k) => in_space[k] += slope,
                None => {
                    let along = local.normal_along(axis, slope);
                    normal.iter_mut().zip(along).for_each(|(n, a)| *n += a);
                }
            }
        }
        let in_space = local.spatial_normal(to_dpose3(&self.pose).rotation * in_space);
        normal.iter_mut().zip(in_space).for_each(|(n, a)| *n += a);
        normal
    }

    /// A bound of the distance from the field's origin; `None` if the set is not bounded in space.
    pub(crate) fn extent(&self) -> Option<Real> {
        let Shape::Ball { centre, radii } = &self.shape else {
            return None;
        };
        let along = |space: usize| {
            let place = self.axes.iter().position(|a| a.spatial() == Some(space))?;
            Some(centre[place].abs() + radii[place])
        };
        let corner = crate::math::Vector::new(along(0)?, along(1)?, along(2)?);
        Some(corner.length() + self.pose.translation.length())
    }

    pub(crate) fn validate(&self, field: &str) -> Result<(), BuildError> {
        rigid(field, "the pose of the region", &self.pose)?;
        match &self.shape {
            Shape::HalfSpace {
                coefficients,
                offset,
            } => {
                finite(field, "the offset of the half-space", *offset)?;
                let size = coefficients.iter().map(|c| c.abs()).sum();
                let quantity = "the sum of the half-space's coefficients, taken absolute,";
                positive(field, quantity, size)
            }
            Shape::Ball { centre, radii } => {
                let quantity = "the number of axes of the ball";
                require(!radii.is_empty(), field, quantity, "one or more", 0.0)?;
                for (middle, radius) in centre.iter().zip(radii) {
                    finite(field, "the centre of the region", *middle)?;
                    positive(field, "the radius of the region", *radius)?;
                }
                Ok(())
            }
        }
    }
}
