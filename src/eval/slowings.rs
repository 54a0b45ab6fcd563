//! Derivatives by velocity of drag and wind on bodies, computed from the forces and added up with them.

use crate::compile::Program;
use crate::field::ForceMode;
use crate::math::{DVec3, Real, to_f64};
use crate::number::{Plain, Vec3, constant, real};
use crate::rapier::na::{Matrix3, Matrix6, Vector3, Vector6};
use crate::rigid::{Slowing, cross_matrix, six};
use crate::sample::{Moment, SamplePoint};

/// An instance of a program that [is one drag or wind](Program::as_drag), in a step.
#[derive(Clone, Copy)]
pub(super) struct DragOn {
    rates: [f64; 2],
    strength: f64,
    /// The share of the step in which it acts.
    share: f64,
    mode: ForceMode,
    dt: f64,
}

impl DragOn {
    pub(super) fn new(program: &Program, instance: usize, moment: Moment) -> Option<Self> {
        let drag = program.as_drag()?;
        let field = &program.leaves[0];
        Some(DragOn {
            rates: [drag.linear, drag.quadratic].map(to_f64),
            strength: to_f64(program.strength(instance, 0)),
            share: field.lifetime.share_of(moment.span),
            mode: field.mode,
            dt: to_f64(moment.dt),
        })
    }

    /// The derivative by velocity of its `force` on a part with this mass and this share of the mass of its body.
    #[inline(always)]
    pub(super) fn slowing<T: Plain>(&self, mass: T, share: T, force: Vec3<T>) -> Slowing<T> {
        let weight = match self.mode {
            ForceMode::Force => share,
            ForceMode::Acceleration => mass,
            ForceMode::VelocityChange => mass / self.dt,
        };
        Slowing::of_drag(force, weight * (self.strength * self.share), self.rates)
    }

    /// [`Self::slowing`] of a fraction of a part.
    pub(super) fn of_part(&self, part: &SamplePoint, fraction: Real, force: DVec3) -> Slowing {
        let [mass, share] = [part.mass, part.share].map(|it| to_f64(it) * to_f64(fraction));
        self.slowing(mass, share, constant(force))
    }
}

/// The drag and wind on each of some bodies, with its derivative by the body's velocities.
#[derive(Debug, Default)]
pub(crate) struct BodySlowings {
    bodies: Vec<SlowingSum>,
    /// Parts of −∂wrench/∂velocities along the axes of single samples, for bodies that have any.
    along: Vec<Matrix6<f64>>,
}

/// Sums over the samples of a body, at arms a from its centre of mass.
#[derive(Clone, Copy, Debug, Default)]
struct SlowingSum {
    force: DVec3,
    torque: DVec3,
    /// Σ λ, where λ is the isotropic part of a sample's derivative.
    across: f64,
    /// Σ λ a
    first: DVec3,
    /// Σ λ a aᵀ
    second: Matrix3<f64>,
    /// The number of the body's matrix in [`BodySlowings::along`], if it has one.
    along: Option<u32>,
    /// True if any sample is not at the centre of mass.
    has_arms: bool,
}

/// The drag and wind on a body: wrench and derivative.
pub(crate) struct BodySlowing {
    pub wrench: Vector6<f64>,
    /// The derivative of the wrench by the linear and the angular velocity.
    pub slope: Matrix6<f64>,
    /// True if all of it acts at the centre of mass.
    pub at_centre: bool,
}

impl BodySlowings {
    /// Sets the number of bodies, and all sums to zero.
    pub(crate) fn start(&mut self, bodies: usize) {
        self.along.clear();
        self.bodies.clear();
        self.bodies.resize(bodies, SlowingSum::default());
    }

    /// Adds a force on a sample of a body, at `arm` from its centre of mass, with its derivative by velocity.
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
        let axis = real(slowing.axis);
        let axis = six(axis, arm.cross(axis));
        self.along[along as usize] += axis * axis.transpose() * slowing.along;
    }

    /// Returns true if there are any bodies.
    pub(crate) fn of_any(&self) -> bool {
        !self.bodies.is_empty()
    }

    /// The drag and wind on a body; `None` if there is no such body.
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
