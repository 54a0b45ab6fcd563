//! Forces that read velocities, linear in them, and the kicks that solve for them.

use super::exponential::{mean3, mean6};
use crate::eval::BodySlowing;
use crate::math::DVec3;
use crate::rapier::na::{Matrix3, Matrix6, Vector6};
use crate::rigid::{Body, Mobility, Wrench, join, phi1, rounded, six, velocities};

/// Two evaluations that differ by no more than this share are the same, except for rounding.
const SAME: f64 = 1e-5;

/// A wrench that is linear in the velocities of a body, about those at which it was sampled. Six-vectors are in world
/// axes, the linear half first.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct LinearisedWrench {
    /// The wrench at the velocities `sampled_at`.
    wrench: Vector6<f64>,
    pub slope: Slope,
    pub sampled_at: Vector6<f64>,
}

/// The derivative of a wrench by the velocities of a body.
#[expect(
    clippy::large_enum_variant,
    reason = "a box would be an allocation for each body and step"
)]
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) enum Slope {
    /// The slope of a force at the centre of mass, which does not depend on rotation.
    OfPoint(Matrix3<f64>),
    OfBody(Matrix6<f64>),
}

impl Slope {
    pub(super) fn of_body(slope: &Matrix6<f64>) -> Self {
        let is_zero = |row, column| {
            let block = slope.fixed_view::<3, 3>(row, column);
            block.iter().all(|entry| *entry == 0.0)
        };
        if is_zero(0, 3) && is_zero(3, 0) && is_zero(3, 3) {
            Slope::OfPoint(slope.fixed_view::<3, 3>(0, 0).into_owned())
        } else {
            Slope::OfBody(*slope)
        }
    }

    /// The slope of drag and wind.
    pub(super) fn of_drags(drags: &BodySlowing) -> Self {
        if drags.at_centre {
            return Slope::OfPoint(drags.slope.fixed_view::<3, 3>(0, 0).into_owned());
        }
        Slope::OfBody(drags.slope)
    }

    pub(super) fn plus(&self, other: &Slope) -> Self {
        match (self, other) {
            (Slope::OfPoint(one), Slope::OfPoint(other)) => Slope::OfPoint(one + other),
            _ => Slope::OfBody(self.matrix() + other.matrix()),
        }
    }

    fn entries(&self) -> &[f64] {
        match self {
            Slope::OfPoint(slope) => slope.as_slice(),
            Slope::OfBody(slope) => slope.as_slice(),
        }
    }

    fn size(&self) -> usize {
        match self {
            Slope::OfPoint(_) => 3,
            Slope::OfBody(_) => 6,
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        self.entries().iter().all(|entry| entry.is_finite())
    }

    pub(super) fn is_zero(&self) -> bool {
        self.entries().iter().all(|entry| *entry == 0.0)
    }

    /// An upper bound of the rates at which this slope alone slows or turns the velocities.
    ///
    /// With this slope B and a diagonal D, D² ≥ M⁻¹, the rates are at most the norm of D B D, which is at most the
    /// square root of its greatest row sum times its greatest column sum.
    pub(super) fn fastest(&self, mobility: &Mobility) -> f64 {
        let greatest = |sums: [f64; 6]| sums.into_iter().fold(0.0, f64::max);
        let inv_mass = mobility.inv_mass.max_element();
        let rows = mobility.inv_inertia.row_iter();
        let inv_inertia = rows.map(|row| row.lp_norm(1)).fold(0.0, f64::max);
        let [linear, angular] = [inv_mass.sqrt(), inv_inertia.sqrt()];
        let of_axis = |axis: usize| if axis < 3 { linear } else { angular };
        let (mut rows, mut columns) = ([0.0; 6], [0.0; 6]);
        for (place, entry) in self.entries().iter().enumerate() {
            let (row, column) = (place % self.size(), place / self.size());
            let rate = entry.abs() * of_axis(row) * of_axis(column);
            rows[row] += rate;
            columns[column] += rate;
        }
        (greatest(rows) * greatest(columns)).sqrt()
    }

    /// The change of the wrench for a change of the velocities.
    fn times(&self, change: &Vector6<f64>) -> Vector6<f64> {
        match self {
            Slope::OfPoint(slope) => {
                let mut wrench = Vector6::zeros();
                let mut force = wrench.fixed_rows_mut::<3>(0);
                force += slope * change.fixed_rows::<3>(0);
                wrench
            }
            Slope::OfBody(slope) => slope * change,
        }
    }

    pub(super) fn matrix(&self) -> Matrix6<f64> {
        match self {
            Slope::OfPoint(slope) => {
                let mut matrix = Matrix6::zeros();
                matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(slope);
                matrix
            }
            Slope::OfBody(slope) => *slope,
        }
    }
}

/// The causes besides the coupled force that change the momentum of a body.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ExternalTerms {
    /// Rapier's own force and torque: gravity and the user's force, or the reactions of held bodies.
    pub pull: Vector6<f64>,
    pub damping: [f64; 2],
    pub momentum: Vector6<f64>,
}

impl ExternalTerms {
    pub(super) fn wrench(&self) -> Vector6<f64> {
        let [linear, angular] = self.damping;
        let lost = |from: usize, rate: f64| self.momentum.fixed_rows::<3>(from) * rate;
        self.pull - join(lost(0, linear), lost(3, angular))
    }

    pub(super) fn as_wrench(&self) -> Wrench {
        let (force, torque) = rounded(&self.wrench());
        Wrench { force, torque }
    }

    /// These causes after `wrench` has acted for `duration`.
    pub(super) fn after(&self, wrench: &Vector6<f64>, duration: f64) -> Self {
        ExternalTerms {
            momentum: self.momentum + wrench * duration,
            ..*self
        }
    }
}

impl LinearisedWrench {
    /// Linear about the velocities at which a wrench was `evaluated`. If `wrench` agrees with it, `wrench` is used for
    /// its precision: the speed that remains after a strong drag is the difference of two almost equal numbers.
    pub(super) fn new(
        wrench: &Vector6<f64>,
        slope: Slope,
        evaluated: &Vector6<f64>,
        sampled_at: Vector6<f64>,
    ) -> Self {
        let off = (wrench - evaluated).norm();
        let same = off <= SAME * evaluated.norm();
        LinearisedWrench {
            wrench: if same { *wrench } else { *evaluated },
            slope,
            sampled_at,
        }
    }

    /// A force at the centre of mass of a body, with its derivative by the velocity.
    pub(crate) fn at_centre(force: DVec3, slope: Matrix3<f64>, body: &Body) -> Self {
        LinearisedWrench {
            wrench: six(force, DVec3::ZERO),
            slope: Slope::OfPoint(slope),
            sampled_at: velocities(body),
        }
    }

    /// Returns true if all of it is finite, which may not hold for one that was deserialized.
    pub(super) fn is_finite(&self) -> bool {
        let mut vectors = self.wrench.iter().chain(&self.sampled_at);
        self.slope.is_finite() && vectors.all(|entry| entry.is_finite())
    }

    /// The wrench at these velocities.
    pub(super) fn at(&self, velocities: &Vector6<f64>) -> Vector6<f64> {
        self.wrench + self.slope.times(&(velocities - self.sampled_at))
    }

    /// The mean over a kick of everything that changes the momentum. It is exact where the force is linear in the
    /// velocities: a drag of any strength stops a body without reversing it, and a force that turns the velocity keeps
    /// its length. `here` is the wrench at the velocities at the start.
    pub(super) fn mean(
        &self,
        mobility: &Mobility,
        here: &Vector6<f64>,
        external: &ExternalTerms,
        duration: f64,
    ) -> Option<Vector6<f64>> {
        let [linear, angular] = external.damping;
        let all = here + external.wrench();
        if let Slope::OfPoint(slope) = &self.slope {
            let mut rate = slope * duration;
            for (mut column, inv_mass) in rate.column_iter_mut().zip(mobility.inv_mass.to_array()) {
                column *= inv_mass;
            }
            let rate = rate - Matrix3::identity() * (linear * duration);
            let pushed = mean3(&rate, all.fixed_rows::<3>(0).into_owned())?;
            let turned = all.fixed_rows::<3>(3) * phi1(-angular * duration);
            return Some(join(pushed, turned));
        }
        mean6(&(self.rate(mobility, external.damping) * duration), &all)
    }

    /// (1 − ½ duration A)⁻¹ times a wrench, where A is the rate at which it changes: one round of Newton's method for
    /// the implicit midpoint rule.
    pub(super) fn midway(
        &self,
        mobility: &Mobility,
        wrench: &Vector6<f64>,
        damping: [f64; 2],
        duration: f64,
    ) -> Option<Vector6<f64>> {
        let rate = self.rate(mobility, damping) * (0.5 * duration);
        (Matrix6::identity() - rate).lu().solve(wrench)
    }

    /// The rate matrix with which the wrench changes by its own effect and by damping.
    fn rate(&self, mobility: &Mobility, damping: [f64; 2]) -> Matrix6<f64> {
        let mut rate = self.slope.matrix() * mobility.matrix();
        for axis in 0..6 {
            rate[(axis, axis)] -= damping[axis / 3];
        }
        rate
    }

    /// The largest rate at which a single axis is slowed down, ignoring couplings between axes.
    pub(super) fn slows(&self, mobility: &Mobility) -> f64 {
        let diagonal = (self.slope.matrix() * mobility.matrix()).diagonal();
        -diagonal.min()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::integrate::jacobian::Jacobian;
    use crate::integrate::stiffness::Rates;

    /// The matrix of the first 36 numbers of a list, row by row.
    fn matrix(numbers: &[f64]) -> Matrix6<f64> {
        Matrix6::from_fn(|row, column| numbers[6 * row + column])
    }

    proptest! {
        #[test]
        fn no_rate_is_faster_than_the_bound(
            numbers in prop::collection::vec(-2.0..2.0_f64, 36),
            scales in prop::array::uniform6(1e-3..1e3_f64),
            of_point in any::<bool>(),
        ) {
            let [x, y, z, a, b, c] = scales;
            let half = matrix(&numbers).fixed_view::<3, 3>(3, 3).into_owned();
            let mobility = Mobility {
                inv_mass: DVec3::new(x, y, z),
                inv_inertia: half * Matrix3::from_diagonal(&[a, b, c].into()) * half.transpose(),
            };
            let mut slope = matrix(&numbers);
            if of_point {
                slope = Slope::OfPoint(slope.fixed_view::<3, 3>(0, 0).into_owned()).matrix();
            }
            let by_velocity = slope;
            let rates = Rates::new(&Jacobian { by_velocity, ..Jacobian::default() }, &mobility);
            let bound = Slope::of_body(&slope).fastest(&mobility);
            let fastest = rates.damping.max(rates.turns_by(1.0));
            prop_assert!(fastest <= bound * (1.0 + 1e-9), "{fastest} of {bound}");
        }
    }

    /// The bound is exact where axes do not mix.
    #[test]
    fn the_bound_of_a_drag_is_its_rate() {
        let mobility = Mobility {
            inv_mass: DVec3::splat(0.5),
            inv_inertia: Matrix3::zeros(),
        };
        let slope = Slope::OfPoint(Matrix3::identity() * -3.0);
        assert!((slope.fastest(&mobility) - 1.5).abs() < 1e-12);
    }
}
