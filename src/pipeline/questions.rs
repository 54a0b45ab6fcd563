//! Queries of the fields; none of them changes anything.

use std::collections::HashSet;

use super::scene::moment;
use super::stages::NONE;
use super::{Definition, FieldPipeline, FieldState};
use crate::bridge::{StepError, WorldRef};
use crate::compile::{Compiled, Plan, Prepared};
use crate::diagnose::{Explanation, SampledFields, blame, missing_anchor};
use crate::eval::{Evaluator, PotentialEnergy, SampledWorld};
use crate::field::{FieldRef, FieldSet, Frames, Points, Query, Sampling, Span};
use crate::integrate::{
    Caps, Evaluation, FaultPolicy, Integrator, MotionRules, StepContext, Stiffness,
};
use crate::math::{ColliderHandle, DVec3, Real, RigidBodyHandle, Vector, from_dvec3};
use crate::reference::{Fate, Reference};
use crate::rigid::{Body, Wrench};
use crate::sample::{Attitude, Kind, Properties, SamplePoint, Samples, owner};

/// A point at which a body is sampled; see [`Fields::samples`](crate::Fields::samples).
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct BodySample {
    /// The kind of sampling to which it belongs: `Centre`, `Parts`, `Volume` or `Surface`.
    pub sampling: Sampling,
    /// The query of the fields at this point. The sample stands for `share` · `fraction` of the body's mass.
    pub query: Query,
}

/// The composite field at a point; see [`Fields::values_at`](crate::Fields::values_at) and
/// [`Fields::value_for`](crate::Fields::value_for).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FieldValue {
    /// The force on the sample; for [`Fields::values_at`](crate::Fields::values_at), on a resting point of unit mass without charge.
    /// Zero where no field is defined.
    pub force: Vector,
    /// True if any field is defined there, even if the force is zero.
    pub is_defined: bool,
    /// The fields that count there.
    pub fields: Vec<FieldRef>,
}

/// The compiled fields: kept from the last step, or made for this query.
struct CompiledSet<'a>(MaybeOwned<'a>);

enum MaybeOwned<'a> {
    Kept(&'a Compiled, &'a Properties),
    Made(Box<(Compiled, Properties)>),
}

impl CompiledSet<'_> {
    fn compiled(&self) -> &Compiled {
        match &self.0 {
            MaybeOwned::Kept(compiled, _) => compiled,
            MaybeOwned::Made(made) => &made.0,
        }
    }

    fn properties(&self) -> &Properties {
        match &self.0 {
            MaybeOwned::Kept(_, properties) => properties,
            MaybeOwned::Made(made) => &made.1,
        }
    }
}

/// The world at one moment, for queries.
struct Scene<'a> {
    set: &'a FieldSet,
    compiled_set: CompiledSet<'a>,
    view: WorldRef<'a>,
    bodies: Vec<Body>,
    samples: Samples,
    time: f64,
    dt: Real,
}

impl FieldPipeline {
    /// The present fields in compiled form.
    fn compiled_set(&self, set: &FieldSet) -> CompiledSet<'_> {
        if self.scene.compiled.revision == set.revision() {
            return CompiledSet(MaybeOwned::Kept(&self.scene.compiled, &self.properties));
        }
        let mut properties = Properties::default();
        properties.update(set);
        CompiledSet(MaybeOwned::Made(Box::new((Compiled::new(set), properties))))
    }

    /// The plan of the compiled fields.
    pub(crate) fn plan(&self, set: &FieldSet) -> Plan {
        self.compiled_set(set).compiled().plan(set)
    }

    /// The colliders with a detection field.
    pub(crate) fn watched(&self, set: &FieldSet) -> HashSet<ColliderHandle> {
        let compiled_set = self.compiled_set(set);
        let detectors = compiled_set.compiled().detectors.iter();
        detectors.map(|detector| detector.collider).collect()
    }

    fn scene<'a>(
        &'a self,
        fields: &Definition<'a>,
        state: &FieldState,
        dt: Real,
        view: WorldRef<'a>,
    ) -> Scene<'a> {
        let compiled_set = self.compiled_set(fields.set);
        let requirements = compiled_set.compiled().requirements;
        let mut gatherer = self.gatherer.share_shapes();
        let (bodies, samples) = Self::sample_everyone(
            &mut gatherer,
            compiled_set.properties(),
            &view,
            requirements,
        );
        Scene {
            set: fields.set,
            compiled_set,
            view,
            bodies,
            samples,
            time: state.time,
            dt,
        }
    }

    /// The points at which a body is sampled.
    pub(crate) fn samples(
        &self,
        fields: &Definition<'_>,
        state: &FieldState,
        view: WorldRef<'_>,
        body: RigidBodyHandle,
    ) -> Vec<BodySample> {
        let scene = self.scene(fields, state, 1.0, view);
        let samples = &scene.samples;
        let Some(place) = samples.of_body(body) else {
            return Vec::new();
        };
        let listed = samples.each_of(place);
        // Of each kind, the small set of points is listed only without the large one: both stand for the same volume or
        // surface.
        let has = |points| listed.clone().any(|it| it.kind == Kind::Several(points));
        let many = [Points::Volume, Points::Surface].map(has);
        let listed = listed.filter(|sample| match sample.kind {
            Kind::Several(Points::FewOfVolume) => !many[0],
            Kind::Several(Points::FewOfSurface) => !many[1],
            _ => true,
        });
        // The centre of mass, unless the colliders are sampled at their centres.
        let apart = listed.clone().any(|sample| sample.kind == Kind::Centre);
        let whole = samples.of_body(body).filter(|_| !apart);
        let own = whole
            .map(|place| samples.centres[place])
            .into_iter()
            .chain(listed);
        let sample = |sample: SamplePoint| BodySample {
            sampling: match sample.kind {
                Kind::Centre => Sampling::Centre,
                Kind::Site | Kind::Particle => Sampling::Parts,
                Kind::Several(Points::Volume | Points::FewOfVolume) => Sampling::Volume,
                Kind::Several(Points::Surface | Points::FewOfSurface) => Sampling::Surface,
            },
            query: samples.query(&sample, moment(scene.time, scene.dt)),
        };
        own.map(sample).collect()
    }

    /// The wrenches on all bodies that fields move.
    pub(crate) fn wrenches(
        &self,
        fields: &Definition<'_>,
        state: &FieldState,
        dt: Real,
        view: WorldRef<'_>,
    ) -> Result<Vec<(RigidBodyHandle, Wrench)>, StepError> {
        let scene = self.scene(fields, state, dt, view);
        let (evaluation, _) = scene.evaluate(fields, state)?;
        let bodies = evaluation.bodies.into_iter();
        Ok(bodies.zip(evaluation.wrenches).collect())
    }

    /// The wrench on a body in the last step.
    pub(crate) fn last_wrench(&self, state: &FieldState, body: RigidBodyHandle) -> Option<Wrench> {
        let evaluation = state.evaluation.as_ref().unwrap_or(&self.spare);
        evaluation.wrench(body)
    }

    /// The stiffness of the fields for a body.
    pub(crate) fn stiffness(
        &self,
        fields: &Definition<'_>,
        state: &FieldState,
        dt: Real,
        view: WorldRef<'_>,
        body: RigidBodyHandle,
    ) -> Result<Option<Stiffness>, StepError> {
        let scene = self.scene(fields, state, dt, view);
        let (evaluation, mut integrator) = scene.evaluate(fields, state)?;
        Ok(integrator.stiffness(&scene.context(fields), &evaluation, body))
    }

    /// The potential energy of the bodies in the present world.
    pub(crate) fn potential_energy(
        &self,
        fields: &Definition<'_>,
        state: &FieldState,
        view: WorldRef<'_>,
    ) -> PotentialEnergy {
        let scene = self.scene(fields, state, 1.0, view);
        let moment = moment(scene.time, scene.dt);
        let mut evaluator = Evaluator::default();
        let (compiled, samples) = (scene.compiled_set.compiled(), &scene.samples);
        evaluator.potential_energy(&SampledWorld::new(compiled, &scene.view, samples, moment))
    }

    /// The reasons for the wrench on a body.
    pub(crate) fn explain(
        &self,
        fields: &Definition<'_>,
        state: &FieldState,
        view: WorldRef<'_>,
        body: RigidBodyHandle,
    ) -> Option<Explanation> {
        let scene = self.scene(fields, state, 1.0, view);
        let place = scene.samples.of_body(body)? as u32;
        let moment = moment(scene.time, scene.dt);
        let fields = SampledFields::new(scene.set, &scene.view, &scene.samples, moment);
        Some(fields.explain(place))
    }

    /// The composite field at some points.
    pub(crate) fn values_at(
        &self,
        fields: &Definition<'_>,
        state: &FieldState,
        view: WorldRef<'_>,
        world_points: &[Vector],
    ) -> Vec<FieldValue> {
        let compiled_set = self.compiled_set(fields.set);
        let moment = moment(state.time, 1.0);
        let samples = points(compiled_set.properties(), world_points);
        let mut forces = Vec::new();
        let mut evaluator = Evaluator::default();
        let scene = SampledWorld::new(compiled_set.compiled(), &view, &samples, moment);
        evaluator.wrenches(&scene, &mut forces, None);
        let value = |(centre, wrench): (&SamplePoint, &Wrench)| {
            let query = Query {
                body: None,
                ..samples.query(centre, moment)
            };
            FieldValue {
                force: wrench.force,
                ..value_of(fields.set, &view, &query)
            }
        };
        samples.centres.iter().zip(&forces).map(value).collect()
    }

    /// The fields whose anchors are not in the world.
    pub(crate) fn removed_anchors(
        &self,
        fields: &Definition<'_>,
        view: WorldRef<'_>,
    ) -> Vec<StepError> {
        let compiled_set = self.compiled_set(fields.set);
        let compiled = Prepared {
            set: fields.set,
            compiled: compiled_set.compiled(),
        };
        let moving = compiled.compiled.anchors.moving();
        let missing = moving.filter(|(_, anchor)| view.frame(anchor).is_none());
        missing
            .map(|(id, _)| missing_anchor(compiled, id as usize))
            .collect()
    }
}

impl<'a> Scene<'a> {
    fn prepared(&self) -> Prepared<'_> {
        Prepared {
            set: self.set,
            compiled: self.compiled_set.compiled(),
        }
    }

    fn context(&'a self, fields: &Definition<'_>) -> StepContext<'a, WorldRef<'a>> {
        StepContext {
            compiled: self.compiled_set.compiled(),
            world: &self.view,
            samples: &self.samples,
            bodies: &self.bodies,
            time: self.time,
            dt: self.dt,
            span: Span::at(self.time),
            rules: MotionRules {
                scheme: fields.settings.scheme,
                max_substeps: fields.settings.max_substeps,
                exact_turns: false,
                iterations: 1,
                gravity: Vector::ZERO,
                caps: Caps::NONE,
                links: &[],
                held: &NONE,
                reactions: None,
                on_fault: FaultPolicy::Refuse,
                drop_non_finite: None,
            },
        }
    }

    fn evaluate(
        &self,
        fields: &Definition<'_>,
        state: &FieldState,
    ) -> Result<(Evaluation, Integrator), StepError> {
        if !(self.dt >= 0.0 && self.dt.is_finite()) {
            return Err(StepError::TimeStep { dt: self.dt });
        }
        let compiled = self.prepared();
        let anchors = compiled.anchors.iter();
        let mut missing = anchors.enumerate().filter(|(_, anchor)| {
            self.view.frame(anchor).is_none() && !state.removed.contains(anchor)
        });
        if let Some((number, _)) = missing.next()
            && state.anchored.is_none()
        {
            return Err(missing_anchor(compiled, number));
        }
        let mut evaluation = Evaluation::default();
        let mut integrator = Integrator::default();
        integrator
            .evaluate(&self.context(fields), &mut evaluation)
            .map_err(|fault| blame(self.set, &fault))?;
        Ok((evaluation, integrator))
    }
}

/// Points as samples of all kinds, because each field takes one kind.
fn points(properties: &Properties, world_points: &[Vector]) -> Samples {
    let mut samples = Samples::default();
    samples.clear();
    properties.of_world(&mut samples);
    for (number, world_point) in world_points.iter().enumerate() {
        let mut sample = SamplePoint::at_rest(number as u32, owner(None) - 1.0);
        sample.world_point = *world_point;
        sample.mass = 1.0;
        samples.centres.push(sample);
        samples.sites.push(SamplePoint {
            kind: Kind::Site,
            ..sample
        });
        samples.bodies.push(RigidBodyHandle::invalid());
        samples.attitudes.push(Attitude::default());
    }
    // A point needs only one sample of each kind.
    let columns = samples.clouds.centre();
    for site in &samples.sites {
        for kind in Points::ALL.map(Kind::Several) {
            samples.clouds.add(SamplePoint { kind, ..*site }, columns);
        }
    }
    samples.number();
    samples
}

/// The composite field at a sample, by the reference.
pub(crate) fn value_of(set: &FieldSet, view: &WorldRef<'_>, query: &Query) -> FieldValue {
    let mut force = DVec3::ZERO;
    let mut value = FieldValue {
        force: Vector::ZERO,
        is_defined: false,
        fields: Vec::new(),
    };
    for term in set.terms() {
        let trace = Reference::of_term(set, term.root).trace(view, query);
        value.is_defined |= trace.force.is_some();
        force += trace.force.unwrap_or_default();
        let counts = trace.contributions.iter();
        let counts = counts.filter(|c| c.fate == Fate::Counts);
        for place in counts.map(|contribution| contribution.place) {
            value.fields.push(set.field_ref(place));
        }
    }
    value.force = from_dvec3(force);
    value
}
