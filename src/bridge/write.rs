//! Writes to Rapier's bodies and colliders, before and after its step.

use super::constrained::Constraints;
use super::world::WorldMut;
use crate::integrate::{Arrived, Load, Motions, Retried, StepWarning, TurnAfter, VelocityUpdate};
use crate::math::{
    ColliderHandle, ColliderSet, DVec3, Pose, Real, RigidBodyHandle, RigidBodySet, Vector,
    from_dvec3, to_dquat,
};
use crate::rapier::dynamics::RigidBody;
use crate::rapier::pipeline::ActiveHooks;
use crate::rigid::{Body, Inertia, MidStepImpact, PrincipalInertia};

/// The user's force and torque on a body, while those of fields are added to them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ForceOverride {
    body: RigidBodyHandle,
    force: Vector,
    torque: Vector,
    /// The mass for which the forces of fields were computed.
    mass: Real,
}

/// Writes new velocities; returns the number of updates.
pub(crate) fn write(bodies: &mut RigidBodySet, updates: &[VelocityUpdate]) -> usize {
    for update in updates {
        let Some(body) = bodies.get_mut(update.body) else {
            continue;
        };
        update.write(body);
    }
    updates.len()
}

impl VelocityUpdate {
    /// Writes the velocities, and wakes the body or turns off Rapier's gyroscopic forces if the update says so.
    pub(super) fn write(&self, body: &mut RigidBody) {
        if self.wake {
            body.wake_up(true);
        }
        body.set_linvel(self.linvel, false);
        body.set_angvel(self.angvel, false);
        if self.spins && body.gyroscopic_forces_enabled() {
            body.enable_gyroscopic_forces(false);
        }
    }
}

/// Writes recomputed poses and velocities, and moves the colliders along; returns the number of bodies.
pub(crate) fn place(
    bodies: &mut RigidBodySet,
    colliders: &mut ColliderSet,
    retried: &[Retried],
) -> usize {
    for now in retried {
        let Some(body) = bodies.get_mut(now.body) else {
            continue;
        };
        body.set_position(now.pose, false);
        body.set_linvel(now.linvel, false);
        body.set_angvel(now.angvel, false);
    }
    if !retried.is_empty() {
        bodies.propagate_modified_body_positions_to_colliders(colliders);
    }
    retried.len()
}

/// Adds wrenches to the users' forces, which are recorded in `overrides`.
pub(crate) fn apply(bodies: &mut RigidBodySet, loads: &[Load], overrides: &mut Vec<ForceOverride>) {
    for load in loads {
        let Some(body) = bodies.get_mut(load.body) else {
            continue;
        };
        overrides.push(ForceOverride {
            body: load.body,
            force: body.user_force(),
            torque: body.user_torque(),
            mass: body.mass(),
        });
        body.add_force(load.wrench.force, load.wake);
        body.add_torque(load.wrench.torque, load.wake);
    }
}

/// Restores the users' forces bit for bit, by a reset, because (u + f) − f is not u in general. Returns the number of
/// bodies, and warns of those whose mass Rapier's step has changed.
pub(crate) fn restore(
    bodies: &mut RigidBodySet,
    overrides: &[ForceOverride],
    mut warn: impl FnMut(StepWarning),
) -> usize {
    for own in overrides {
        if let Some(body) = bodies.get_mut(own.body) {
            body.reset_forces(false);
            body.reset_torques(false);
            body.add_force(own.force, false);
            body.add_torque(own.torque, false);
            let (before, after) = (own.mass, body.mass());
            if after != before {
                let body = own.body;
                warn(StepWarning::MassChanged {
                    body,
                    before,
                    after,
                });
            }
        }
    }
    overrides.len()
}

/// Turns the velocities that Rapier was given into those at the end of the step, and keeps the changes that contacts,
/// joints and users made in the meantime.
///
/// If Rapier changed the velocity of a body that was moved within the step, its velocities stay those of the middle of
/// the step.
pub(crate) fn finish(world: &mut WorldMut<'_>, motions: &mut Motions) {
    let dt = world.integration_parameters.dt;
    let bodies = &world.bodies;
    motions.note_bounces(|handle| {
        let body = bodies.get(handle).filter(|body| !is_at_rest(body))?;
        Some(Arrived {
            linvel: body.linvel(),
            angvel: body.angvel(),
            kept: [body.linear_damping(), body.angular_damping()].map(|rate| damped(rate, dt)),
            is_twisted: body.user_torque() != Vector::ZERO,
        })
    });
    for turn in &motions.turns {
        let Some(body) = world.bodies.get_mut(turn.body) else {
            continue;
        };
        if turn.gyroscopic {
            body.enable_gyroscopic_forces(true);
        }
        // A body whose inertia has changed since keeps its angular velocity, as under Rapier alone.
        if is_at_rest(body)
            || turn.inertia != PrincipalInertia::of(&body.mass_properties().local_mprops)
        {
            continue;
        }
        let bounced = motions.has_bounced(turn.body);
        let angvel = match turn.after {
            TurnAfter::Momentum(momentum) => Inertia::of(body).map(|inertia| {
                let later = if bounced {
                    turn.twist * 0.5
                } else {
                    DVec3::ZERO
                };
                inertia.angvel_after(to_dquat(*body.rotation()), momentum - later)
            }),
            TurnAfter::Velocity(angvel) => (!bounced).then_some(angvel),
        };
        if let Some(angvel) = angvel {
            let kept = damped(body.angular_damping(), dt);
            let pushed = body.angvel() - turn.steady * kept;
            let left = if turn.damped && !bounced { 1.0 } else { kept };
            body.set_angvel(from_dvec3(angvel) * left + pushed, false);
        }
    }
    for mean in &motions.means {
        if motions.has_bounced(mean.body) {
            continue;
        }
        // A body that is no longer held gets its velocity at its position, without the lag.
        let flies = mean.behind != Vector::ZERO && !is_held(world, mean.body);
        let behind = if flies { mean.behind } else { Vector::ZERO };
        let Some(body) = world
            .bodies
            .get_mut(mean.body)
            .filter(|body| !is_at_rest(body))
        else {
            continue;
        };
        let kept = damped(body.linear_damping(), dt);
        let pushed = body.linvel() - mean.expected * kept;
        let left = if mean.damped { 1.0 } else { kept };
        body.set_linvel(mean.linvel * left + pushed + behind, false);
    }
}

fn is_held(world: &WorldMut<'_>, handle: RigidBodyHandle) -> bool {
    let body = world.bodies.get(handle);
    body.is_some_and(|body| Constraints::new(world).hold(handle, body))
}

/// Stops and disables bodies, as Rapier does with bodies that are not finite.
pub(crate) fn quarantine(bodies: &mut RigidBodySet, handles: &[RigidBodyHandle]) {
    each(bodies, handles, |body| {
        body.set_linvel(Vector::ZERO, false);
        body.set_angvel(Vector::ZERO, false);
        body.reset_forces(false);
        body.reset_torques(false);
        body.set_enabled(false);
    });
}

/// Writes to those of some bodies that are still there.
fn each(bodies: &mut RigidBodySet, handles: &[RigidBodyHandle], write: impl Fn(&mut RigidBody)) {
    for handle in handles {
        if let Some(body) = bodies.get_mut(*handle) {
            write(body);
        }
    }
}

/// Recomputes the mass of a body as Rapier will in its next step, and reads the body again.
pub(crate) fn weigh(world: &mut WorldMut<'_>, handle: RigidBodyHandle) -> Option<Body> {
    let body = world.bodies.get_mut(handle)?;
    body.recompute_mass_properties_from_colliders(world.colliders);
    Some(Body::of(handle, body))
}

/// Sets the hook bits of a collider; returns false if it is gone.
pub(crate) fn set_hooks(
    world: &mut WorldMut<'_>,
    collider: ColliderHandle,
    hooks: ActiveHooks,
) -> bool {
    let collider = world.colliders.get_mut(collider);
    collider.map(|it| it.set_active_hooks(hooks)).is_some()
}

/// Restarts the sleep timers of bodies.
pub(crate) fn rouse(bodies: &mut RigidBodySet, restless: &[RigidBodyHandle]) {
    each(bodies, restless, |body| body.wake_up(true));
}

/// Leaves the gyroscopic rotation of bodies to Rapier again.
pub(crate) fn let_precess(bodies: &mut RigidBodySet, steady: &[RigidBodyHandle]) {
    each(bodies, steady, |body| body.enable_gyroscopic_forces(true));
}

/// Returns true if a body fell asleep or was quarantined: its velocity is final.
fn is_at_rest(body: &RigidBody) -> bool {
    body.is_sleeping() || !body.is_enabled()
}

/// The factor by which Rapier's damping scales a velocity in a step.
fn damped(damping: Real, dt: Real) -> Real {
    (1.0 + dt * damping).recip()
}

/// The state from which a body goes on after an impact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Push {
    pub body: RigidBodyHandle,
    /// The new pose; `None` if the body stays where it is.
    pub pose: Option<Pose>,
    pub linvel: Vector,
    pub angvel: Vector,
    /// The last impact, if the body was put on another path within the step.
    pub hit: Option<MidStepImpact>,
}

/// Writes the states after impacts; returns the number of bodies written. Like Rapier's contacts, they wake the bodies.
pub(crate) fn push(bodies: &mut RigidBodySet, pushes: &[Push]) -> usize {
    let mut written = 0;
    for push in pushes {
        let Some(body) = bodies.get_mut(push.body) else {
            continue;
        };
        if let Some(pose) = push.pose {
            body.set_position(pose, true);
        }
        body.set_linvel(push.linvel, true);
        body.set_angvel(push.angvel, true);
        written += 1;
    }
    written
}
