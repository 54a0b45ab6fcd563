//! An estimate of the error of steps: the same time is simulated again in steps of half the length.

use super::Fields;
use crate::bridge::StepError;
use crate::integrate::{Scheme, Substeps};
use crate::math::{Real, RigidBodyHandle, RigidBodySet, Rotation, Vector};
use crate::rapier::pipeline::PhysicsWorld;

/// The error of a body after some steps, estimated by [`Fields::estimate_error`], in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// The body.
    pub body: RigidBodyHandle,
    /// Error of the position of its centre of mass, in lengths.
    pub position: Real,
    /// Error of its attitude, in radians.
    pub rotation: Real,
    /// Error of the velocity of its centre of mass, in lengths per time.
    pub velocity: Real,
    /// Error of its angular velocity, in radians per time.
    pub angular_velocity: Real,
}

impl Fields {
    /// The estimated error of each dynamic body after the next `steps` steps of the world's `dt`, in the order of the
    /// bodies' handles. The world stays as it is.
    ///
    /// A copy of the world makes the steps, and another makes twice as many of `dt / 2`. By Richardson's extrapolation
    /// the error of the first is their difference times 1/(1 − 2⁻ᵖ) for a scheme of order p. That order is 2 for
    /// `KickDriftKick` and for `Substep` with a fixed number, 4 for `Forward4`, and taken as 1 for all others. So the
    /// estimate is too large by half where `Auto`, or `Substep` with a number for each body, finds nothing stiff. Where
    /// it finds only the longer steps stiff, these may be the more exact ones: the estimate is then the error of the
    /// other copy. It costs three times the steps, and two copies.
    ///
    /// The estimate holds where errors fall with the step by this order. For steps that are too long for the fields it
    /// is wrong: large where motions explode, and too small where the scheme damps them in both copies. A contact
    /// within the steps is of first order. Rounding does not fall with the step and is not included. For a path that is
    /// chaotic over the steps, the estimate is how far it may stray. Your own hooks are not called on the copies, and
    /// no events are sent.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// world.gravity = Vector::ZERO;
    /// let ball = RigidBodyBuilder::dynamic().translation(Vector::X);
    /// world.insert(ball, ColliderBuilder::ball(0.5).mass(1.0));
    /// let fields = Fields::new(Field::spring(36.0))?;
    /// let error = fields.estimate_error(&world, 60)?[0];
    /// // A spring is off in phase by (ω dt)²/24 of its angle, 6 rad in a second.
    /// assert!(error.position < 3e-3 && error.velocity < 2e-2, "{error:?}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of a step of a copy; see [`StepError`].
    pub fn estimate_error(
        &self,
        world: &PhysicsWorld,
        steps: usize,
    ) -> Result<Vec<ErrorEstimate>, StepError> {
        let dt = world.integration_parameters.dt;
        let coarse = self.bodies_after(world, steps, dt)?;
        let fine = self.bodies_after(world, 2 * steps, 0.5 * dt)?;
        let factor = 1.0 / (1.0 - (0.5 as Real).powi(order(&self.settings.scheme)));
        let movers = world.bodies.iter().filter(|(_, body)| body.is_dynamic());
        let mut handles: Vec<RigidBodyHandle> = movers.map(|it| it.0).collect();
        handles.sort_unstable_by_key(|handle| handle.into_raw_parts());
        let of = |body: RigidBodyHandle| {
            let (a, b) = (coarse.get(body)?, fine.get(body)?);
            let apart = |a: Vector, b: Vector| factor * a.distance(b);
            Some(ErrorEstimate {
                body,
                position: apart(a.center_of_mass(), b.center_of_mass()),
                rotation: factor * angle(a.rotation(), b.rotation()),
                velocity: apart(a.linvel(), b.linvel()),
                angular_velocity: apart(a.angvel(), b.angvel()),
            })
        };
        Ok(handles.into_iter().filter_map(of).collect())
    }

    /// The bodies of a copy of the world after some steps of `dt`.
    fn bodies_after(
        &self,
        world: &PhysicsWorld,
        steps: usize,
        dt: Real,
    ) -> Result<RigidBodySet, StepError> {
        let mut copy = self.predict(world);
        // The audit does not change the motion of bodies, and the cross-check only by roundings.
        copy.fields.settings.cross_check.on = false;
        copy.fields.settings.audit = false;
        copy.world.integration_parameters.dt = dt;
        for _ in 0..steps {
            copy.step()?;
        }
        Ok(copy.world.bodies)
    }
}

/// The lowest order of a scheme: the error falls with this power of the step.
fn order(scheme: &Scheme) -> i32 {
    match scheme {
        Scheme::KickDriftKick | Scheme::Substep(Substeps::Fixed(_)) => 2,
        Scheme::Forward4 => 4,
        _ => 1,
    }
}

/// The angle between two attitudes, from the sine of its half: the cosine would lose half of the digits.
fn angle(a: &Rotation, b: &Rotation) -> Real {
    let between = *a * b.inverse();
    2.0 * between.xyz().length().min(1.0).asin()
}
