//! How the wrench on a body changes as it moves.

use super::mobility::cross_matrix;
use crate::eval::{Moment, Probe, Probes};
use crate::field::{Frames, Query};
use crate::math::{DVec3, to_dvec3};
use crate::rapier::glamx::DMat3;
use crate::rapier::na::{Matrix3, Matrix6};
use crate::reference::Reference;

/// The derivatives of the world wrench [force; torque about the centre of mass] of one body.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Jacobian {
    /// By [translation of the centre of mass; small rotation about it], world axes, at constant
    /// velocities.
    pub by_motion: Matrix6<f64>,
    /// By [linear velocity; angular velocity], world axes.
    pub by_velocity: Matrix6<f64>,
}

/// The probes of one body: its parts, or itself as a whole where parts are not sampled.
pub(super) fn probes_of(probes: &Probes, body: usize) -> &[Probe] {
    if probes.list.is_empty() {
        return &probes.centres[body..=body];
    }
    let number = body as u32;
    let start = probes.list.partition_point(|probe| probe.body < number);
    let end = probes.list.partition_point(|probe| probe.body <= number);
    &probes.list[start..end]
}

/// The Jacobian of the wrench on one body, the bodies of the fields standing still.
///
/// A probe at arm a moves by dx + dθ × a, and its velocity w × a changes as a turns; the torque
/// a × F changes by dθ × a × F besides.
pub(crate) fn of_body(
    reference: &Reference<'_>,
    frames: &impl Frames,
    probes: &Probes,
    body: usize,
    moment: Moment,
    angvel: DVec3,
) -> Jacobian {
    let mut sum = Jacobian::default();
    for probe in probes_of(probes, body) {
        let query = probes.query(probe, moment);
        let (by_position, by_velocity) = probe_jacobian(reference, frames, &query);
        let force = reference.force(frames, &query).unwrap_or(DVec3::ZERO);
        let arm = cross_matrix(to_dvec3(probe.arm));
        let (a, b) = (matrix(by_position), matrix(by_velocity));
        let turned = -a * arm - b * cross_matrix(angvel) * arm;
        add(&mut sum.by_motion, [a, turned], arm);
        let own = cross_matrix(force) * arm;
        let mut torque = sum.by_motion.fixed_view_mut::<3, 3>(3, 3);
        torque += own;
        add(&mut sum.by_velocity, [b, -b * arm], arm);
    }
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

/// ∂F/∂x and ∂F/∂v of the force on one probe, world axes.
fn probe_jacobian(
    reference: &Reference<'_>,
    frames: &impl Frames,
    query: &Query,
) -> (DMat3, DMat3) {
    let position_step = RELATIVE_STEP * query.world_point.length().max(query.radius).max(1.0);
    let velocity_step = RELATIVE_STEP * query.world_velocity.length().max(1.0);
    let force = |query: Query| reference.force(frames, &query);
    let by_position = differences(position_step, |offset| {
        force(Query {
            world_point: query.world_point + offset,
            ..query.clone()
        })
    });
    let by_velocity = differences(velocity_step, |offset| {
        force(Query {
            world_velocity: query.world_velocity + offset,
            ..query.clone()
        })
    });
    (by_position, by_velocity)
}

/// Where rounding and truncation of a central difference in `f64` are of one size.
const RELATIVE_STEP: f64 = 6e-6;

/// Central differences; one-sided next to where the field is not defined, which is an edge and
/// no slope.
fn differences(step: f64, force: impl Fn(DVec3) -> Option<DVec3>) -> DMat3 {
    let middle = force(DVec3::ZERO);
    let column = |axis: DVec3| {
        let (ahead, behind) = (force(axis * step), force(axis * -step));
        match (ahead, middle, behind) {
            (Some(ahead), _, Some(behind)) => (ahead - behind) / (2.0 * step),
            (Some(ahead), Some(middle), None) => (ahead - middle) / step,
            (None, Some(middle), Some(behind)) => (middle - behind) / step,
            _ => DVec3::ZERO,
        }
    };
    let [x, y, z] = DVec3::AXES.map(column);
    DMat3::from_cols(x, y, z)
}
