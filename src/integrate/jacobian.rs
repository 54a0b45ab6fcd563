//! Jacobians: the derivatives of the wrench on a body by its motion and its velocities.

use crate::eval::{Lineariser, SampledWorld, Terms};
use crate::field::Frames;
use crate::math::{DVec3, Vector, to_dvec3};
use crate::rapier::glamx::DMat3;
use crate::rapier::na::{Matrix3, Matrix6, Vector6};
use crate::rigid::{cross_matrix, six};

/// The derivatives of the world wrench [force; torque about the centre of mass] of one body.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Jacobian {
    /// The wrench itself.
    pub wrench: Vector6<f64>,
    /// The derivative by [translation of the centre of mass; small rotation about it], in world axes, at constant
    /// velocities.
    pub by_motion: Matrix6<f64>,
    /// The derivative by [linear velocity; angular velocity], in world axes.
    pub by_velocity: Matrix6<f64>,
}

impl Jacobian {
    pub(super) fn is_zero(&self) -> bool {
        let mut entries = self.by_motion.iter().chain(&self.by_velocity);
        entries.all(|entry| *entry == 0.0)
    }
}

/// The Jacobian of the wrench on one body in the world for which the lineariser was prepared, with the bodies that
/// carry fields at rest. If `terms` are those that read velocities, only the derivatives by velocity are computed.
///
/// A sample at arm a moves by dx + dθ × a, and its velocity w × a changes as a turns; the torque a × F also changes by
/// dθ × a × F.
pub(crate) fn of_body(
    lineariser: &mut Lineariser,
    scene: &SampledWorld<'_, impl Frames>,
    terms: Terms,
    body: usize,
    angvel: DVec3,
) -> Jacobian {
    let mut sum = Jacobian::default();
    lineariser.of_body(scene, terms, body, |sample, slope| {
        let (a, b) = (matrix(slope.by_position), matrix(slope.by_velocity));
        sum.wrench += six(slope.force, to_dvec3(sample.arm).cross(slope.force));
        if sample.arm == Vector::ZERO {
            let mut by_place = sum.by_motion.fixed_view_mut::<3, 3>(0, 0);
            by_place += a;
            let mut by_velocity = sum.by_velocity.fixed_view_mut::<3, 3>(0, 0);
            by_velocity += b;
            return;
        }
        let arm = cross_matrix(to_dvec3(sample.arm));
        let turned = -a * arm - b * cross_matrix(angvel) * arm;
        add(&mut sum.by_motion, [a, turned], arm);
        let mut torque = sum.by_motion.fixed_view_mut::<3, 3>(3, 3);
        torque += cross_matrix(slope.force) * arm;
        add(&mut sum.by_velocity, [b, -b * arm], arm);
    });
    sum
}

/// Adds the derivatives of a force, by translation and rotation, and of its torque.
fn add(sum: &mut Matrix6<f64>, force: [Matrix3<f64>; 2], arm: Matrix3<f64>) {
    for (half, derivative) in force.into_iter().enumerate() {
        let mut upper = sum.fixed_view_mut::<3, 3>(0, 3 * half);
        upper += derivative;
        let mut lower = sum.fixed_view_mut::<3, 3>(3, 3 * half);
        lower += arm * derivative;
    }
}

fn matrix(m: DMat3) -> Matrix3<f64> {
    Matrix3::from_columns(&[m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.to_array().into()))
}
