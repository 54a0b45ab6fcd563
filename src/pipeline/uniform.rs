//! Fields that push every body alike: nothing is to be sampled or evaluated.

use super::stages::iterations;
use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{self, Balance, Constraints, WakePolicy, Wanted, WorldMut};
use crate::compile::ConstantField;
use crate::field::ForceMode;
use crate::integrate::{
    Before, FASTEST, FreeMotion, Load, Motions, Scheme, StepWarning, VelocityUpdate, complete,
    kicked,
};
use crate::math::{DVec3, Real, RigidBodyHandle, Vector};
use crate::rapier::dynamics::{IntegrationParameters, RigidBody};
use crate::rigid::{Body, Wrench, find, is_sound};

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

    /// A bound of what a step can add to any speed, of bodies that [are harmless](is_harmless).
    fn strongest_kick(&self, world: &WorldMut<'_>) -> Real {
        let vectors = self.compiled.constants.iter().map(|c| c.vector.length());
        let sum: Real = vectors.sum();
        let dt = world.integration_parameters.dt;
        sum * dt.max(1.0) * 1e9
    }

    /// Kicks every awake body, or loads it if it is held; `first`: what the first half of the step
    /// did, in the second. Returns how many were kicked; `None` if one is so light or so fast that it is
    /// to be looked at, and nothing has been done.
    pub(super) fn push_alike(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &mut WorldMut<'_>,
        first: Option<&Motions>,
    ) -> Option<usize> {
        self.motions.clear();
        self.bodies.clear();
        self.rollback.clear();
        self.retire(state);
        state.carriers.clear();
        let dt = world.integration_parameters.dt;
        let scheme = fields.settings.scheme;
        let duration = match (scheme, first) {
            (Scheme::Kick, None) => dt,
            (Scheme::Kick, Some(_)) => return Some(0),
            _ => dt * 0.5,
        };
        let (view, constraints) = (world.view(), Constraints::new(world));
        let push = Push {
            pull: Pull::new(self.compiled.constants.iter(), dt),
            scheme,
            duration,
            constraints,
            held: scheme.loads() && !constraints.none(),
            gravity: world.gravity,
            parameters: world.integration_parameters,
            first,
        };
        let updates = &mut self.late.updates;
        updates.clear();
        let shown = &mut self.spare;
        shown.clear();
        let (motions, drowsy) = (&mut self.motions, &mut self.bodies);
        let warnings = &mut self.warnings;
        let wanted = Wanted {
            sleepers: false,
            all: first.is_none() && self.other_bodies,
            besides: &[],
        };
        let (mut linear, mut harmless) = (true, true);
        let told = warnings.len();
        self.reader
            .visit(&view, world.islands, wanted, |handle, body| {
                if !is_sound(body) {
                    warnings.push(StepWarning::NotFinite { body: handle });
                    return true;
                }
                if !is_harmless(body) {
                    harmless = false;
                    return first.is_some();
                }
                let force = push.pull.on(body.mass());
                let torque = Vector::ZERO;
                shown.bodies.push(handle);
                shown.wrenches.push(Wrench { force, torque });
                let update = match push.plainly(handle, body, force) {
                    Some(update) => Some(update),
                    None => push.with_all(handle, body, force, (motions, drowsy)),
                };
                if let Some(update) = update {
                    linear &= !update.wake && update.angvel == body.angvel();
                    updates.push(update);
                }
                true
            });
        if !harmless && first.is_none() {
            warnings.truncate(told);
            return None;
        }
        if first.is_none() {
            let was_drowsing = std::mem::take(&mut state.drowsing);
            let balance = Balance {
                constraints,
                gravity: world.gravity,
                parameters: world.integration_parameters,
                drowsing: &was_drowsing,
                varies: self.compiled.reads_time,
            };
            let torque = Vector::ZERO;
            let drowsy = self.bodies.iter().map(|body| {
                let force = push.pull.on(body.mass);
                (body, Wrench { force, torque })
            });
            balance.find_restless(drowsy, &mut state.drowsing, &mut self.restless);
            self.bodies.clear();
            self.stepped.drowsing = Some(was_drowsing);
        }
        if first.is_none() && !self.alone {
            let written = updates.iter().map(|update| update.body);
            let loaded = self.motions.loads.iter().map(|load| load.body);
            self.stepped.note(world.bodies, written.chain(loaded));
        }
        match linear {
            true => bridge::write_linear(world.bodies, updates),
            false => {
                bridge::write(world.bodies, updates);
            }
        }
        if first.is_none() {
            bridge::rouse(world.bodies, &self.restless);
        }
        let (loads, turns) = (&self.motions.loads, &self.motions.turns);
        if !loads.is_empty() || !turns.is_empty() {
            let record = &mut self.spare_record;
            let open = state.open.get_or_insert_with(|| std::mem::take(record));
            bridge::apply(world.bodies, loads, &mut open.overrides);
            open.steady.extend(turns.iter().map(|turn| turn.body));
        }
        self.sampled = shown.bodies.len();
        Some(updates.len())
    }
}

/// The sums of the fields, by what they are.
struct Pull {
    force: Vector,
    acceleration: Vector,
    /// A change of velocity over the step.
    change: Vector,
    dt: Real,
}

impl Pull {
    fn new<'a>(fields: impl Iterator<Item = &'a ConstantField> + Clone, dt: Real) -> Self {
        let sum = |mode: ForceMode| -> Vector {
            let fields = fields.clone().filter(|field| field.mode == mode);
            fields.map(|field| field.vector).sum()
        };
        Pull {
            force: sum(ForceMode::Force),
            acceleration: sum(ForceMode::Acceleration),
            change: sum(ForceMode::VelocityChange),
            dt,
        }
    }

    fn on(&self, mass: Real) -> Vector {
        let mut pull = self.force;
        if self.acceleration != Vector::ZERO {
            pull += self.acceleration * mass;
        }
        if self.change != Vector::ZERO {
            pull += self.change * (mass / self.dt);
        }
        pull
    }
}

/// What is done with every body in one half of a step.
struct Push<'a> {
    pull: Pull,
    scheme: Scheme,
    duration: Real,
    constraints: Constraints<'a>,
    /// Whether any body may be held.
    held: bool,
    gravity: Vector,
    parameters: &'a IntegrationParameters,
    first: Option<&'a Motions>,
}

impl Push<'_> {
    /// A kick of a body that nothing else concerns.
    fn plainly(
        &self,
        handle: RigidBodyHandle,
        body: &RigidBody,
        force: Vector,
    ) -> Option<VelocityUpdate> {
        let drowsy = body.activation().time_since_can_sleep > 0.0;
        let quiet = match self.first {
            None => !drowsy,
            Some(first) => first.loads.is_empty() && first.free.is_empty(),
        };
        if !quiet
            || !self.coasts(body)
            || may_precess(body)
            || (self.held && self.constraints.hold(handle, body))
        {
            return None;
        }
        let inv_mass = body.mass_properties().effective_inv_mass;
        Some(VelocityUpdate {
            body: handle,
            linvel: body.linvel() + force * self.duration * inv_mass,
            angvel: body.angvel(),
            spins: false,
            wake: false,
        })
    }

    /// Whether nothing but fields moves a free body.
    fn coasts(&self, body: &RigidBody) -> bool {
        let pulled = self.gravity != Vector::ZERO || body.user_force() != Vector::ZERO;
        !pulled && body.linear_damping() == 0.0 && body.angular_damping() == 0.0
    }

    fn with_all(
        &self,
        handle: RigidBodyHandle,
        body: &RigidBody,
        force: Vector,
        (motions, drowsy): (&mut Motions, &mut Vec<Body>),
    ) -> Option<VelocityUpdate> {
        let held = self.held && self.constraints.hold(handle, body);
        let mut copy = Body::of(handle, body);
        let wrench = Wrench {
            force,
            torque: Vector::ZERO,
        };
        let (dt, iterations) = (self.pull.dt, iterations(self.parameters));
        let free = FreeMotion::new(&copy, self.gravity, iterations, dt);
        let Some(first) = self.first else {
            if copy.drowsy > 0.0 {
                drowsy.push(copy);
            }
            if held {
                motions.loads.push(Load::new(&copy, wrench, false, dt));
                return None;
            }
            let drift = (dt, iterations, false);
            if self.scheme == Scheme::Kick || free.is_none() || force == Vector::ZERO {
                let update = kicked(&copy, wrench, self.duration);
                return Some(motions.turned(&copy, update, DVec3::ZERO, drift));
            }
            motions.free.push(handle);
            let (update, twist) = free.along(&copy, wrench, self.duration);
            let update = motions.turned(&copy, update, twist, drift);
            let linvel = free.given(update.linvel);
            motions.updates.push(VelocityUpdate { linvel, ..update });
            return Some(VelocityUpdate { linvel, ..update });
        };
        let before = Before {
            free: find(&first.free, handle).is_some(),
            load: first.load(handle),
            given: first.given(handle),
        };
        if before.free {
            [copy.linvel, copy.angvel] = free.moved(copy.linvel, copy.angvel);
        }
        complete(&copy, &free, (wrench, held), before, self.duration)
    }
}

/// Whether a body is not lighter than 10⁻⁹, and as slow as any that Rapier has moved.
fn is_harmless(body: &RigidBody) -> bool {
    let inv_mass = body.mass_properties().effective_inv_mass;
    inv_mass.max_element() <= 1e9 && body.linvel().abs().max_element() <= FASTEST * 1e-3
}

/// Whether a body turns, and not about every axis alike.
fn may_precess(body: &RigidBody) -> bool {
    let inertia = body.mass_properties().local_mprops.inv_principal_inertia;
    let alike = inertia.x == inertia.y && inertia.y == inertia.z;
    !alike && body.angvel() != Vector::ZERO
}
