//! One visit of all bodies: eight at a time are read, evaluated together, and written.

use super::block::{BodyBlock, Columns, KickRules, Kicked, Special, rounded};
use crate::bridge::{self, Visit, Walk};
use crate::compile::{AtCentres, Compiled};
use crate::eval::{CentreEvaluator, CentreForce, TOGETHER, in_lane};
use crate::integrate::{
    Before, Caps, Completion, Evaluation, FASTEST, FreeMotion, Load, Motions, Scheme, StepWarning,
    VelocityUpdate, complete, complete_slowed, kicked, stiff_from,
};
use crate::math::{DVec3, Real, RigidBodyHandle, Vector, from_dvec3, from_f64};
use crate::number::{each_lane, lanes_of, real};
use crate::rapier::dynamics::{IntegrationParameters, RigidBody};
use crate::rigid::{
    Body, BodySet, PartsMark, Wrench, drowsy, find_next, find_next_place, is_sound,
};
use crate::sample::Moment;

/// One half of a step.
pub(super) struct HalfStep<'a> {
    pub moment: Moment,
    pub dt: Real,
    pub scheme: Scheme,
    /// True if bodies may have been added or removed.
    pub all: bool,
    /// The first half, in the second one.
    pub first: Option<FirstHalf<'a>>,
}

/// The results of the first half.
#[derive(Clone, Copy)]
pub(super) struct FirstHalf<'a> {
    pub motions: &'a Motions,
    /// True if only Rapier's step could change the world since.
    pub alone: bool,
}

impl HalfStep<'_> {
    /// The time for which forces act.
    fn duration(&self) -> Real {
        let share = if self.scheme.kicks_twice() { 0.5 } else { 1.0 };
        self.dt * share
    }
}

/// The position of a walk in the lists of the first half.
#[derive(Default)]
struct Places {
    known: usize,
    completions: usize,
    loads: usize,
    given: usize,
}

/// A visit of all bodies.
pub(super) struct Pass<'a> {
    pub walk: Walk<'a>,
    pub visit: Visit<'a>,
    /// A body that needed more than a visit before.
    pub blocker: Option<RigidBodyHandle>,
    pub compiled: &'a Compiled,
    pub held: &'a BodySet,
    /// The previous evaluation.
    pub last: Option<&'a Evaluation>,
    pub half: &'a HalfStep<'a>,
    pub gravity: Vector,
    pub parameters: &'a IntegrationParameters,
    /// Solver iterations of Rapier's step.
    pub iterations: u32,
    pub evaluator: &'a mut CentreEvaluator,
    pub shown: &'a mut Evaluation,
    pub motions: &'a mut Motions,
    pub drowsy: &'a mut Vec<Body>,
    pub warnings: &'a mut Vec<StepWarning>,
}

/// `Err` has a body that needs more than a visit.
type Done = Result<(), RigidBodyHandle>;

/// The values that are the same for all bodies of a visit, and its position.
struct Rules {
    /// The (dt·ω)⁴ from which on a body has to be linearised.
    suspicious: Option<Real>,
    /// True if there is gravity.
    falls: bool,
    kick: KickRules,
    twice: bool,
    places: Places,
}

impl Pass<'_> {
    fn rules(&self) -> Rules {
        let varies = self.compiled.varies();
        Rules {
            suspicious: stiff_from(self.half.scheme).filter(|_| varies),
            falls: self.gravity != Vector::ZERO,
            kick: KickRules {
                duration: self.half.duration(),
                slows: self.compiled.reads_velocity,
                cap: self.parameters.max_linear_velocity(),
            },
            twice: self.half.scheme.kicks_twice(),
            places: Places::default(),
        }
    }

    /// Returns true if the body that needed more than a visit before still does.
    pub(super) fn is_blocked(&self) -> bool {
        let blocker = self.blocker.and_then(|it| Some((it, self.visit.body(it)?)));
        blocker.is_some_and(|(handle, body)| {
            let is_awake = bridge::is_movable(body) && !body.is_sleeping();
            let known = self.last.and_then(|last| last.place_of(handle));
            is_awake && !self.takes(&self.rules(), handle, body, known.is_some())
        })
    }

    /// Visits all bodies. If one of them needs more than a visit, everything is taken back.
    pub(super) fn run(mut self, block: &mut BodyBlock) -> Done {
        let done = self.kick_all(block);
        if done.is_err() {
            self.visit.take_back();
        }
        done
    }

    fn kick_all(&mut self, block: &mut BodyBlock) -> Done {
        let mut rules = self.rules();
        loop {
            self.read(&mut rules, block)?;
            if block.seen.count == 0 {
                return Ok(());
            }
            let felt = self.evaluator.forces(self.compiled, &block.seen);
            let kicked = block.kick(&felt, &rules.kick);
            self.check_forces(&rules, block, &kicked)?;
            self.show(&rules, block, &kicked.forces);
            self.kick_plainly(block, &kicked)?;
            for (lane, special) in lanes_of(block.special).zip(&block.specials) {
                self.kick_specially(&rules, special, &felt.on(lane))?;
            }
        }
    }

    /// Reads the next bodies, up to the number that is evaluated together. It does little else, so that the memory
    /// accesses of several bodies overlap.
    fn read(&mut self, rules: &mut Rules, block: &mut BodyBlock) -> Done {
        block.clear();
        while block.seen.count < TOGETHER
            && let Some((handle, mut body)) = self.walk.next(self.visit.bodies())
        {
            if !is_sound(body) {
                self.warnings.push(StepWarning::NotFinite { body: handle });
                continue;
            }
            let lane = block.seen.count;
            let bodies = self.last.map_or(&[][..], |last| &last.bodies);
            let known = find_next_place(bodies, &mut rules.places.known, handle);
            if self.half.first.is_none() && !self.is_weighed(known, body) {
                self.visit.weigh(handle);
                match self.visit.body(handle) {
                    Some(weighed) => body = weighed,
                    None => continue,
                }
            }
            if !self.takes(rules, handle, body, known.is_some()) {
                return Err(handle);
            }
            block.known[lane] = known;
            let mut linvel = body.linvel();
            if let Some(special) = self.special(rules, handle, body) {
                linvel = special.body.linvel;
                block.special |= 1 << lane;
                block.specials.push(special);
            }
            block.add(handle, body, linvel);
        }
        Ok(())
    }

    /// Returns true if a body has the colliders that it had in the last step, so that Rapier has computed its mass.
    #[inline]
    fn is_weighed(&self, known: Option<usize>, body: &RigidBody) -> bool {
        let (Some(place), Some(last)) = (known, self.last) else {
            return false;
        };
        last.parts.get(place) == Some(&PartsMark::of(body))
    }

    /// Returns true if a visit suffices for a body, as far as it is known before its forces.
    #[inline]
    fn takes(
        &self,
        rules: &Rules,
        handle: RigidBodyHandle,
        body: &RigidBody,
        is_known: bool,
    ) -> bool {
        let same_parts = is_known && self.half.first.is_some_and(|first| first.alone);
        let anywhere = self.compiled.at_centres == Some(AtCentres::Bodies);
        let is_whole = anywhere || same_parts || self.is_one_ball(body);
        let is_slowed = || self.is_slowed_simply(rules, handle, body);
        let is_kicked = !self.compiled.reads_velocity || is_slowed();
        is_harmless(body) && is_whole && is_kicked
    }

    /// Returns true if all samples of a body are at its centre of mass.
    fn is_one_ball(&self, body: &RigidBody) -> bool {
        let collider = match body.colliders() {
            [] => return true,
            [collider] => *collider,
            _ => return false,
        };
        self.visit.collider(collider).is_none_or(|collider| {
            let centre = collider.position_wrt_parent().map(|pose| pose.translation);
            let is_centred = centre == Some(body.local_center_of_mass());
            let is_ball = || collider.shape().as_ball().is_some();
            // A collider that is no part of the body's samples does not matter.
            !collider.is_enabled() || collider.is_sensor() || (is_centred && is_ball())
        })
    }

    /// Returns true if drag slows a body in closed form.
    fn is_slowed_simply(&self, rules: &Rules, handle: RigidBodyHandle, body: &RigidBody) -> bool {
        let [x, y, z] = body.mass_properties().effective_inv_mass.to_array();
        x == y
            && y == z
            && !self.held.contains(handle)
            && !may_precess(body)
            && (rules.twice || coasts(rules, body))
    }

    /// The data of a body that other causes than fields move, too; with the velocity at which it moves, where Rapier's
    /// lags.
    fn special(
        &self,
        rules: &mut Rules,
        handle: RigidBodyHandle,
        body: &RigidBody,
    ) -> Option<Special> {
        let before = match &self.half.first {
            None => Before::default(),
            Some(first) => rules.places.before(first.motions, handle),
        };
        let quiet = match self.half.first {
            None => drowsy(body) == 0.0,
            Some(_) => !before.free && before.load.is_none(),
        };
        let plain = quiet && coasts(rules, body) && !may_precess(body);
        let is_plain = plain && !self.held.contains(handle);
        (!is_plain).then(|| self.made_special(handle, body, before))
    }

    #[inline(never)]
    fn made_special(&self, handle: RigidBodyHandle, body: &RigidBody, before: Before) -> Special {
        let mut body = Body::of(handle, body);
        let free = FreeMotion::new(&body, self.gravity, self.iterations, self.half.dt);
        if before.free {
            [body.linvel, body.angvel] = free.moved(body.linvel, body.angvel);
        }
        Special { body, free, before }
    }

    /// Returns an error if a force is not finite, or changed so much that the fields may be stiff.
    fn check_forces(&mut self, rules: &Rules, block: &BodyBlock, kicked: &Kicked) -> Done {
        let mut bad = block.all() & !kicked.finite;
        if let (Some(most), Some(last)) = (rules.suspicious, self.last)
            && (self.half.first.is_some() || !rules.twice)
        {
            bad |= block.all() & self.swings(block, kicked, last, most);
        }
        if let Some(most) = rules.suspicious.filter(|_| self.half.first.is_none())
            && block.unknown() != 0
        {
            bad |= block.unknown() & self.swings_ahead(block, kicked, most);
        }
        match lanes_of(bad).next() {
            Some(lane) => Err(block.seen.bodies[lane]),
            None => Ok(()),
        }
    }

    /// One bit for each body whose force changed much over its way since the last evaluation.
    fn swings(&self, block: &BodyBlock, kicked: &Kicked, last: &Evaluation, most: Real) -> u64 {
        let dt = self.half.dt;
        let (mut changes, mut ways) = (Columns::default(), block.seen.linvels);
        ways.as_flattened_mut()
            .iter_mut()
            .for_each(|way| *way *= dt);
        for (lane, known) in block.known[..block.seen.count].iter().enumerate() {
            let Some(place) = *known else {
                continue;
            };
            let was = last.wrenches[place].force;
            let from = match (&self.half.first, last.centres.get(place)) {
                (Some(_), _) => None,
                (None, Some(from)) => Some(from),
                (None, None) => continue,
            };
            for axis in 0..3 {
                changes[axis][lane] = kicked.forces[axis][lane] - was[axis];
                if let Some(from) = from {
                    ways[axis][lane] = block.seen.world_coms[axis][lane] - from[axis];
                }
            }
        }
        block.swings(&changes, &ways, dt, most)
    }

    /// One bit for each body whose force will have changed much at the end of its way.
    fn swings_ahead(&mut self, block: &BodyBlock, kicked: &Kicked, most: Real) -> u64 {
        let dt = self.half.dt;
        let mut ahead = block.seen.clone();
        let mut ways = kicked.linvels;
        for (points, ways) in ahead.world_coms.iter_mut().zip(&mut ways) {
            for (point, way) in points.iter_mut().zip(ways) {
                *way *= dt;
                *point += *way;
            }
        }
        let forces = rounded(self.evaluator.forces(self.compiled, &ahead).force);
        let mut changes = Columns::default();
        for axis in 0..3 {
            changes[axis] = each_lane(|lane| forces[axis][lane] - kicked.forces[axis][lane]);
        }
        // A quarter of the limit of (dt·ω)², because along its path a body need not meet the stiffest direction.
        block.swings(&changes, &ways, dt, most * from_f64(0.0625))
    }

    /// Adds the forces to those that are shown.
    fn show(&mut self, rules: &Rules, block: &BodyBlock, forces: &Columns) {
        let torque = Vector::ZERO;
        let count = block.seen.count;
        let wrenches = block.each(forces).map(|force| Wrench { force, torque });
        self.shown
            .bodies
            .extend_from_slice(&block.seen.bodies[..count]);
        self.shown.wrenches.extend(wrenches);
        self.shown.parts.extend_from_slice(&block.parts[..count]);
        if !rules.twice {
            self.shown
                .centres
                .extend(block.each(&block.seen.world_coms));
        }
    }

    /// Kicks the bodies of a block that only fields move.
    fn kick_plainly(&mut self, block: &BodyBlock, kicked: &Kicked) -> Done {
        let moved = block.all() & kicked.pushed & !block.special;
        let first = self.half.first.is_none();
        if let Some(lane) = lanes_of(moved & !kicked.sound).next() {
            return Err(block.seen.bodies[lane]);
        }
        for lane in lanes_of(moved) {
            let (handle, linvel) = (block.seen.bodies[lane], in_lane(&kicked.linvels, lane));
            if first && kicked.fast >> lane & 1 == 1 {
                self.warn_of_cap(handle, linvel);
            }
            self.visit.set_linvel(handle, linvel);
        }
        Ok(())
    }

    /// Kicks a body that other causes move, too.
    fn kick_specially(&mut self, rules: &Rules, special: &Special, felt: &CentreForce) -> Done {
        let update = match self.half.first {
            None => self.first(rules, special, felt)?,
            Some(_) => self.second(rules, special, felt),
        };
        let Some(update) = update else {
            return Ok(());
        };
        // `max_element` may pass over NaN, which is tested by itself.
        let linvel = update.linvel;
        let slow = linvel.abs().max_element() <= FASTEST * 0.5;
        if !slow || linvel.is_nan() {
            return Err(update.body);
        }
        if self.half.first.is_none() {
            self.warn_of_cap(update.body, linvel);
        }
        self.visit.write(&update);
        Ok(())
    }

    /// Warns if Rapier will limit a velocity.
    fn warn_of_cap(&mut self, body: RigidBodyHandle, linvel: Vector) {
        let caps = Caps {
            speed: self.parameters.max_linear_velocity(),
            dt: self.half.dt,
        };
        self.warnings.extend(caps.of_speed(body, linvel.length()));
    }

    /// The first half for a body that other causes move, too.
    fn first(
        &mut self,
        rules: &Rules,
        Special { body, free, .. }: &Special,
        felt: &CentreForce,
    ) -> Result<Option<VelocityUpdate>, RigidBodyHandle> {
        let (force, dt) = (from_dvec3(real(felt.force)), self.half.dt);
        let torque = Vector::ZERO;
        let wrench = Wrench { force, torque };
        if body.drowsy > 0.0 {
            self.drowsy.push(*body);
        }
        if self.held.contains(body.handle) {
            let load = Load::new(body, wrench, false, dt);
            if !load.is_bearable(body, self.gravity) {
                return Err(body.handle);
            }
            self.motions
                .loads
                .extend((force != Vector::ZERO).then_some(load));
            return Ok(None);
        }
        let iterations = self.iterations;
        let is_slowed = !felt.slowing.is_none();
        let is_felt = force != Vector::ZERO || is_slowed;
        if !is_felt {
            let turns = self.compiled.torque_possible && body.angvel != Vector::ZERO;
            let update = kicked(body, Wrench::ZERO, rules.kick.duration);
            let motions = &mut self.motions;
            let update =
                turns.then(|| motions.turned(body, update, DVec3::ZERO, dt, iterations, false));
            return Ok(update.filter(|update| update.spins));
        }
        let is_alone = self.half.scheme == Scheme::Kick || free.is_none();
        let (mut update, twist) = if is_alone {
            (kicked(body, wrench, rules.kick.duration), DVec3::ZERO)
        } else {
            free.along(body, wrench, rules.kick.duration)
        };
        if is_slowed {
            update.linvel = free.slowed_body(body, felt, rules.kick.duration);
        }
        let motions = &mut self.motions;
        let update = motions.turned(body, update, twist, dt, iterations, false);
        if is_alone {
            return Ok(Some(update));
        }
        let linvel = free.given(update.linvel);
        let given = VelocityUpdate { linvel, ..update };
        self.motions.complete_by(body.handle, Completion::Free);
        self.motions.updates.push(given);
        Ok(Some(given))
    }

    /// The second half for such a body.
    fn second(
        &self,
        rules: &Rules,
        Special { body, free, before }: &Special,
        felt: &CentreForce,
    ) -> Option<VelocityUpdate> {
        if !felt.slowing.is_none() {
            let was_free = before.free;
            return Some(complete_slowed(
                body,
                free,
                felt,
                was_free,
                rules.kick.duration,
            ));
        }
        let (force, torque) = (from_dvec3(real(felt.force)), Vector::ZERO);
        let held = self.held.contains(body.handle);
        let wrench = Wrench { force, torque };
        complete(body, free, wrench, held, *before, rules.kick.duration)
    }
}

impl Places {
    /// The first half of a body; bodies are looked up in the order of their handles.
    fn before(&mut self, first: &Motions, handle: RigidBodyHandle) -> Before {
        let completion = first.next_completion(&mut self.completions, handle);
        let load = find_next(&first.loads, &mut self.loads, handle, |it| it.body);
        let given = find_next(&first.updates, &mut self.given, handle, |it| it.body);
        Before {
            free: completion.is_some_and(Completion::is_free),
            load: load.map(|load| load.wrench),
            given: given.map(|update| update.linvel),
        }
    }
}

/// Returns true if nothing but fields moves a free body.
fn coasts(rules: &Rules, body: &RigidBody) -> bool {
    let is_damped = body.linear_damping() != 0.0 || body.angular_damping() != 0.0;
    !rules.falls && body.user_force() == Vector::ZERO && !is_damped
}

/// Returns true if a body has mass, is no lighter than 10⁻⁹, and is no faster than bodies that Rapier moves.
fn is_harmless(body: &RigidBody) -> bool {
    let slow = body.linvel().abs().max_element() <= FASTEST * 1e-3;
    let inv_mass = body.mass_properties().effective_inv_mass;
    body.mass() > 0.0 && inv_mass.max_element() <= 1e9 && slow
}

/// Returns true if a body rotates, and its moments of inertia differ.
fn may_precess(body: &RigidBody) -> bool {
    let inertia = body.mass_properties().local_mprops.inv_principal_inertia;
    let [x, y, z] = inertia.to_array();
    let alike = x == y && y == z;
    !alike && body.angvel() != Vector::ZERO
}
