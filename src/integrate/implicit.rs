//! Linearly implicit kicks, which solve for the velocities at the end of the kick.

use super::jacobian::Jacobian;
use crate::rapier::na::{Matrix6, Vector6};
use crate::rigid::{Mobility, eigen};

/// The change of velocities over `duration`, linearly implicit in position and velocity: see
/// [`Scheme::LinearlyImplicit`](crate::Scheme::LinearlyImplicit).
///
/// In mass-weighted coordinates, with P P = M⁻¹ and Δu = P z: (1 − dt D − ½ dt S − dt² K) z = dt P W + dt² K P⁻¹ u.
/// Here K is the restoring part of P ∂F/∂x P, D the damping part of P ∂F/∂v P, and S its antisymmetric part, which
/// turns velocities and is taken at the middle of the kick, so that lengths are kept. K and D have no positive
/// eigenvalues, so the matrix cannot be singular.
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

/// The symmetric part of a matrix with its positive eigenvalues set to zero; `None` if it is not finite.
fn negative_part(matrix: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let eigen = eigen((matrix + matrix.transpose()) * 0.5)?;
    let negative = Matrix6::from_diagonal(&eigen.eigenvalues.map(|value| value.min(0.0)));
    Some(eigen.eigenvectors * negative * eigen.eigenvectors.transpose())
}
