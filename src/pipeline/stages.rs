//! What both halves of a step have in common: bodies → samples → evaluation.

use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{Constraints, View, Wanted, WorldMut, is_movable};
use crate::compile::{Compiled, Prepared, Reach as Box};
use crate::field::FieldSet;
use crate::integrate::{MotionRules, StepContext, StepWarning};
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::rapier::dynamics::IntegrationParameters;
use crate::rigid::{Body, Lookup, is_sound};
use crate::sample::{Moment, Properties, Samples};

/// Rapier's speed limit, but for what rounding adds over the iterations of a step.
const BEYOND_LIMIT: Real = 1.001;

/// A part of the world, and how far beyond it a body can come into it within a step.
pub(super) struct Reach {
    low: Vector,
    high: Vector,
}

impl Reach {
    fn holds(&self, body: &crate::rapier::dynamics::RigidBody, extent: Real) -> bool {
        let point = body.position().transform_point(body.local_center_of_mass());
        let extent = Vector::splat(extent);
        (point + extent).cmpge(self.low).all() && (point - extent).cmple(self.high).all()
    }
}

impl FieldPipeline {
    /// Takes up the links of multibodies.
    pub(super) fn find_links(&mut self, world: &WorldMut<'_>) {
        self.links.clear();
        for multibody in world.multibody_joints.multibodies() {
            let links = multibody.links().map(|link| link.rigid_body_handle());
            self.links.extend(links);
        }
        self.links
            .sort_unstable_by_key(|link| link.into_raw_parts().0);
    }

    /// Takes up the bodies that Rapier's solver holds, if the scheme treats them differently.
    pub(super) fn find_held(&mut self, fields: &Definition<'_>, world: &WorldMut<'_>) {
        self.held.clear();
        if fields.settings.scheme.loads() {
            let bodies = self.bodies.iter().map(|body| body.handle);
            Constraints::new(world).among(bodies, &mut self.held);
        }
    }

    pub(super) fn prepared<'a>(&'a self, set: &'a FieldSet) -> Prepared<'a> {
        Prepared {
            set,
            compiled: &self.compiled,
        }
    }

    /// How bodies move in this step, apart from fields.
    pub(super) fn rules<'a>(
        [links, held]: [&'a [RigidBodyHandle]; 2],
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
            on_fault: fields.settings.on_fault,
            sift: None,
        }
    }

    /// Copies the bodies that are sampled: those awake, with `besides`, and all sleepers if asked
    /// for.
    pub(super) fn read(
        &mut self,
        world: &WorldMut<'_>,
        (sleepers, all): (bool, bool),
        besides: &[Body],
    ) {
        let (bodies, warnings) = (&mut self.bodies, &mut self.warnings);
        bodies.clear();
        let wanted = Wanted {
            sleepers,
            all,
            besides,
        };
        self.reader
            .visit(&world.view(), world.islands, wanted, |handle, body| {
                match is_sound(body) {
                    true => bodies.push(Body::of(handle, body)),
                    false => warnings.push(StepWarning::NotFinite { body: handle }),
                }
                true
            });
    }

    /// Brings the samples up to date with the bodies that were read, with the velocities in
    /// `self.seen`; returns whether they are made of other parts than before.
    pub(super) fn sample(&mut self, view: &View<'_>) -> bool {
        let remade = self.gatherer.gather(
            &mut self.samples,
            (&self.properties, self.properties_revision),
            self.compiled.requirements,
            &self.bodies,
            view,
        );
        self.samples.place(&self.bodies, Some(&self.seen));
        remade
    }

    /// The next step is not to begin with the last evaluation.
    pub(super) fn retire(&mut self, state: &mut FieldState) {
        if let Some(evaluation) = state.evaluation.take() {
            self.spare = evaluation;
        }
        state.records.clear();
    }

    /// What the integrator is told of a step; apart from `self`, so that it can be borrowed beside.
    pub(super) fn context<'a>(
        view: &'a View<'a>,
        (compiled, samples, bodies): (&'a Compiled, &'a Samples, &'a [Body]),
        (time, dt): (f64, Real),
        rules: MotionRules<'a>,
    ) -> StepContext<'a, View<'a>> {
        StepContext {
            compiled,
            world: view,
            samples,
            bodies,
            time,
            dt,
            rules,
        }
    }

    /// Whether swept detection needs every body's rotation known.
    pub(super) fn exact_turns(&self, fields: &Definition<'_>) -> bool {
        fields.settings.detection == crate::contact::Detection::Swept
            && !self.compiled.detectors.is_empty()
    }

    /// Whether no field can reach any body in this step: all are bounded, and every body is farther
    /// away than Rapier lets it move.
    pub(super) fn is_idle(&mut self, fields: &Definition<'_>, world: &WorldMut<'_>) -> bool {
        let watched = fields.settings.audit || fields.settings.cross_check.on;
        let involved = !self.compiled.detectors.is_empty() || !world.soft_bodies.is_empty();
        if watched || involved || !self.links.is_empty() {
            return false;
        }
        let Some(reach) = self.reach(world) else {
            return false;
        };
        let view = world.view();
        let (gatherer, parts) = (&mut self.gatherer, self.compiled.requirements.parts);
        let turns = self.compiled.torque_possible && world.integration_parameters.dt > 0.0;
        let mut idle = true;
        let wanted = Wanted {
            sleepers: false,
            all: self.other_bodies,
            besides: &[],
        };
        self.reader
            .visit(&view, world.islands, wanted, |handle, body| {
                let extent = match parts {
                    true => gatherer.extent(body, &view),
                    false => 0.0,
                };
                let turned = turns
                    && body.angvel() != Vector::ZERO
                    && Body::of(handle, body)
                        .free_top(body.angvel(), false)
                        .is_some();
                idle = !turned && !reach.holds(body, extent);
                idle
            });
        idle
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

    /// Takes the velocities of the bodies for those that fields see.
    pub(super) fn see(&mut self) {
        self.seen.clear();
        let bodies = self.bodies.iter();
        self.seen
            .extend(bodies.map(|body| (body.linvel, body.angvel)));
    }

    /// All samples of all bodies that fields can move, sleepers included.
    pub(super) fn sample_everyone(
        properties: &Properties,
        view: &View<'_>,
        mut requirements: crate::compile::SamplingRequirements,
    ) -> (Vec<Body>, Samples) {
        requirements.parts = true;
        let movable = |body| is_movable(body) && is_sound(body);
        let movable = view.bodies().filter(|(_, body)| movable(body));
        let bodies: Vec<Body> = movable
            .map(|(handle, body)| Body::of(handle, body))
            .collect();
        let mut samples = Samples::default();
        crate::sample::Gatherer::default().gather(
            &mut samples,
            (properties, 0),
            requirements,
            &bodies,
            view,
        );
        samples.place(&bodies, None);
        (bodies, samples)
    }

    /// Fills in the sites of all bodies, for detection fields under operators; with their volumes if
    /// any field asks for those.
    pub(super) fn sites(
        properties: &Properties,
        view: &View<'_>,
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

/// The moment of a step of length `dt`; in one of no length no force acts, and that of a change of
/// velocity is to be finite.
pub(super) fn moment(time: f64, dt: Real) -> Moment {
    Moment {
        time,
        dt: if dt == 0.0 { 1.0 } else { dt },
    }
}

/// Solver iterations of Rapier's step.
pub(super) fn iterations(parameters: &IntegrationParameters) -> u32 {
    u32::try_from(parameters.num_solver_iterations).unwrap_or(u32::MAX)
}
