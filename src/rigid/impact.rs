//! Impacts of bodies within a step.

use crate::math::{Real, RigidBodyHandle, Vector};

/// The last impact of a body whose path was changed by impacts within a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MidStepImpact {
    pub body: RigidBodyHandle,
    /// The fraction of the step before the impact.
    pub share: Real,
    /// The acceleration and torque by fields that were assumed after the impact, if the body is moved within the step.
    pub presumed: Option<[Vector; 2]>,
}
