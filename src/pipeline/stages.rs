//! The stages that both halves of a step share: bodies → samples → evaluation.

use super::scene::iterations;
use super::timings::span;
use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{
    Constraints, StepMark, WakePolicy, Wanted, WorldMut, WorldRef, are_few, is_movable, most_sleep,
};
use crate::compile::{Compiled, FieldReach as Box, Prepared};
use crate::field::{Anchor, FieldSet, Frame};
use crate::integrate::{FASTEST, SpinRules, StepWarning, kicked};
use crate::math::{DVec3, Real, Vector};
use crate::rapier::dynamics::{IntegrationParameters, RigidBody};
use crate::rigid::{Body, BodySet, Lookup, Wrench, is_sound, sort_by_body, world_com};
use crate::sample::{Gatherer, Properties, Samples};

/// An empty set.
pub(super) static NONE: BodySet = BodySet::new();

/// A factor on Rapier's speed limit for rounding over the iterations of a step.
const BEYOND_LIMIT: Real = 1.001;

/// The part of the world in which fields may act on a body's centre within a step.
pub(super) struct Reach {
    low: Vector,
    high: Vector,
}

const EVERYWHERE: Reach = Reach {
    low: Vector::NEG_INFINITY,
    high: Vector::INFINITY,
};

impl Reach {
    /// The places from which a body may come into a box within a step, and those that the box may come to; `None` if
    /// these are not numbers.
    fn of(reach: Box, world: &WorldMut<'_>) -> Option<Self> {
        let parameters = world.integration_parameters;
        // The carriers of fields move as well.
        let way = parameters.max_linear_velocity() * parameters.dt * BEYOND_LIMIT * 2.0;
        let way = Vector::splat(way);
        let [low, high] = match reach {
            Box::Everywhere => [EVERYWHERE.low, EVERYWHERE.high],
            Box::Nowhere => [EVERYWHERE.high, EVERYWHERE.low],
            Box::Within(bounds) => [bounds.mins - way, bounds.maxs + way],
        };
        (way.is_finite() && !low.is_nan() && !high.is_nan()).then_some(Reach { low, high })
    }

    fn is_bounded(&self) -> bool {
        self.low != EVERYWHERE.low
    }

    fn is_empty(&self) -> bool {
        self.low.cmpgt(self.high).any()
    }

    fn holds(&self, body: &RigidBody, extent: Real) -> bool {
        let point = world_com(body);
        let extent = Vector::splat(extent);
        (point + extent).cmpge(self.low).all() && (point - extent).cmple(self.high).all()
    }
}

/// A bound of the distance of a body's samples from its centre of mass.
fn extent(gatherer: &mut Gatherer, parts: bool, body: &RigidBody, world: &impl Lookup) -> Real {
    if parts {
        gatherer.extent(body, world)
    } else {
        0.0
    }
}

/// Returns true if the body that an anchor is on may move within the step.
fn is_awake(anchor: &Anchor, world: &WorldRef<'_>) -> bool {
    let carrier = anchor.carrier(|handle| world.collider(handle));
    let body = carrier.and_then(|handle| world.body(handle));
    body.is_some_and(|body| body.is_enabled() && !body.is_fixed() && !body.is_sleeping())
}

impl FieldPipeline {
    /// Returns true if contacts are compared with Rapier's; false if no field detects any.
    pub(super) fn cross_checks(&self, fields: &Definition<'_>) -> bool {
        fields.settings.cross_check.on && !self.scene.compiled.detectors.is_empty()
    }

    /// Collects the links of multibodies.
    pub(super) fn find_links(&mut self, world: &WorldMut<'_>) {
        self.scene.links.clear();
        for multibody in world.multibody_joints.multibodies() {
            let links = multibody.links().map(|link| link.rigid_body_handle());
            self.scene.links.extend(links);
        }
        sort_by_body(&mut self.scene.links, |link| *link);
    }

    /// Collects the bodies that Rapier's solver holds, if the scheme treats them differently; once in each half of a
    /// step.
    pub(super) fn find_held(&mut self, fields: &Definition<'_>, world: &WorldMut<'_>) {
        if std::mem::replace(&mut self.held_is_known, true) {
            return;
        }
        self.scene.held.clear();
        if fields.settings.scheme.loads() || self.scene.compiled.reads_velocity {
            let constraints = Constraints::new(world);
            if !self.pushed_is_known {
                // Only a complete list can be kept for the next step, because users may wake other bodies before it.
                let few = most_sleep(world.bodies, world.islands)
                    && are_few(self.scene.bodies.len(), world.bodies);
                self.pushed_is_known = self.other_bodies || !few;
                if self.pushed_is_known {
                    constraints.find_pushed(&mut self.pushed);
                } else {
                    let read = self.scene.bodies.iter().map(|body| body.handle);
                    let some = world.islands.active_bodies().chain(read);
                    constraints.find_pushed_of(some, &mut self.pushed);
                }
            }
            self.scene.held.clone_from(&self.pushed);
            let held = &mut self.scene.held;
            constraints.jointed().for_each(|body| held.insert(body));
        }
    }

    /// Keeps the contacts that were found after Rapier's step for the next step.
    pub(super) fn keep_pushed(&mut self, state: &FieldState, world: &mut WorldMut<'_>) {
        let evaluation = state.evaluation.as_ref().filter(|_| self.pushed_is_known);
        self.pushed_mark = evaluation
            .and_then(|it| StepMark::set(world.bodies, it.bodies.iter().copied(), state.steps));
    }

    pub(super) fn prepared<'a>(&'a self, set: &'a FieldSet) -> Prepared<'a> {
        Prepared {
            set,
            compiled: &self.scene.compiled,
        }
    }

    /// Copies the bodies to sample: those that are awake, and the others in `wanted`; of the sleepers only those within
    /// `near`, if it is given.
    pub(super) fn read(&mut self, world: &WorldMut<'_>, wanted: Wanted<'_>, near: Option<&Reach>) {
        span!("read");
        let (bodies, warnings) = (&mut self.scene.bodies, &mut self.warnings);
        let (gatherer, view) = (&mut self.gatherer, world.view());
        let parts = self.scene.compiled.requirements.parts;
        bodies.clear();
        let mut walk = self.reader.walk(world.bodies, world.islands, wanted);
        while let Some((handle, body)) = walk.next(world.bodies) {
            if let Some(near) = near.filter(|_| body.is_sleeping())
                && !near.holds(body, extent(gatherer, parts, body, &view))
            {
                continue;
            }
            if is_sound(body) {
                bodies.push(Body::of(handle, body));
            } else {
                warnings.push(StepWarning::NotFinite { body: handle });
            }
        }
    }

    /// Updates the data of samples that are kept between steps, for the bodies that were read. Returns true if they
    /// have changed. With `known`, the bodies are taken to have the same parts as before.
    pub(super) fn gather(&mut self, view: &WorldRef<'_>, known: bool) -> bool {
        span!("samples");
        self.gatherer.gather(
            &mut self.scene.samples,
            &self.properties,
            self.scene.compiled.requirements,
            &self.scene.bodies,
            known,
            view,
        )
    }

    /// Moves the samples to the poses of the bodies that were read.
    pub(super) fn place(&mut self) {
        span!("place");
        self.scene.samples.place(&self.scene.bodies);
    }

    /// Makes the next step evaluate again.
    pub(super) fn retire(&mut self, state: &mut FieldState) {
        if let Some(evaluation) = state.evaluation.take() {
            self.spare = evaluation;
        }
        state.records.clear();
    }

    /// Returns true if no field can reach any body in this step: all fields are bounded, and each body is farther away
    /// than Rapier lets it move. Then `self.scene.bodies` are the bodies that this crate nevertheless rotates.
    pub(super) fn is_idle(&mut self, fields: &Definition<'_>, world: &WorldMut<'_>) -> bool {
        let watched = fields.settings.audit || self.cross_checks(fields);
        let detects = !self.scene.compiled.detectors.is_empty();
        let masked = self
            .scene
            .compiled
            .detectors
            .iter()
            .any(|it| it.mask.is_some());
        if watched || masked || !world.soft_bodies.is_empty() || !self.scene.links.is_empty() {
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
            .scene
            .compiled
            .first_moving(&view)
            .is_some_and(awake_in_reach)
        {
            return false;
        }
        let Some(reach) = self.reach(world).filter(|it| !detects || it.is_empty()) else {
            return false;
        };
        let exact = self.scene.exact_turns(fields);
        if exact {
            self.find_held(fields, world);
        }
        let held = &self.scene.held;
        let (gatherer, parts) = (&mut self.gatherer, self.scene.compiled.requirements.parts);
        let turns = self.scene.compiled.torque_possible || exact;
        let turns = turns && world.integration_parameters.dt > 0.0;
        let mut idle = true;
        let turning = &mut self.scene.bodies;
        turning.clear();
        let wanted = Wanted {
            sleepers: false,
            all: self.other_bodies,
            besides: &[],
        };
        let mut walk = self.reader.walk(world.bodies, world.islands, wanted);
        while let Some((handle, body)) = walk.next(world.bodies).filter(|_| idle) {
            let extent = extent(gatherer, parts, body, &view);
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

    /// Computes the free rotation of `self.scene.bodies`, on which no field acts.
    pub(super) fn turn_freely(&mut self, parameters: &IntegrationParameters) {
        let (motions, spins) = (&mut self.motions, &mut self.integrator.spins);
        motions.clear();
        spins.begin(SpinRules {
            dt: parameters.dt,
            iterations: iterations(parameters),
            balls_too: true,
        });
        for body in self.scene.bodies.drain(..) {
            let update = kicked(&body, Wrench::ZERO, 0.0);
            spins.push(motions, &body, update, DVec3::ZERO);
        }
        spins.compute(motions, |_| ());
    }

    fn reach(&self, world: &WorldMut<'_>) -> Option<Reach> {
        let reach = Reach::of(self.scene.compiled.reach(&world.view()), world);
        reach.filter(Reach::is_bounded)
    }

    /// Returns true if a body that carries a force is awake, so that its field may come to sleepers.
    pub(super) fn is_carried(&self, world: &WorldMut<'_>) -> bool {
        let view = world.view();
        let awake = |anchor: &Anchor| is_awake(anchor, &view);
        world.islands.num_active_bodies() > 0 && self.scene.compiled.moves_by(awake)
    }

    /// The part of the world in which fields on awake bodies may act within the step; `None` if no body sleeps there.
    pub(super) fn near_carriers(
        &mut self,
        fields: &Definition<'_>,
        world: &WorldMut<'_>,
    ) -> Option<Reach> {
        if fields.settings.wake == WakePolicy::Never || world.islands.num_active_bodies() == 0 {
            return None;
        }
        let view = world.view();
        let compiled = &self.scene.compiled;
        let awake = |anchor: &Anchor| is_awake(anchor, &view);
        let reach = compiled.moving_reach(&view, awake);
        if reach == Box::Nowhere {
            return None;
        }
        // Without a limit of speed, a body may come from anywhere.
        let reach = Reach::of(reach, world).unwrap_or(EVERYWHERE);
        let (gatherer, parts) = (&mut self.gatherer, compiled.requirements.parts);
        let mut sleepers = view.bodies().filter(|(_, body)| body.is_sleeping());
        let any = sleepers.any(|(_, it)| reach.holds(it, extent(gatherer, parts, it, &view)));
        any.then_some(reach)
    }

    /// All samples of all bodies that fields can move, including sleeping ones. `gatherer` keeps its points of shapes.
    pub(super) fn sample_everyone(
        gatherer: &mut Gatherer,
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
        gatherer.make_besides(&mut samples, properties, requirements, &bodies, view);
        samples.place(&bodies);
        (bodies, samples)
    }

    /// Fills in the site samples of all bodies, for detection fields under operators; with their volumes if any field
    /// reads those.
    pub(super) fn sites(
        gatherer: &mut Gatherer,
        properties: &Properties,
        compiled: &Compiled,
        view: &WorldRef<'_>,
    ) -> impl FnOnce(&mut Samples) {
        let only_sites = crate::compile::SamplingRequirements {
            displaced: compiled.requirements.displaced,
            ..Default::default()
        };
        move |samples| *samples = Self::sample_everyone(gatherer, properties, view, only_sites).1
    }
}
