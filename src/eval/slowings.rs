//! How drag and wind slow bodies, in closed form, added up over samples while their forces are.

use crate::math::DVec3;
use crate::rapier::na::{Matrix3, Matrix6, Vector3, Vector6};
use crate::rigid::{Slowing, cross_matrix, six};

/// The drags and winds on some bodies, and how they fall with the velocities.
#[derive(Debug, Default)]
pub(crate) struct BodySlowings {
    bodies: Vec<Sum>,
    /// What of −∂wrench/∂velocities is along the axes of single samples, of the bodies that have any.
    along: Vec<Matrix6<f64>>,
}

/// Over the samples of a body, at the arms a from its centre of mass.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    force: DVec3,
    torque: DVec3,
    /// Σ λ, where λ is what a sample is slowed by in all directions.
    across: f64,
    /// Σ λ a
    first: DVec3,
    /// Σ λ a aᵀ
    second: Matrix3<f64>,
    /// The place of the rest among those of all bodies.
    along: Option<u32>,
    /// Whether any sample is beside the centre of mass.
    has_arms: bool,
}

/// The drags and winds on a body together.
pub(crate) struct BodySlowing {
    pub wrench: Vector6<f64>,
    /// Its derivative by the linear and the angular velocity.
    pub slope: Matrix6<f64>,
    /// Whether all of it acts at the centre of mass.
    pub at_centre: bool,
}

impl BodySlowings {
    /// Of so many bodies, on which nothing acts yet.
    pub(crate) fn start(&mut self, bodies: usize) {
        self.along.clear();
        self.bodies.clear();
        self.bodies.resize(bodies, Sum::default());
    }

    /// Adds a force on a sample of a body, at `arm` from its centre of mass.
    pub(super) fn add(&mut self, body: u32, arm: DVec3, force: DVec3, slowing: &Slowing) {
        let sum = &mut self.bodies[body as usize];
        sum.force += force;
        sum.torque += arm.cross(force);
        sum.across += slowing.across;
        if arm != DVec3::ZERO {
            let arm = Vector3::from(arm.to_array());
            sum.has_arms = true;
            sum.first += DVec3::from_array(arm.into()) * slowing.across;
            sum.second += arm * arm.transpose() * slowing.across;
        }
        if slowing.along == 0.0 {
            return;
        }
        let along = *sum.along.get_or_insert_with(|| {
            self.along.push(Matrix6::zeros());
            self.along.len() as u32 - 1
        });
        let axis = six(slowing.axis, arm.cross(slowing.axis));
        self.along[along as usize] += axis * axis.transpose() * slowing.along;
    }

    /// Whether any bodies were evaluated.
    pub(crate) fn of_any(&self) -> bool {
        !self.bodies.is_empty()
    }

    /// What acts on a body; `None` before anything was evaluated.
    pub(crate) fn on(&self, body: usize) -> Option<BodySlowing> {
        let sum = self.bodies.get(body)?;
        let mut slope = Matrix6::zeros();
        let across = Matrix3::from_diagonal_element(sum.across);
        let turned = cross_matrix(sum.first);
        let around = Matrix3::from_diagonal_element(sum.second.trace()) - sum.second;
        slope.fixed_view_mut::<3, 3>(0, 0).copy_from(&-across);
        slope.fixed_view_mut::<3, 3>(0, 3).copy_from(&turned);
        slope.fixed_view_mut::<3, 3>(3, 0).copy_from(&-turned);
        slope.fixed_view_mut::<3, 3>(3, 3).copy_from(&-around);
        if let Some(along) = sum.along {
            slope -= self.along[along as usize];
        }
        Some(BodySlowing {
            wrench: six(sum.force, sum.torque),
            slope,
            at_centre: !sum.has_arms,
        })
    }
}
