//! Fields that push every body alike: nothing is to be sampled or evaluated.

use super::stages::iterations;
use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{self, Constraints, WakePolicy, Wanted, WorldMut};
use crate::field::ForceMode;
use crate::integrate::{
    Before, FASTEST, FreeMotion, Load, Motions, Scheme, VelocityUpdate, complete, kicked,
};
use crate::math::{Real, Vector};
use crate::rapier::dynamics::RigidBody;
use crate::rigid::{Body, Wrench};

impl FieldPipeline {
    /// Whether the fields are the same vector for every body, and a kick is all that is done with
    /// it: then nothing can fail but by speed, and nothing is read but velocities.
    pub(super) fn pushes_alike(&self, fields: &Definition<'_>, world: &WorldMut<'_>) -> bool {
        let compiled = &self.compiled;
        let settings = fields.settings;
        let kicks = matches!(settings.scheme, Scheme::KickDriftKick | Scheme::Kick);
        let only_constants = compiled.only_constants
            && !compiled.constants.is_empty()
            && compiled.detectors.is_empty()
            && compiled.overrides.is_empty();
        let watched = settings.audit || settings.cross_check.on;
        let limit = world.integration_parameters.max_linear_velocity();
        kicks
            && only_constants
            && !watched
            && settings.wake != WakePolicy::Always
            && self.links.is_empty()
            && world.soft_bodies.is_empty()
            && world.integration_parameters.dt > 0.0
            && limit < FASTEST * 1e-3
            && self.strongest_kick(world) < FASTEST * 1e-3
    }

    /// A bound of what a step can add to any speed, of bodies not lighter than 10⁻⁹.
    fn strongest_kick(&self, world: &WorldMut<'_>) -> Real {
        let vectors = self.compiled.constants.iter().map(|c| c.vector.length());
        let sum: Real = vectors.sum();
        let dt = world.integration_parameters.dt;
        sum * dt.max(1.0) * 1e9
    }

    /// Kicks every awake body, or loads it if it is held; `first`: what the first half of the step
    /// did, in the second. Returns how many were kicked.
    pub(super) fn push_alike(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &mut WorldMut<'_>,
        first: Option<&Motions>,
    ) -> usize {
        let dt = world.integration_parameters.dt;
        self.motions.clear();
        self.bodies.clear();
        self.rollback.clear();
        self.retire(state);
        state.carriers.clear();
        let scheme = fields.settings.scheme;
        let duration = match (scheme, first) {
            (Scheme::Kick, None) => dt,
            (Scheme::Kick, Some(_)) => return 0,
            _ => dt * 0.5,
        };
        let fields = self.compiled.constants.iter();
        let sum = |mode: ForceMode| -> Vector {
            fields
                .clone()
                .filter(|c| c.mode == mode)
                .map(|c| c.vector)
                .sum()
        };
        let force = sum(ForceMode::Force);
        let (acceleration, change) = (sum(ForceMode::Acceleration), sum(ForceMode::VelocityChange));
        let updates = &mut self.late.updates;
        updates.clear();
        let motions = &mut self.motions;
        let mut free_before = first.map_or(&[][..], |first| &first.free).iter().peekable();
        let shown = &mut self.spare;
        shown.clear();
        let wanted = Wanted {
            sleepers: false,
            all: first.is_none() && self.other_bodies,
            besides: &[],
        };
        let view = world.view();
        let constraints = Constraints::new(world);
        let any_held = scheme.loads() && !constraints.none();
        let (gravity, iterations) = (world.gravity, iterations(world.integration_parameters));
        let mut turns = false;
        self.reader
            .visit(&view, world.islands, wanted, |handle, body| {
                let mass = body.mass();
                let mut pull = force;
                if acceleration != Vector::ZERO {
                    pull += acceleration * mass;
                }
                if change != Vector::ZERO {
                    pull += change * (mass / dt);
                }
                let wrench = Wrench {
                    force: pull,
                    torque: Vector::ZERO,
                };
                shown.bodies.push(handle);
                shown.wrenches.push(wrench);
                let held = any_held && constraints.hold(handle, body);
                if !held
                    && first.is_none_or(|first| first.loads.is_empty())
                    && coasts(body, gravity)
                {
                    let inv_mass = body.mass_properties().effective_inv_mass;
                    updates.push(VelocityUpdate {
                        body: handle,
                        linvel: body.linvel() + pull * duration * inv_mass,
                        angvel: body.angvel(),
                        spins: false,
                        wake: false,
                    });
                    return true;
                }
                let mut copy = Body::of(handle, body);
                let free = FreeMotion::new(&copy, gravity, iterations, dt);
                let update = match first {
                    None if held => {
                        motions.loads.push(Load::new(&copy, wrench, false, dt));
                        return true;
                    }
                    None if scheme == Scheme::Kick || free.is_none() || pull == Vector::ZERO => {
                        kicked(&copy, wrench, duration)
                    }
                    None => {
                        motions.free.push(handle);
                        let update = free.kicked(&copy, wrench, duration);
                        let linvel = free.given(update.linvel);
                        VelocityUpdate { linvel, ..update }
                    }
                    Some(first) => {
                        let was_free = free_before.next_if_eq(&&handle).is_some();
                        if was_free {
                            [copy.linvel, copy.angvel] = free.moved(copy.linvel, copy.angvel);
                        }
                        let before = Before {
                            free: was_free,
                            load: first.load(handle),
                        };
                        match complete(&copy, &free, (wrench, held), before, duration) {
                            Some(update) => update,
                            None => return true,
                        }
                    }
                };
                turns |= update.angvel != body.angvel();
                updates.push(update);
                true
            });
        match turns {
            true => {
                bridge::write(world.bodies, updates);
            }
            false => bridge::write_linear(world.bodies, updates),
        }
        let loads = &self.motions.loads;
        if !loads.is_empty() {
            let record = &mut self.spare_record;
            let open = state.open.get_or_insert_with(|| std::mem::take(record));
            bridge::apply(world.bodies, loads, &mut open.overrides);
        }
        self.sampled = shown.bodies.len();
        updates.len()
    }
}

/// Whether nothing but fields moves a free body.
fn coasts(body: &RigidBody, gravity: Vector) -> bool {
    let pulled = gravity != Vector::ZERO || body.user_force() != Vector::ZERO;
    !pulled && body.linear_damping() == 0.0 && body.angular_damping() == 0.0
}
