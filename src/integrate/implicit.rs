//! Kicks that solve for the velocities they end in.

use super::jacobian::Jacobian;
use crate::rapier::na::{Matrix3, Matrix6, Vector6};
use crate::rigid::{Mobility, eigen, join};

/// The change of velocities over `duration`, linearly implicit in place and velocity: see
/// [`Scheme::LinearlyImplicit`](crate::Scheme::LinearlyImplicit).
///
/// In coordinates that have the mass for their metric: with P P = M⁻¹ and Δu = P z,
/// (1 − dt P D P − dt² K) z = dt P W + dt² K P⁻¹ u, where K is the part of P ∂F/∂x P that draws
/// back, and D the part of ∂F/∂v that does not drive. All of K and D is then of one sign, so the
/// matrix cannot be singular.
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
    let damping = negative_part(&by_velocity)? + turning;
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

/// A force that is linear in the velocities, about those it was sampled at.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
pub(crate) struct Coupling {
    pub by_velocity: Matrix6<f64>,
    pub sampled_at: Vector6<f64>,
}

impl Coupling {
    /// The wrench in the middle of a kick from `velocities` over `duration`, by the implicit
    /// midpoint rule. Where the force turns the velocity, the kick keeps its length: it is
    /// Cayley's rotation.
    pub(super) fn midway(
        &self,
        mobility: &Mobility,
        wrench: &Vector6<f64>,
        velocities: &Vector6<f64>,
        duration: f64,
    ) -> Option<Vector6<f64>> {
        let here = wrench + self.by_velocity * (velocities - self.sampled_at);
        let change = self.solve(mobility, &(mobility.apply(&here) * duration), duration)?;
        let midway = here + self.by_velocity * change * 0.5;
        midway.iter().all(|x| x.is_finite()).then_some(midway)
    }

    /// (1 − ½ duration M⁻¹ ∂F/∂v)⁻¹ of a change of velocities.
    pub(super) fn solve(
        &self,
        mobility: &Mobility,
        change: &Vector6<f64>,
        duration: f64,
    ) -> Option<Vector6<f64>> {
        if self.is_of_points() {
            // A force on the centre of mass that depends on how fast that moves.
            let mut linear = self.by_velocity.fixed_view::<3, 3>(0, 0) * (-0.5 * duration);
            for (mut row, inv_mass) in linear.row_iter_mut().zip(mobility.inv_mass.to_array()) {
                row *= inv_mass;
            }
            let solved = (Matrix3::identity() + linear).lu();
            let solved = solved.solve(&change.fixed_rows::<3>(0).into_owned())?;
            return Some(join(solved, change.fixed_rows::<3>(3).into_owned()));
        }
        let coupled = mobility.matrix() * self.by_velocity * (0.5 * duration);
        (Matrix6::identity() - coupled).lu().solve(change)
    }

    /// Whether rotation has no part in it.
    fn is_of_points(&self) -> bool {
        let block = |row, column| self.by_velocity.fixed_view::<3, 3>(row, column);
        [(0, 3), (3, 0), (3, 3)]
            .into_iter()
            .all(|(row, column)| block(row, column).iter().all(|entry| *entry == 0.0))
    }
}
