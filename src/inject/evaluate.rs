//! What the fields do to all bodies as the world is: of a step, or asked from outside.

use super::error::StepError;
use super::predicted::{PredictedFrames, PredictedMotion};
use super::{Injector, Stiffness, WakePolicy, assign, blame};
use crate::compile::{Prepared, SamplingRequirements};
use crate::eval::PotentialEnergy;
use crate::field::{Query, Sampling};
use crate::math::{ColliderSet, Real, RigidBodyHandle, RigidBodySet, to_dvec3, to_f64};
use crate::rigid::Wrench;
use crate::rigid::six;
use crate::sample::Shapes;
use crate::sample::{Gathering, Pending};
use crate::sample::{Kind, Moment, Properties, SamplePoint, Samples};

/// A point at which a body is sampled; see [`Fields::samples`](crate::Fields::samples).
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct BodySample {
    /// The kind of sampling it belongs to: one of `Centre`, `Parts`, `Volume` and `Surface`.
    pub sampling: Sampling,
    /// What fields are asked there. The sample stands for `share` · `fraction` of the body's mass.
    pub query: Query,
}

impl Injector {
    /// Where and how a body is sampled.
    pub(crate) fn samples(
        &mut self,
        body: RigidBodyHandle,
        compiled: Prepared<'_>,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Vec<BodySample> {
        let mut samples = Samples::default();
        self.gather_all(compiled, bodies, colliders, &mut samples);
        let moment = self.moment(1.0);
        let list = samples.centres.iter().chain(&samples.list);
        let own = list.filter(|sample| samples.bodies[sample.body as usize] == body);
        let sample = |sample: &SamplePoint| BodySample {
            sampling: match sample.kind {
                Kind::Centre => Sampling::Centre,
                Kind::Site => Sampling::Parts,
                Kind::Volume => Sampling::Volume,
                Kind::Surface => Sampling::Surface,
            },
            query: samples.query(sample, moment),
        };
        own.map(sample).collect()
    }

    /// The wrenches on all bodies, as a step of `dt` begins with in the world as it is. Leaves the
    /// evaluation of the step alone: where forces depend on velocities, another would not be the
    /// same to the last bit.
    pub(crate) fn sample(
        &mut self,
        dt: Real,
        compiled: Prepared<'_>,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<Vec<(RigidBodyHandle, Wrench)>, StepError> {
        if !(dt >= 0.0 && dt.is_finite()) {
            return Err(StepError::TimeStep { dt });
        }
        self.check_anchors(compiled, bodies, colliders)?;
        self.aside(|this| {
            this.evaluate(compiled, dt, bodies, colliders, None)?;
            let bodies = this.samples.bodies.iter().copied();
            Ok(bodies.zip(this.wrenches.iter().copied()).collect())
        })
    }

    /// Does something without a trace in what the step has evaluated.
    pub(super) fn aside<T>(&mut self, act: impl FnOnce(&mut Self) -> T) -> T {
        let samples = std::mem::take(&mut self.samples);
        let wrenches = std::mem::take(&mut self.wrenches);
        let watch = std::mem::take(&mut self.watch);
        let evaluated = (self.evaluated, self.evaluated_dt);
        let outcome = act(self);
        (self.samples, self.wrenches, self.watch) = (samples, wrenches, watch);
        (self.evaluated, self.evaluated_dt) = evaluated;
        outcome
    }

    /// How stiff the fields are for a body in steps of `dt`, in the world as it is.
    pub(crate) fn stiffness(
        &mut self,
        body: RigidBodyHandle,
        dt: Real,
        compiled: Prepared<'_>,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<Option<Stiffness>, StepError> {
        if !(dt >= 0.0 && dt.is_finite()) {
            return Err(StepError::TimeStep { dt });
        }
        self.check_anchors(compiled, bodies, colliders)?;
        self.aside(|this| {
            this.evaluate(compiled, dt, bodies, colliders, None)?;
            let place = this.place_of(body);
            Ok(place.and_then(|place| {
                this.lineariser.prepare(&compiled, &(bodies, colliders));
                let verdict = this.judge(compiled, place, bodies, colliders);
                verdict.map(|verdict| verdict.rates.report(dt))
            }))
        })
    }

    /// Fills in the sites of all bodies as they are now, sleepers included.
    pub(crate) fn gather(
        book: &Properties,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        samples: &mut Samples,
    ) {
        let mut gathering = Gathering {
            book,
            shapes: &mut Shapes::default(),
            sleepers: true,
            wanted: SamplingRequirements {
                parts: true,
                ..SamplingRequirements::default()
            },
            pending: None,
            several: Vec::new(),
        };
        gathering.run(bodies, colliders, samples);
    }

    /// Fills in all samples of all bodies that the fields want, sleepers included.
    fn gather_all(
        &mut self,
        compiled: Prepared<'_>,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        samples: &mut Samples,
    ) {
        let mut gathering = Gathering {
            book: &self.book,
            shapes: &mut self.shapes,
            sleepers: true,
            wanted: SamplingRequirements {
                parts: true,
                ..compiled.wanted
            },
            pending: None,
            several: Vec::new(),
        };
        gathering.run(bodies, colliders, samples);
    }

    /// The samples of all bodies as they are now, sleepers included, and the moment of a step of
    /// length `dt`.
    pub(crate) fn all_probes(
        &mut self,
        compiled: Prepared<'_>,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> (Samples, Moment) {
        let mut samples = Samples::default();
        self.gather_all(compiled, bodies, colliders, &mut samples);
        (samples, self.moment(dt))
    }

    /// The potential energy of the bodies as they are now.
    pub(crate) fn potential_energy(
        &mut self,
        compiled: Prepared<'_>,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> PotentialEnergy {
        // Sleepers have potential energy too, so the samples of the step do not do.
        let mut samples = Samples::default();
        self.gather_all(compiled, bodies, colliders, &mut samples);
        let world = (bodies, colliders);
        let moment = self.moment(1.0);
        self.evaluator
            .potential_energy(&compiled, &world, &samples, moment)
    }

    /// Works out the wrenches on all bodies. `pending`: for how long the last ones still act, so
    /// that fields see the velocities that will be there in the end. This keeps forces that
    /// depend on velocities at second order with one evaluation per step.
    pub(super) fn evaluate(
        &mut self,
        compiled: Prepared<'_>,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        pending: Option<Real>,
    ) -> Result<(), StepError> {
        let last_bodies = std::mem::take(&mut self.samples.bodies);
        let reads_velocity = compiled.reads_velocity;
        let mut gathering = Gathering {
            book: &self.book,
            shapes: &mut self.shapes,
            sleepers: self.wake != WakePolicy::Never,
            wanted: compiled.wanted,
            pending: pending.filter(|_| reads_velocity).map(|duration| Pending {
                bodies: &last_bodies,
                wrenches: &self.wrenches,
                duration,
            }),
            several: std::mem::take(&mut self.several),
        };
        gathering.run(bodies, colliders, &mut self.samples);
        self.watch.forget();
        self.roles.clear();
        if reads_velocity {
            for handle in &self.samples.bodies {
                let Some(body) = bodies.get(*handle) else {
                    continue;
                };
                let (linvel, angvel) = gathering.velocity(*handle, body);
                let both = six(to_dvec3(linvel), to_dvec3(angvel));
                self.watch.sampled_at.push(both);
                assign(
                    &mut self.roles,
                    *handle,
                    PredictedMotion::CoastsAt { linvel, angvel },
                );
            }
        }
        self.several = gathering.several;
        let moment = self.moment(dt);
        // Fields of bodies see those bodies, too, with the velocities that will be there.
        let world = PredictedFrames {
            bodies,
            colliders,
            roles: &self.roles,
            states: &[],
            elapsed: 0.0,
            dt: to_f64(dt),
        };
        // What the wrenches were is kept, if it was on the same bodies.
        std::mem::swap(&mut self.wrenches, &mut self.watch.last);
        if last_bodies != self.samples.bodies {
            self.watch.last.clear();
        }
        let (evaluator, wrenches) = (&mut self.evaluator, &mut self.wrenches);
        evaluator.wrenches(&compiled, &world, &self.samples, moment, wrenches);
        self.errors.clear();
        let handles = self.samples.bodies.iter().enumerate();
        let errors = handles.filter_map(|(n, handle)| Some((*handle, evaluator.error(n)?)));
        self.errors.extend(errors);
        if let Some(body) = wrenches.iter().position(|wrench| !wrench.is_finite()) {
            self.evaluated = false;
            let samples = &self.samples;
            return Err(blame::non_finite(compiled, &world, samples, moment, body));
        }
        self.evaluated = true;
        self.evaluated_dt = dt;
        Ok(())
    }
}
