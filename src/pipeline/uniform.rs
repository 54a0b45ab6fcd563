//! Fields that push every body alike: nothing is to be sampled or evaluated.

use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{self, Constraints, WakePolicy, Wanted, WorldMut};
use crate::field::ForceMode;
use crate::integrate::{FASTEST, Load, Motions, Scheme, VelocityUpdate, second};
use crate::math::{Real, Vector};
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
        let (updates, loads) = (&mut self.late.updates, &mut self.motions.loads);
        updates.clear();
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
        let parameters = world.integration_parameters;
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
                if held && first.is_none() {
                    let body = Body::of(handle, body);
                    loads.push(Load::new(&body, wrench, false, dt));
                    return true;
                }
                let load = first.and_then(|first| first.load(handle));
                let count = parameters.num_solver_iterations + body.additional_solver_iterations();
                let behind = (count.max(1) as Real).recip();
                let felt = match (held, load.is_some()) {
                    (false, false) => wrench,
                    _ => second(wrench, load, held, behind),
                };
                if felt == Wrench::ZERO {
                    return true;
                }
                let inv_mass = body.mass_properties().effective_inv_mass;
                updates.push(VelocityUpdate {
                    body: handle,
                    linvel: body.linvel() + felt.force * duration * inv_mass,
                    angvel: body.angvel(),
                    spins: false,
                    wake: false,
                });
                true
            });
        bridge::write_linear(world.bodies, updates);
        if !loads.is_empty() {
            let record = &mut self.spare_record;
            let open = state.open.get_or_insert_with(|| std::mem::take(record));
            bridge::apply(world.bodies, loads, &mut open.overrides);
        }
        self.sampled = shown.bodies.len();
        updates.len()
    }
}
