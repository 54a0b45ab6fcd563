//! The stages that both halves of a step share: bodies → samples → evaluation.

use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{Constraints, Wanted, WorldMut, WorldRef, is_movable, most_sleep};
use crate::compile::{Compiled, FieldReach as Box, Prepared};
use crate::contact::Detection;
use crate::field::{FieldSet, Frame, Span};
use crate::integrate::{FASTEST, MotionRules, StepContext, StepWarning, kicked};
use crate::math::{DVec3, Real, RigidBodyHandle, Vector};
use crate::rapier::dynamics::IntegrationParameters;
use crate::rigid::{Body, BodySet, Lookup, Wrench, is_sound};
use crate::sample::{Moment, Properties, Samples};

/// An empty set.
pub(super) static NONE: BodySet = BodySet::new();

/// A factor on Rapier's speed limit for rounding over the iterations of a step.
const BEYOND_LIMIT: Real = 1.001;

/// A moment of a step.
#[derive(Clone, Copy)]
pub(super) struct Now {
    pub time: f64,
    pub dt: Real,
    /// The span of the whole step.
    pub span: Span,
}

impl Now {
    /// The start of a step.
    pub(super) fn first(time: f64, dt: Real) -> Self {
        let span = Span::step(time, dt);
        Now { time, dt, span }
    }

    /// The end of a step that began at a time.
    pub(super) fn last(began: f64, dt: Real) -> Self {
        let span = Span::step(began, dt);
        let time = span.end;
        Now { time, dt, span }
    }

    pub(super) fn moment(self) -> Moment {
        Moment {
            span: self.span,
            ..moment(self.time, self.dt)
        }
    }
}

/// The part of the world in which fields may act on a body's centre within a step.
pub(super) struct Reach {
    low: Vector,
    high: Vector,
}

impl Reach {
    fn is_empty(&self) -> bool {
        self.low.cmpgt(self.high).any()
    }

    fn holds(&self, body: &crate::rapier::dynamics::RigidBody, extent: Real) -> bool {
        let point = body.position().transform_point(body.local_center_of_mass());
        let extent = Vector::splat(extent);
        (point + extent).cmpge(self.low).all() && (point - extent).cmple(self.high).all()
    }
}

impl FieldPipeline {
    /// Returns true if contacts are compared with Rapier's; false if no field detects any.
    pub(super) fn cross_checks(&self, fields: &Definition<'_>) -> bool {
        fields.settings.cross_check.on && !self.compiled.detectors.is_empty()
    }

    /// Collects the links of multibodies.
    pub(super) fn find_links(&mut self, world: &WorldMut<'_>) {
        self.links.clear();
        for multibody in world.multibody_joints.multibodies() {
            let links = multibody.links().map(|link| link.rigid_body_handle());
            self.links.extend(links);
        }
        self.links
            .sort_unstable_by_key(|link| link.into_raw_parts().0);
    }

    /// Collects the bodies that Rapier's solver holds, if the scheme treats them differently; once in each half of a
    /// step. `after` is the number of steps, if Rapier has just made one.
    pub(super) fn find_held(
        &mut self,
        fields: &Definition<'_>,
        world: &WorldMut<'_>,
        after: Option<u64>,
    ) {
        if std::mem::replace(&mut self.held_is_known, true) {
            return;
        }
        self.held.clear();
        if fields.settings.scheme.loads() || self.compiled.reads_velocity {
            let constraints = Constraints::new(world);
            if !std::mem::take(&mut self.pushed_is_known) {
                if !self.other_bodies && most_sleep(world.bodies, world.islands) {
                    let read = self.bodies.iter().map(|body| body.handle);
                    let some = world.islands.active_bodies().chain(read);
                    constraints.find_pushed_of(some, &mut self.pushed);
                } else {
                    constraints.find_pushed(&mut self.pushed);
                }
                self.pushed_after = after;
            }
            self.held.clone_from(&self.pushed);
            constraints.add_jointed(&mut self.held);
        }
    }

    pub(super) fn prepared<'a>(&'a self, set: &'a FieldSet) -> Prepared<'a> {
        Prepared {
            set,
            compiled: &self.compiled,
        }
    }

    /// The rules by which bodies move in this step, apart from fields.
    pub(super) fn rules<'a>(
        links: &'a [RigidBodyHandle],
        held: &'a BodySet,
        exact_turns: bool,
        fields: &Definition<'_>,
        world: &WorldMut<'_>,
    ) -> MotionRules<'a> {
        let parameters = world.integration_parameters;
        MotionRules {
            scheme: fields.settings.scheme,
            exact_turns,
            iterations: iterations(parameters),
            gravity: world.gravity,
            max_speed: parameters.max_linear_velocity(),
            links,
            held,
            reactions: None,
            on_fault: fields.settings.on_fault,
            sift: None,
        }
    }

    /// Copies the sampled bodies: the awake ones, and others that are wanted.
    pub(super) fn read(&mut self, world: &WorldMut<'_>, wanted: Wanted<'_>) {
        let (bodies, warnings) = (&mut self.bodies, &mut self.warnings);
        bodies.clear();
        let mut walk = self.reader.walk(world.bodies, world.islands, wanted);
        while let Some((handle, body)) = walk.next(world.bodies) {
            if is_sound(body) {
                bodies.push(Body::of(handle, body));
            } else {
                warnings.push(StepWarning::NotFinite { body: handle });
            }
        }
    }

    /// Updates the parts of the samples that outlive steps for the bodies that were read. Returns true if they are made
    /// of other parts than before. `known` if the bodies have the same parts as before.
    pub(super) fn gather(&mut self, view: &WorldRef<'_>, known: bool) -> bool {
        self.gatherer.gather(
            &mut self.samples,
            &self.properties,
            self.compiled.requirements,
            &self.bodies,
            known,
            view,
        )
    }

    /// Moves the samples to the poses of the bodies that were read, with the velocities in `self.seen`.
    pub(super) fn place(&mut self) {
        self.samples.place(&self.bodies, Some(&self.seen));
    }

    /// Makes the next step evaluate again.
    pub(super) fn retire(&mut self, state: &mut FieldState) {
        if let Some(evaluation) = state.evaluation.take() {
            self.spare = evaluation;
        }
        state.records.clear();
        state.reactions.clear();
    }

    /// The inputs of the integrator for a step; without `self`, so that other fields of it can be borrowed.
    pub(super) fn context<'a>(
        view: &'a WorldRef<'a>,
        compiled: &'a Compiled,
        samples: &'a Samples,
        bodies: &'a [Body],
        now: Now,
        rules: MotionRules<'a>,
    ) -> StepContext<'a, WorldRef<'a>> {
        StepContext {
            compiled,
            world: view,
            samples,
            bodies,
            time: now.time,
            dt: now.dt,
            span: now.span,
            rules,
        }
    }

    /// Returns true if swept detection needs the rotation of each body.
    pub(super) fn exact_turns(&self, fields: &Definition<'_>) -> bool {
        fields.settings.detection == Detection::Swept && !self.compiled.detectors.is_empty()
    }

    /// Returns true if no field can reach any body in this step: all fields are bounded, and each body is farther away
    /// than Rapier lets it move. Then `self.bodies` are those that this crate rotates all the same.
    pub(super) fn is_idle(&mut self, fields: &Definition<'_>, world: &WorldMut<'_>) -> bool {
        let watched = fields.settings.audit || self.cross_checks(fields);
        let detects = !self.compiled.detectors.is_empty();
        let masked = self.compiled.detectors.iter().any(|it| it.mask.is_some());
        if watched || masked || !world.soft_bodies.is_empty() || !self.links.is_empty() {
            return false;
        }
        let view = world.view();
        // If one body that carries a field is awake in its range, the others need not be visited.
        let awake_in_reach = |(frame, range): (Frame, Real)| {
            let body = frame.body.and_then(|handle| view.body(handle));
            body.is_some_and(|body| {
                let way = body.center_of_mass() - frame.pose.translation;
                is_movable(body) && !body.is_sleeping() && way.length() <= range
            })
        };
        if self
            .compiled
            .first_moving(&view)
            .is_some_and(awake_in_reach)
        {
            return false;
        }
        let Some(reach) = self.reach(world).filter(|it| !detects || it.is_empty()) else {
            return false;
        };
        let exact = self.exact_turns(fields);
        if exact {
            self.find_held(fields, world, None);
        }
        let held = &self.held;
        let (gatherer, parts) = (&mut self.gatherer, self.compiled.requirements.parts);
        let turns = self.compiled.torque_possible || exact;
        let turns = turns && world.integration_parameters.dt > 0.0;
        let mut idle = true;
        let turning = &mut self.bodies;
        turning.clear();
        let wanted = Wanted {
            sleepers: false,
            all: self.other_bodies,
            besides: &[],
        };
        let mut walk = self.reader.walk(world.bodies, world.islands, wanted);
        while let Some((handle, body)) = walk.next(world.bodies).filter(|_| idle) {
            let extent = if parts {
                gatherer.extent(body, &view)
            } else {
                0.0
            };
            let top = || {
                let copy = Body::of(handle, body);
                let top = copy.free_top(body.angvel(), exact);
                top.filter(|_| !(exact && held.contains(handle)))
                    .map(|_| copy)
            };
            let spins = turns && body.angvel() != Vector::ZERO;
            let top = spins.then(top).flatten();
            let slow = |top: &Body| top.linvel.length().max(top.angvel.length()) <= FASTEST;
            let may_turn = top.is_none_or(|top| {
                turning.push(top);
                exact && slow(&top)
            });
            // Contacts need bodies whose mass is computed, and warn of poses that are not finite.
            let weighed = body.mass_properties().effective_inv_mass != Vector::ZERO;
            let known = !detects || (weighed && is_sound(body));
            idle = known && may_turn && !reach.holds(body, extent);
        }
        idle
    }

    /// Computes the free rotation of `self.bodies`, on which no field acts.
    pub(super) fn turn_freely(&mut self, parameters: &IntegrationParameters) {
        let motions = &mut self.motions;
        motions.clear();
        let (dt, iterations) = (parameters.dt, iterations(parameters));
        for body in self.bodies.drain(..) {
            let update = kicked(&body, Wrench::ZERO, 0.0);
            let update = motions.turned(&body, update, DVec3::ZERO, dt, iterations, true);
            motions.updates.push(update);
        }
    }

    fn reach(&self, world: &WorldMut<'_>) -> Option<Reach> {
        let parameters = world.integration_parameters;
        // The carriers of fields move as well.
        let way = parameters.max_linear_velocity() * parameters.dt * BEYOND_LIMIT * 2.0;
        let way = Vector::splat(way);
        let reach = match self.compiled.reach(&world.view()) {
            Box::Everywhere => return None,
            Box::Nowhere => Reach {
                low: Vector::splat(Real::INFINITY),
                high: Vector::splat(-Real::INFINITY),
            },
            Box::Within(bounds) => Reach {
                low: bounds.mins - way,
                high: bounds.maxs + way,
            },
        };
        (way.is_finite() && !reach.low.is_nan() && !reach.high.is_nan()).then_some(reach)
    }

    /// Takes the present velocities of the bodies as those that fields see.
    pub(super) fn see(&mut self) {
        self.seen.clear();
        let bodies = self.bodies.iter();
        self.seen
            .extend(bodies.map(|body| (body.linvel, body.angvel)));
    }

    /// All samples of all bodies that fields can move, with sleepers.
    pub(super) fn sample_everyone(
        properties: &Properties,
        view: &WorldRef<'_>,
        mut requirements: crate::compile::SamplingRequirements,
    ) -> (Vec<Body>, Samples) {
        requirements.parts = true;
        let movable = |body| is_movable(body) && is_sound(body);
        let movable = view.bodies().filter(|(_, body)| movable(body));
        let bodies: Vec<Body> = movable
            .map(|(handle, body)| Body::of(handle, body))
            .collect();
        let mut samples = Samples::default();
        let mut gatherer = crate::sample::Gatherer::default();
        gatherer.make(&mut samples, properties, requirements, &bodies, view);
        samples.place(&bodies, None);
        samples.place_all();
        (bodies, samples)
    }

    /// Fills in the site samples of all bodies, for detection fields under operators; with their volumes if any field
    /// reads those.
    pub(super) fn sites(
        properties: &Properties,
        view: &WorldRef<'_>,
        displaced: bool,
        samples: &mut Samples,
    ) {
        let only_sites = crate::compile::SamplingRequirements {
            displaced,
            ..Default::default()
        };
        *samples = Self::sample_everyone(properties, view, only_sites).1;
    }
}

/// A moment by itself, for a step of length `dt`. In a step of no length no force acts, but a change of velocity must
/// give a finite force.
pub(super) fn moment(time: f64, dt: Real) -> Moment {
    Moment {
        time,
        dt: if dt == 0.0 { 1.0 } else { dt },
        span: Span::at(time),
    }
}

/// The number of solver iterations in Rapier's step.
pub(super) fn iterations(parameters: &IntegrationParameters) -> u32 {
    u32::try_from(parameters.num_solver_iterations).unwrap_or(u32::MAX)
}
