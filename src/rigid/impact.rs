//! Impacts of bodies within a step.

use crate::math::{Real, RigidBodyHandle, Vector};

/// The last impact of a body that was put on another path within a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MidStepImpact {
    pub body: RigidBodyHandle,
    /// The share of the step before that.
    pub share: Real,
    /// The acceleration and torque by fields that were assumed from then on, if the body is moved within the step.
    pub presumed: Option<[Vector; 2]>,
}
