//! Kicks that solve for the velocities they end in.

use super::exponential::{mean3, mean6, phi1};
use super::jacobian::Jacobian;
use crate::rapier::na::{Matrix3, Matrix6, Vector6};
use crate::rigid::{Mobility, Wrench, eigen, join, rounded};

/// The change of velocities over `duration`, linearly implicit in place and velocity: see
/// [`Scheme::LinearlyImplicit`](crate::Scheme::LinearlyImplicit).
///
/// In coordinates that have the mass for their metric: with P P = M⁻¹ and Δu = P z,
/// (1 − dt D − ½ dt S − dt² K) z = dt P W + dt² K P⁻¹ u, where K is the part of P ∂F/∂x P that draws
/// back, D the part of P ∂F/∂v P that slows, and S the one that turns: that is taken at the middle of
/// the kick, which keeps lengths. All of K and D is of one sign, so the matrix cannot be singular.
pub(super) fn implicit_change(
    mobility: &Mobility,
    jacobian: &Jacobian,
    wrench: &Vector6<f64>,
    velocities: &Vector6<f64>,
    duration: f64,
) -> Option<Vector6<f64>> {
    let (root, inverse_root) = mobility.roots();
    let restoring = negative_part(&(root * jacobian.by_motion * root))?;
    let by_velocity = root * jacobian.by_velocity * root;
    let turning = (by_velocity - by_velocity.transpose()) * 0.5;
    let damping = negative_part(&by_velocity)? + turning * 0.5;
    let matrix = Matrix6::identity() - damping * duration - restoring * (duration * duration);
    let drawn = restoring * (inverse_root * velocities) * (duration * duration);
    let right = root * wrench * duration + drawn;
    let solution = matrix.lu().solve(&right)?;
    Some(root * solution).filter(|change| change.iter().all(|x| x.is_finite()))
}

/// The part of the symmetric part with eigenvalues below zero; `None` if it is not finite.
fn negative_part(matrix: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let eigen = eigen((matrix + matrix.transpose()) * 0.5)?;
    let negative = Matrix6::from_diagonal(&eigen.eigenvalues.map(|value| value.min(0.0)));
    Some(eigen.eigenvectors * negative * eigen.eigenvectors.transpose())
}

/// Two evaluations that differ by no more than this part are the same, but for rounding.
const SAME: f64 = 1e-5;

/// A force that is linear in the velocities, about those it was sampled at.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) struct Coupling {
    /// There.
    wrench: Vector6<f64>,
    pub by_velocity: Matrix6<f64>,
    pub sampled_at: Vector6<f64>,
}

/// What changes a momentum beside the force that is coupled to it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Besides {
    /// Rapier's own pull.
    pub pull: Vector6<f64>,
    pub damping: [f64; 2],
    pub momentum: Vector6<f64>,
}

impl Besides {
    pub(super) fn wrench(&self) -> Vector6<f64> {
        let [linear, angular] = self.damping;
        let lost = |from: usize, rate: f64| self.momentum.fixed_rows::<3>(from) * rate;
        self.pull - join(lost(0, linear), lost(3, angular))
    }

    pub(super) fn as_wrench(&self) -> Wrench {
        let (force, torque) = rounded(&self.wrench());
        Wrench { force, torque }
    }

    /// After a wrench has acted for some time.
    pub(super) fn after(&self, wrench: &Vector6<f64>, duration: f64) -> Self {
        Besides {
            momentum: self.momentum + wrench * duration,
            ..*self
        }
    }
}

impl Coupling {
    /// About the velocities at which a wrench was `evaluated`. Its force in full precision is taken
    /// if it is the same: what is left of a speed after a strong drag is the difference of two
    /// almost equal numbers.
    pub(super) fn new(
        jacobian: &Jacobian,
        evaluated: &Vector6<f64>,
        sampled_at: Vector6<f64>,
    ) -> Self {
        let off = (jacobian.wrench - evaluated).norm();
        let same = off <= SAME * evaluated.norm();
        Coupling {
            wrench: if same { jacobian.wrench } else { *evaluated },
            by_velocity: jacobian.by_velocity,
            sampled_at,
        }
    }

    /// The force at these velocities.
    pub(super) fn at(&self, velocities: &Vector6<f64>) -> Vector6<f64> {
        self.wrench + self.by_velocity * (velocities - self.sampled_at)
    }

    /// The mean over a kick of all that changes the momentum, exactly where the force is linear in
    /// the velocities: drag of any strength stops a body and never turns it back, and a force that
    /// turns the velocity keeps its length. `here`: the force at the velocities at its start.
    pub(super) fn mean(
        &self,
        mobility: &Mobility,
        here: &Vector6<f64>,
        besides: &Besides,
        duration: f64,
    ) -> Option<Vector6<f64>> {
        let [linear, angular] = besides.damping;
        let all = here + besides.wrench();
        if self.is_of_points() {
            let mut rate = self.by_velocity.fixed_view::<3, 3>(0, 0) * duration;
            for (mut column, inv_mass) in rate.column_iter_mut().zip(mobility.inv_mass.to_array()) {
                column *= inv_mass;
            }
            let rate = rate - Matrix3::identity() * (linear * duration);
            let pushed = mean3(&rate, all.fixed_rows::<3>(0).into_owned())?;
            let turned = all.fixed_rows::<3>(3) * phi1(-angular * duration);
            return Some(join(pushed, turned));
        }
        mean6(&(self.rate(mobility, besides.damping) * duration), &all)
    }

    /// (1 − ½ duration A)⁻¹ of a wrench, for the rate A at which it changes: a round of Newton's
    /// method for the implicit midpoint rule.
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

    /// How a force changes by itself, as a rate.
    fn rate(&self, mobility: &Mobility, damping: [f64; 2]) -> Matrix6<f64> {
        let mut rate = self.by_velocity * mobility.matrix();
        for axis in 0..6 {
            rate[(axis, axis)] -= damping[axis / 3];
        }
        rate
    }

    /// A bound of the rate at which anything is slowed down, if nothing is coupled between axes.
    pub(super) fn slows(&self, mobility: &Mobility) -> f64 {
        let diagonal = (self.by_velocity * mobility.matrix()).diagonal();
        -diagonal.min()
    }

    /// Whether rotation has no part in it.
    fn is_of_points(&self) -> bool {
        let block = |row, column| self.by_velocity.fixed_view::<3, 3>(row, column);
        [(0, 3), (3, 0), (3, 3)]
            .into_iter()
            .all(|(row, column)| block(row, column).iter().all(|entry| *entry == 0.0))
    }
}
