//! Vectors on a regular grid.

use super::{Law, alone};
use crate::field::error::{BuildError, finite_vector, positive, require};
use crate::field::query::{Alone, LocalQuery, Single};
use crate::math::{DVec3, Real, Vector, to_dvec3, to_f64};
use crate::number::{Number, Vec3, constant};

/// Vectors at the nodes of a regular grid, interpolated trilinearly between them. Beyond the grid the
/// vector is that at the nearest point of the grid.
///
/// ```
/// use rapier3d_fields::{field::Grid, prelude::*};
/// // A measured flow, here made up, on 5 × 5 × 5 nodes.
/// let grid = Grid::sampled(Vector::splat(-1.0), Vector::splat(1.0), [5; 3], |p| p.cross(Vector::Y));
/// let field = Field::grid(grid); // within the bounds of the grid
/// # let _ = field;
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Grid {
    /// The corner with the smallest coordinates.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub low: Vector,
    /// The corner with the largest coordinates.
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub high: Vector,
    /// Nodes along x, y and z, at least two each.
    pub counts: [usize; 3],
    /// The vectors, x running fastest and z slowest.
    #[cfg_attr(feature = "schemars", schemars(with = "Vec<[f64; 3]>"))]
    pub values: Vec<Vector>,
}

impl Grid {
    /// The grid of a function.
    pub fn sampled(
        low: Vector,
        high: Vector,
        counts: [usize; 3],
        function: impl Fn(Vector) -> Vector,
    ) -> Self {
        let [nx, ny, nz] = counts;
        let fraction = |k: usize, n: usize| k as Real / n.saturating_sub(1).max(1) as Real;
        let mut values = Vec::new();
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let at = Vector::new(fraction(x, nx), fraction(y, ny), fraction(z, nz));
                    values.push(function(low + (high - low) * at));
                }
            }
        }
        Grid {
            low,
            high,
            counts,
            values,
        }
    }

    fn value(&self, [x, y, z]: [usize; 3]) -> DVec3 {
        to_dvec3(self.values[x + self.counts[0] * (y + self.counts[1] * z)])
    }

    /// Along one axis: the node below the point, and the fraction of a cell beyond it.
    fn place<T: Number<Plain = f64>>(&self, axis: usize, x: T) -> (usize, T) {
        let (low, high) = (to_f64(self.low[axis]), to_f64(self.high[axis]));
        let cells = self.counts[axis] - 1;
        let place = (x - low) * (cells as f64 / (high - low));
        if place.re() <= 0.0 || place.re().is_nan() {
            return (0, 0.0.into());
        }
        if place.re() >= cells as f64 {
            return (cells - 1, 1.0.into());
        }
        let node = place.re() as usize;
        (node, place - node as f64)
    }
}

impl Alone for Grid {
    fn vector_alone<T: Single>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let places = [0, 1, 2].map(|axis| self.place(axis, local.point[axis]));
        let mut sum = Vec3::zero();
        for corner in 0..8 {
            let mut weight = T::from(1.0);
            let mut node = [0; 3];
            for (axis, (below, fraction)) in places.iter().enumerate() {
                let upper = corner >> axis & 1;
                node[axis] = below + upper;
                weight = weight
                    * if upper == 1 {
                        *fraction
                    } else {
                        -*fraction + 1.0
                    };
            }
            sum += constant::<T>(self.value(node)) * weight;
        }
        sum
    }
}

impl Law for Grid {
    fn kind(&self) -> &'static str {
        "grid"
    }

    alone!();

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        let fewest = self.counts.into_iter().min().unwrap_or(0);
        let quantity = "the number of nodes along an axis of the grid";
        require(fewest >= 2, field, quantity, "two or more", fewest as f64)?;
        let nodes = self
            .counts
            .iter()
            .try_fold(1, |n: usize, k| n.checked_mul(*k));
        let given = self.values.len();
        let quantity = "the number of values of the grid";
        let product = "the product of its counts";
        require(nodes == Some(given), field, quantity, product, given as f64)?;
        for edge in (self.high - self.low).to_array() {
            positive(field, "an edge of the grid", edge)?;
        }
        let mut values = self.values.iter();
        values.try_for_each(|value| finite_vector(field, "a value of the grid", *value))
    }
}
