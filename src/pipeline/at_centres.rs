//! Steps in which fields pull bodies at their centres of mass only: each body is visited once before
//! Rapier's step and once after it, and neither samples nor copies are made.

use super::stages::{Now, iterations};
use super::{Definition, FieldPipeline, FieldState, OpenStep};
use crate::bridge::{self, View, WakePolicy, Wanted, WorldMut};
use crate::compile::{AtCentres, Compiled};
use crate::eval::{AT_ONCE, Centre, CentreEvaluator, CentreForce};
use crate::integrate::{
    Before, Caps, Evaluation, FASTEST, FreeMotion, Load, Motions, Scheme, StepWarning,
    VelocityUpdate, complete, complete_slowed, kicked, stiff_from,
};
use crate::math::{DVec3, Real, RigidBodyHandle, Vector, from_dvec3};
use crate::rapier::dynamics::{IntegrationParameters, RigidBody};
use crate::rigid::{Body, BodySet, Lookup, Wrench, find, is_sound};
use crate::sample::{Moment, SamplePoint, owner};

impl FieldPipeline {
    /// Whether fields, settings and world allow it.
    pub(super) fn acts_at_centres(&self, fields: &Definition<'_>, world: &WorldMut<'_>) -> bool {
        let settings = fields.settings;
        let parameters = world.integration_parameters;
        let kicks = matches!(settings.scheme, Scheme::KickDriftKick | Scheme::Kick);
        self.compiled.at_centres.is_some()
            && kicks
            && !settings.audit
            && settings.wake != WakePolicy::Always
            && self.links.is_empty()
            && world.soft_bodies.is_empty()
            && !self.other_colliders
            && parameters.dt > 0.0
            && parameters.max_linear_velocity() < FASTEST * 1e-3
    }

    /// Kicks every awake body, or loads it if it is held. `None`, and nothing has been done, if one of them
    /// takes more than this.
    pub(super) fn begin_at_centres(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &mut WorldMut<'_>,
    ) -> Option<()> {
        self.find_held(fields, world);
        self.held_is_known = true;
        let told = self.warnings.len();
        let half = HalfStep {
            now: Now::first(state.time, world.integration_parameters.dt),
            scheme: fields.settings.scheme,
            all: self.other_bodies,
            first: None,
        };
        if !self.visit_centres(&half, state.evaluation.as_ref(), world) {
            self.warnings.truncate(told);
            return None;
        }
        self.keep_copies(fields, world);
        self.retire(state);
        state.carriers.clear();
        state.resting.forget(&self.shown.bodies);
        state.evaluation = Some(std::mem::take(&mut self.shown));
        self.find_restless(state, world);
        if !self.alone {
            let written = self.late.updates.iter().map(|update| update.body);
            let loaded = self.motions.loads.iter().map(|load| load.body);
            self.stepped.note(world.bodies, written.chain(loaded));
        }
        self.write_at_centres(world);
        bridge::rouse(world.bodies, &self.restless);
        let (loads, turns) = (&self.motions.loads, &self.motions.turns);
        if !loads.is_empty() || !turns.is_empty() {
            let record = &mut self.spare_record;
            let open = state.open.get_or_insert_with(|| std::mem::take(record));
            bridge::apply(world.bodies, loads, &mut open.overrides);
            open.steady.extend(turns.iter().map(|turn| turn.body));
        }
        Some(())
    }

    /// Completes the kicks; returns how many bodies were written to. `None`, and nothing has been done, if
    /// one of them takes more than this.
    pub(super) fn finish_at_centres(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        open: &OpenStep,
        world: &mut WorldMut<'_>,
    ) -> Option<usize> {
        let told = self.warnings.len();
        let half = HalfStep {
            now: Now::last(state.time, open.dt),
            scheme: fields.settings.scheme,
            all: false,
            first: Some(&open.motions),
        };
        let twice = half.scheme.kicks_twice();
        if twice {
            self.find_held(fields, world);
        }
        if twice && !self.visit_centres(&half, state.evaluation.as_ref(), world) {
            self.warnings.truncate(told);
            return None;
        }
        self.note_sleepers(fields, state, &open.bodies, world);
        self.sampled = state.evaluation.as_ref().map_or(0, |it| it.bodies.len());
        if !twice {
            return Some(0);
        }
        self.write_at_centres(world);
        self.spare = state.evaluation.take().unwrap_or_default();
        state.evaluation = Some(std::mem::take(&mut self.shown));
        Some(self.late.updates.len())
    }

    /// Works out what is written in one half of a step; `false` if some body takes more. `last`: the
    /// evaluation before.
    fn visit_centres(
        &mut self,
        half: &HalfStep<'_>,
        last: Option<&Evaluation>,
        world: &WorldMut<'_>,
    ) -> bool {
        let Some(which) = self.compiled.at_centres else {
            return false;
        };
        let view = world.view();
        self.motions.clear();
        self.bodies.clear();
        self.late.updates.clear();
        std::mem::swap(&mut self.shown, &mut self.spare);
        self.shown.clear();
        (self.shown.dt, self.shown.outdated) = (half.now.dt, true);
        self.centres.begin(&self.compiled, &view);
        let varies = self.compiled.varies();
        let mut pass = Pass {
            view: &view,
            which,
            compiled: &self.compiled,
            held: &self.held,
            last: last.filter(|_| varies),
            suspicious: stiff_from(half.scheme).filter(|_| varies),
            half,
            moment: half.now.moment(),
            gravity: world.gravity,
            parameters: world.integration_parameters,
            evaluator: &mut self.centres,
            waiting: std::mem::take(&mut self.waiting),
            shown: &mut self.shown,
            motions: &mut self.motions,
            drowsy: &mut self.bodies,
            updates: &mut self.late.updates,
            warnings: &mut self.warnings,
            only_linear: true,
            stopped_by: None,
        };
        pass.waiting.clear();
        let known = self.blocker.and_then(|it| Some((it, view.body(it)?)));
        let blocked = known.is_some_and(|(handle, body)| {
            bridge::is_movable(body) && !body.is_sleeping() && !pass.takes(handle, body)
        });
        if blocked {
            pass.stopped_by = self.blocker;
        } else {
            let wanted = Wanted {
                sleepers: false,
                all: half.all,
                besides: &[],
            };
            self.reader
                .visit(&view, world.islands, wanted, |handle, body| {
                    pass.add(handle, body);
                    pass.stopped_by.is_none()
                });
            pass.flush();
        }
        (self.only_linear, self.blocker) = (pass.only_linear, pass.stopped_by);
        self.waiting = pass.waiting;
        if self.blocker.is_some() {
            std::mem::swap(&mut self.shown, &mut self.spare);
        }
        self.blocker.is_none()
    }

    fn write_at_centres(&self, world: &mut WorldMut<'_>) {
        if self.only_linear {
            bridge::write_linear(world.bodies, &self.late.updates);
        } else {
            bridge::write(world.bodies, &self.late.updates);
        }
    }
}

/// One half of a step.
struct HalfStep<'a> {
    now: Now,
    scheme: Scheme,
    /// Whether bodies may have been added or removed.
    all: bool,
    /// What the first half did, in the second.
    first: Option<&'a Motions>,
}

impl HalfStep<'_> {
    /// For how long forces act.
    fn duration(&self) -> Real {
        let share = if self.scheme.kicks_twice() { 0.5 } else { 1.0 };
        self.now.dt * share
    }
}

/// One visit of all bodies.
struct Pass<'a> {
    view: &'a View<'a>,
    which: AtCentres,
    compiled: &'a Compiled,
    held: &'a BodySet,
    /// The evaluation before, where forces differ from place to place.
    last: Option<&'a Evaluation>,
    /// The (dt·ω)⁴ from which a body is to be looked into.
    suspicious: Option<Real>,
    half: &'a HalfStep<'a>,
    moment: Moment,
    gravity: Vector,
    parameters: &'a IntegrationParameters,
    evaluator: &'a mut CentreEvaluator,
    /// Bodies that are to be evaluated together.
    waiting: Vec<Centre>,
    shown: &'a mut Evaluation,
    motions: &'a mut Motions,
    drowsy: &'a mut Vec<Body>,
    updates: &'a mut Vec<VelocityUpdate>,
    warnings: &'a mut Vec<StepWarning>,
    /// Whether nothing is written but linear velocities.
    only_linear: bool,
    /// A body that takes more than a visit.
    stopped_by: Option<RigidBodyHandle>,
}

impl Pass<'_> {
    /// Whether a visit does for a body, as far as can be told before its forces are known.
    fn takes(&self, handle: RigidBodyHandle, body: &RigidBody) -> bool {
        let is_whole = self.which == AtCentres::Bodies || self.is_one_ball(body);
        // Bodies that are new are looked into where fields may be stiff.
        let place = self.shown.bodies.len() + self.waiting.len();
        let known = self.last.is_none_or(|last| {
            self.half.first.is_some() || last.place_near(place, handle).is_some()
        });
        let known = known && (self.last.is_some() || !self.compiled.varies());
        let kicked_only = !self.compiled.reads_velocity || self.is_slowed_simply(handle, body);
        is_harmless(body) && is_whole && known && kicked_only
    }

    /// Whether all samples of a body are at its centre of mass.
    fn is_one_ball(&self, body: &RigidBody) -> bool {
        let [collider] = body.colliders() else {
            return body.colliders().is_empty();
        };
        self.view.collider(*collider).is_none_or(|collider| {
            let centre = collider.position_wrt_parent().map(|pose| pose.translation);
            let is_centred = centre == Some(body.local_center_of_mass());
            let is_ball = || collider.shape().as_ball().is_some();
            // A collider that is no part of the body's samples does not matter.
            !collider.is_enabled() || collider.is_sensor() || (is_centred && is_ball())
        })
    }

    /// Whether drag slows a body in closed form.
    fn is_slowed_simply(&self, handle: RigidBodyHandle, body: &RigidBody) -> bool {
        let [x, y, z] = body.mass_properties().effective_inv_mass.to_array();
        let twice = self.half.scheme.kicks_twice();
        x == y
            && y == z
            && !self.held.contains(handle)
            && !may_precess(body)
            && (twice || self.coasts(body))
    }

    /// Whether nothing but fields moves a free body.
    fn coasts(&self, body: &RigidBody) -> bool {
        let pulled = self.gravity != Vector::ZERO || body.user_force() != Vector::ZERO;
        !pulled && body.linear_damping() == 0.0 && body.angular_damping() == 0.0
    }

    fn add(&mut self, handle: RigidBodyHandle, body: &RigidBody) {
        if !is_sound(body) {
            self.warnings.push(StepWarning::NotFinite { body: handle });
            return;
        }
        if !self.takes(handle, body) {
            self.stopped_by = Some(handle);
            return;
        }
        let place = self.waiting.len() as u32;
        let at_rest = SamplePoint::at_rest(place, owner(Some(handle)));
        let sample = SamplePoint {
            world_point: body.position().transform_point(body.local_center_of_mass()),
            velocity: self.velocity(handle, body),
            mass: body.mass(),
            ..at_rest
        };
        self.waiting.push(Centre {
            body: handle,
            sample,
        });
        if self.waiting.len() == AT_ONCE {
            self.flush();
        }
    }

    /// That at which a body moves, where Rapier's is behind.
    fn velocity(&self, handle: RigidBodyHandle, body: &RigidBody) -> Vector {
        let kicked = self.half.first.filter(|first| !first.free.is_empty());
        if kicked.is_none_or(|first| find(&first.free, handle).is_none()) {
            return body.linvel();
        }
        let free = self.free_motion(&Body::of(handle, body));
        free.moved(body.linvel(), body.angvel())[0]
    }

    fn free_motion(&self, body: &Body) -> FreeMotion {
        let iterations = iterations(self.parameters);
        FreeMotion::new(body, self.gravity, iterations, self.half.now.dt)
    }

    /// Evaluates and kicks the bodies that wait.
    fn flush(&mut self) {
        if self.waiting.is_empty() || self.stopped_by.is_some() {
            return;
        }
        let waiting = std::mem::take(&mut self.waiting);
        let forces = self.evaluator.forces(self.compiled, self.moment, &waiting);
        for (centre, felt) in waiting.iter().zip(&forces) {
            if !self.is_smooth(centre, felt) || !self.kick(centre, felt) {
                self.stopped_by = Some(centre.body);
                break;
            }
        }
        self.waiting = waiting;
        self.waiting.clear();
    }

    /// Whether the force is a number, and did not change so much that the fields may be stiff.
    fn is_smooth(&mut self, centre: &Centre, felt: &CentreForce) -> bool {
        let (force, place) = (from_dvec3(felt.force), self.shown.bodies.len());
        let torque = Vector::ZERO;
        self.shown.bodies.push(centre.body);
        self.shown.wrenches.push(Wrench { force, torque });
        if !self.half.scheme.kicks_twice() {
            self.shown.centres.push(centre.sample.world_point);
        }
        force.is_finite() && !self.is_suspicious(centre, force, place)
    }

    fn is_suspicious(&self, centre: &Centre, force: Vector, place: usize) -> bool {
        let (Some(most), Some(last)) = (self.suspicious, self.last) else {
            return false;
        };
        let Some(place) = last.place_near(place, centre.body) else {
            return false;
        };
        let (dt, sample) = (self.half.now.dt, &centre.sample);
        let change = force - last.wrenches[place].force;
        let way = match (self.half.first, last.centres.get(place)) {
            (Some(_), _) => sample.velocity * dt,
            (None, Some(was)) if !self.half.scheme.kicks_twice() => sample.world_point - *was,
            _ => return false,
        };
        let swing = change * (dt * dt / sample.mass);
        change != Vector::ZERO && swing.length_squared() > most * way.length_squared()
    }

    /// Takes note of the kick of a body; whether it can be given to Rapier.
    fn kick(&mut self, centre: &Centre, felt: &CentreForce) -> bool {
        let Some(body) = self.view.body(centre.body) else {
            return false;
        };
        let update = match self.half.first {
            _ if self.is_plain(centre.body, body) => self.plainly(centre.body, body, felt),
            None => match self.first(centre.body, body, felt) {
                Ok(update) => update,
                Err(NotToBeGiven) => return false,
            },
            Some(first) => self.second(Body::of(centre.body, body), felt, first),
        };
        let Some(update) = update else {
            return true;
        };
        let slow = update.linvel.abs().max_element() <= FASTEST * 0.5;
        if !slow || update.linvel.is_nan() {
            return false;
        }
        if self.half.first.is_none() {
            let caps = Caps {
                speed: self.parameters.max_linear_velocity(),
                dt: self.half.now.dt,
            };
            let speed = update.linvel.length();
            self.warnings.extend(caps.of_speed(centre.body, speed));
        }
        self.only_linear &= !update.wake && !update.spins && update.angvel == body.angvel();
        self.updates.push(update);
        true
    }

    /// Whether nothing else concerns a body.
    fn is_plain(&self, handle: RigidBodyHandle, body: &RigidBody) -> bool {
        let quiet = match self.half.first {
            None => body.activation().time_since_can_sleep == 0.0,
            Some(first) => first.loads.is_empty() && first.free.is_empty(),
        };
        quiet && self.coasts(body) && !may_precess(body) && !self.held.contains(handle)
    }

    fn plainly(
        &self,
        handle: RigidBodyHandle,
        body: &RigidBody,
        felt: &CentreForce,
    ) -> Option<VelocityUpdate> {
        let inv_mass = body.mass_properties().effective_inv_mass;
        let duration = self.half.duration();
        let linvel = if !felt.slowing.is_none() {
            FreeMotion::NONE.slowed(body.linvel(), inv_mass.x, felt, duration)
        } else if felt.force == DVec3::ZERO {
            return None;
        } else {
            body.linvel() + from_dvec3(felt.force) * duration * inv_mass
        };
        Some(VelocityUpdate {
            body: handle,
            linvel,
            angvel: body.angvel(),
            spins: false,
            wake: false,
        })
    }

    /// The first half for a body that something else concerns, too.
    fn first(
        &mut self,
        handle: RigidBodyHandle,
        body: &RigidBody,
        felt: &CentreForce,
    ) -> Result<Option<VelocityUpdate>, NotToBeGiven> {
        let copy = Body::of(handle, body);
        let (force, dt) = (from_dvec3(felt.force), self.half.now.dt);
        let torque = Vector::ZERO;
        let wrench = Wrench { force, torque };
        if copy.drowsy > 0.0 {
            self.drowsy.push(copy);
        }
        if self.held.contains(handle) {
            let load = Load::new(&copy, wrench, false, dt);
            if !load.is_bearable(&copy, self.gravity) {
                return Err(NotToBeGiven);
            }
            self.motions
                .loads
                .extend((force != Vector::ZERO).then_some(load));
            return Ok(None);
        }
        let free = self.free_motion(&copy);
        let drift = (dt, iterations(self.parameters), false);
        let duration = self.half.duration();
        let is_felt = force != Vector::ZERO || !felt.slowing.is_none();
        if !is_felt {
            let turns = self.compiled.torque_possible && may_precess(body);
            let update = kicked(&copy, Wrench::ZERO, duration);
            let turned = |pass: &mut Self| pass.motions.turned(&copy, update, DVec3::ZERO, drift);
            return Ok(turns.then(|| turned(self)));
        }
        if self.half.scheme == Scheme::Kick || free.is_none() {
            let mut update = kicked(&copy, wrench, duration);
            if !felt.slowing.is_none() {
                update.linvel = free.slowed(copy.linvel, copy.inv_mass.x, felt, duration);
            }
            return Ok(Some(self.motions.turned(&copy, update, DVec3::ZERO, drift)));
        }
        self.motions.free.push(handle);
        let (mut update, twist) = free.along(&copy, wrench, duration);
        if !felt.slowing.is_none() {
            update.linvel = free.slowed(copy.linvel, copy.inv_mass.x, felt, duration);
        }
        let update = self.motions.turned(&copy, update, twist, drift);
        let linvel = free.given(update.linvel);
        let given = VelocityUpdate { linvel, ..update };
        self.motions.updates.push(given);
        Ok(Some(given))
    }

    /// The second half for such a body.
    fn second(
        &self,
        mut body: Body,
        felt: &CentreForce,
        first: &Motions,
    ) -> Option<VelocityUpdate> {
        let (free, duration) = (self.free_motion(&body), self.half.duration());
        let before = Before {
            free: find(&first.free, body.handle).is_some(),
            load: first.load(body.handle),
            given: first.given(body.handle),
        };
        if before.free {
            [body.linvel, body.angvel] = free.moved(body.linvel, body.angvel);
        }
        if !felt.slowing.is_none() {
            return Some(complete_slowed(&body, &free, felt, before.free, duration));
        }
        let (force, torque) = (from_dvec3(felt.force), Vector::ZERO);
        let held = self.held.contains(body.handle);
        complete(
            &body,
            &free,
            (Wrench { force, torque }, held),
            before,
            duration,
        )
    }
}

/// A force that is beyond what Rapier can be given.
struct NotToBeGiven;

/// Whether a body is not lighter than 10⁻⁹, nor without mass, and as slow as any that Rapier has moved.
fn is_harmless(body: &RigidBody) -> bool {
    let inv_mass = body.mass_properties().effective_inv_mass;
    let weighed = body.mass() > 0.0;
    weighed && inv_mass.max_element() <= 1e9 && body.linvel().abs().max_element() <= FASTEST * 1e-3
}

/// Whether a body turns, and not about every axis alike.
fn may_precess(body: &RigidBody) -> bool {
    let inertia = body.mass_properties().local_mprops.inv_principal_inertia;
    let alike = inertia.x == inertia.y && inertia.y == inertia.z;
    !alike && body.angvel() != Vector::ZERO
}

#[cfg(test)]
mod tests;
