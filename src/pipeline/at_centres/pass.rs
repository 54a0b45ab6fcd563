//! One visit of all bodies: eight at a time are read, evaluated together, and written.

use super::block::{BodyBlock, Columns, KickRules, Kicked, LastWay, Special, rounded};
use crate::bridge::{self, Visit, Walk};
use crate::compile::{AtCentres, Compiled};
use crate::eval::{CentreEvaluator, TOGETHER, in_lane};
use crate::integrate::{
    Before, Completion, Edges, Evaluation, FASTEST, FreeMotion, Loaded, MotionRules, Motions,
    Reactions, SpinRules, Spins, StepWarning, stiff_from,
};
use crate::math::{Real, RigidBodyHandle, Vector, from_f64};
use crate::number::{each_lane, lanes_of};
use crate::rapier::dynamics::RigidBody;
use crate::rigid::{Body, PartsMark, Wrench, drowsy, find_next, find_next_place, is_sound};
use crate::sample::Moment;

/// One half of a step.
pub(super) struct HalfStep<'a> {
    pub moment: Moment,
    pub dt: Real,
    /// The previous evaluation.
    pub last: Option<&'a Evaluation>,
    /// The loads of the last step, where forces read velocities.
    pub reactions: &'a Reactions,
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

/// The position of a walk in the lists of the first half, and of the last step.
#[derive(Default)]
struct Places {
    known: usize,
    completions: usize,
    loads: usize,
    reactions: usize,
    given: usize,
}

/// One visit of all bodies.
pub(super) struct Pass<'a> {
    pub walk: Walk<'a>,
    pub visit: Visit<'a>,
    /// The body that needed more than a visit in the last step.
    pub blocker: Option<RigidBodyHandle>,
    pub compiled: &'a Compiled,
    pub half: &'a HalfStep<'a>,
    /// The rules of motion in this step.
    pub motion: MotionRules<'a>,
    pub spins: &'a mut Spins,
    pub evaluator: &'a mut CentreEvaluator,
    pub shown: &'a mut Evaluation,
    pub motions: &'a mut Motions,
    pub edges: &'a mut Edges,
    pub warnings: &'a mut Vec<StepWarning>,
}

/// `Err` has a body that needs more than a visit.
pub(super) type Done = Result<(), RigidBodyHandle>;

/// The values that are the same for all bodies of a visit, and its position.
pub(super) struct Rules {
    /// The (dt·ω)⁴ from which on a body has to be linearised.
    suspicious: Option<Real>,
    /// True if there is gravity.
    falls: bool,
    pub kick: KickRules,
    /// True if there is a second half.
    pub twice: bool,
    places: Places,
}

impl Pass<'_> {
    fn rules(&self) -> Rules {
        let MotionRules {
            scheme,
            gravity,
            caps,
            ..
        } = self.motion;
        let varies = self.compiled.varies();
        let twice = scheme.kicks_twice();
        Rules {
            suspicious: stiff_from(scheme).filter(|_| varies),
            falls: gravity != Vector::ZERO,
            kick: KickRules {
                duration: self.half.dt * if twice { 0.5 } else { 1.0 },
                slows: self.compiled.reads_velocity,
                first: self.half.first.is_none(),
                cap: caps.speed,
            },
            twice,
            places: Places::default(),
        }
    }

    /// Returns true if the body that needed more than a visit in the last step still does.
    pub(super) fn is_blocked(&self) -> bool {
        let blocker = self.blocker.and_then(|it| Some((it, self.visit.body(it)?)));
        blocker.is_some_and(|(handle, body)| {
            let is_awake = bridge::is_movable(body) && !body.is_sleeping();
            let known = self.half.last.and_then(|last| last.place_of(handle));
            is_awake && !self.takes(body, known.is_some())
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
        self.spins.begin(SpinRules {
            dt: self.half.dt,
            iterations: self.motion.iterations,
            balls_too: false,
        });
        loop {
            self.read(&mut rules, block)?;
            if block.seen.count == 0 {
                return Ok(());
            }
            let felt = self.evaluator.forces(self.compiled, &block.seen);
            let kicked = block.kick(&felt, &rules.kick);
            self.check_forces(&rules, block, &kicked)?;
            self.show(&rules, block, &kicked.forces);
            self.kick(&rules, block, &felt, &kicked)?;
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
            let bodies = self.half.last.map_or(&[][..], |last| &last.bodies);
            let known = find_next_place(bodies, &mut rules.places.known, handle);
            if self.half.first.is_none() && !self.is_weighed(known, body) {
                self.visit.weigh(handle);
                match self.visit.body(handle) {
                    Some(weighed) => body = weighed,
                    None => continue,
                }
            }
            if !self.takes(body, known.is_some()) {
                return Err(handle);
            }
            block.known[lane] = known;
            if rules.kick.first && drowsy(body) > 0.0 {
                block.drowsy.push(Body::of(handle, body));
            }
            self.add(rules, handle, body, block);
        }
        Ok(())
    }

    /// Adds a body to a block.
    #[inline]
    fn add(
        &self,
        rules: &mut Rules,
        handle: RigidBodyHandle,
        body: &RigidBody,
        block: &mut BodyBlock,
    ) {
        let bit = 1 << block.seen.count;
        if body.translation().abs().max_element() > self.motion.caps.farthest {
            block.far |= bit;
        }
        let before = match &self.half.first {
            None => Before::default(),
            Some(first) => rules.places.before(first.motions, handle),
        };
        let is_loaded =
            before.load.is_some() || before.completion.is_some_and(Completion::is_completed);
        if is_loaded || self.is_special(rules, handle, body) {
            let (at, known) = (&mut rules.places.reactions, self.half.reactions);
            let loaded = known.next_of(at, handle).filter(|_| rules.kick.first);
            let special = self.special(handle, body, before, loaded);
            block.special |= bit;
            block.add(handle, body, FreeMotion::NONE, special.body.linvel);
            block.specials.push(special);
            return;
        }
        let (free, mut linvel) = (self.free(rules, body), body.linvel());
        if before.is_free() {
            [linvel, _] = free.moved(linvel, Vector::ZERO);
            block.completed |= bit;
        }
        if !free.is_none() {
            block.falling |= bit;
        }
        block.add(handle, body, free, linvel);
    }

    #[inline(never)]
    fn special(
        &self,
        handle: RigidBodyHandle,
        body: &RigidBody,
        before: Before,
        loaded: Option<&Loaded>,
    ) -> Special {
        let mut body = Body::of(handle, body);
        if before.is_free() {
            let MotionRules {
                gravity,
                iterations,
                ..
            } = self.motion;
            let free = FreeMotion::new(&body, gravity, iterations, self.half.dt);
            [body.linvel, body.angvel] = free.moved(body.linvel, body.angvel);
        }
        Special {
            body,
            before,
            loaded: loaded.copied(),
        }
    }

    /// Returns true if a body needs a kick of its own: it is held or precesses, or drag slows it differently along
    /// different axes.
    #[inline]
    fn is_special(&self, rules: &Rules, handle: RigidBodyHandle, body: &RigidBody) -> bool {
        let [x, y, z] = body.mass_properties().effective_inv_mass.to_array();
        let is_locked = rules.kick.slows && !(x == y && y == z);
        is_locked || may_precess(body) || self.motion.held.contains(handle)
    }

    /// The motion of a body apart from fields, as far as kicks contain it: a single kick leaves damping to Rapier, and
    /// where drag is not solved for, gravity and the user's force as well.
    #[inline]
    fn free(&self, rules: &Rules, body: &RigidBody) -> FreeMotion {
        if !rules.twice && !rules.kick.slows || coasts(rules, body) {
            return FreeMotion::NONE;
        }
        let MotionRules {
            gravity,
            iterations,
            ..
        } = self.motion;
        let free = FreeMotion::of(body, gravity, iterations, self.half.dt);
        if rules.twice { free } else { free.undamped() }
    }

    /// Returns true if a body has the colliders that it had in the last step, so that Rapier has computed its mass.
    #[inline]
    fn is_weighed(&self, known: Option<usize>, body: &RigidBody) -> bool {
        let (Some(place), Some(last)) = (known, self.half.last) else {
            return false;
        };
        last.parts.get(place) == Some(&PartsMark::of(body))
    }

    /// Returns true if a visit suffices for a body, as far as that is known before its forces are.
    #[inline]
    fn takes(&self, body: &RigidBody, is_known: bool) -> bool {
        let same_parts = is_known && self.half.first.is_some_and(|first| first.alone);
        let anywhere = self.compiled.at_centres == Some(AtCentres::Bodies);
        is_harmless(body) && (anywhere || same_parts || self.is_one_ball(body))
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

    /// Returns an error if a force is not finite, or changed so much that the fields may be stiff.
    fn check_forces(&mut self, rules: &Rules, block: &BodyBlock, kicked: &Kicked) -> Done {
        let mut bad = block.all() & !kicked.finite;
        if let (Some(most), Some(last)) = (rules.suspicious, self.half.last)
            && (self.half.first.is_some() || !rules.twice)
        {
            let (changes, ways) = self.changes(block, kicked, last);
            let shares2 = [most, self.edges.followed_from()];
            let [swing, abrupt] = block.swings(&changes, &ways, self.half.dt, shares2);
            bad |= block.all() & swing;
            let followed = block.all() & abrupt & !block.special & !bad;
            for lane in lanes_of(if rules.kick.slows { 0 } else { followed }) {
                let last = LastWay {
                    lane,
                    way: in_lane(&ways, lane),
                    change: in_lane(&changes, lane),
                    force: in_lane(&kicked.forces, lane),
                    dt: last.dt,
                };
                self.follow(block, &last);
            }
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

    /// The changes of forces since the last evaluation, and the ways of the bodies since; zero for bodies that it does
    /// not contain.
    fn changes(&self, block: &BodyBlock, kicked: &Kicked, last: &Evaluation) -> (Columns, Columns) {
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
        (changes, ways)
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
        let [swing] = block.swings(&changes, &ways, dt, [most * from_f64(0.0625)]);
        swing
    }

    /// Adds the forces to the evaluation of this half of the step.
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
}

impl Places {
    /// The first half of a body; bodies are looked up in the order of their handles.
    fn before(&mut self, first: &Motions, handle: RigidBodyHandle) -> Before {
        let completion = first.next_completion(&mut self.completions, handle);
        let load = find_next(&first.loads, &mut self.loads, handle, |it| it.body);
        let given = find_next(&first.updates, &mut self.given, handle, |it| it.body);
        Before {
            completion,
            load: load.map(|load| load.wrench),
            given: given.map(|update| update.linvel),
            correction: None,
        }
    }
}

/// Returns true if nothing but fields moves a free body.
fn coasts(rules: &Rules, body: &RigidBody) -> bool {
    let is_damped = body.linear_damping() != 0.0 || body.angular_damping() != 0.0;
    !rules.falls && body.user_force() == Vector::ZERO && !is_damped
}

/// Returns true if a body has mass, is no lighter than 10⁻⁹, and is no faster than the bodies that Rapier moves.
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
