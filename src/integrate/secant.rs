//! The stiffness of a field along a path, from the wrenches at its two ends.

use super::StepContext;
use crate::math::{Real, Vector};
use crate::rigid::{Body, Lookup, Wrench};

/// (dt·ω)⁴ from the change of a wrench over the last step.
pub(super) fn fourth_power(
    context: &StepContext<'_, impl Lookup>,
    place: usize,
    is: Wrench,
    was: Wrench,
) -> Real {
    if is == was {
        return 0.0;
    }
    let dt = context.dt;
    if is.torque != was.torque {
        let body = &context.bodies[place];
        return secant(body, is, was, body.linvel, body.angvel, dt).powi(2);
    }
    // The velocity and mass of the sample suffice for a force alone.
    let centre = &context.samples.centres[place];
    let pull = (is.force - was.force).length_squared() * (dt * dt);
    pull / (centre.velocity.length_squared() * (centre.mass * centre.mass))
}

/// (dt·ω)² from the wrenches at the two ends of a path: the change of acceleration divided by the path, which in units
/// of dt² is a velocity.
pub(super) fn secant(
    body: &Body,
    here: Wrench,
    there: Wrench,
    linvel: Vector,
    angvel: Vector,
    dt: Real,
) -> Real {
    let (inv_mass, inv_inertia) = (body.inv_mass, body.inv_inertia);
    let linear = (here.force - there.force) * inv_mass;
    let angular = inv_inertia * (here.torque - there.torque);
    if linear == Vector::ZERO && angular == Vector::ZERO {
        return 0.0;
    }
    // The square of the radius of gyration turns angles into lengths.
    let trace = inv_inertia.m11 + inv_inertia.m22 + inv_inertia.m33;
    let radius = if trace > 0.0 {
        inv_mass.max_element() * 3.0 / trace
    } else {
        0.0
    };
    let sum = |v: Vector, w: Vector| v.length_squared() + radius * w.length_squared();
    dt * (sum(linear, angular) / sum(linvel, angvel)).sqrt()
}
