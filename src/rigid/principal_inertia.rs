//! The principal moments and axes of a body, as Rapier stores them.

use crate::math::{Rotation, Vector};
use crate::rapier::dynamics::MassProperties;

/// The principal moments and axes of a body. Rapier recomputes them in the step after a change of its mass or shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PrincipalInertia {
    /// The inverses of the moments. Rapier writes those of both zero and infinity as zero.
    pub inverse: Vector,
    /// Takes principal axes to body axes.
    pub frame: Rotation,
}

impl PrincipalInertia {
    #[inline]
    pub(crate) fn of(mass_properties: &MassProperties) -> Self {
        PrincipalInertia {
            inverse: mass_properties.inv_principal_inertia,
            frame: mass_properties.principal_inertia_local_frame,
        }
    }
}
