//! Detection fields under operators, and the test whether they act on an approaching collider.

use super::discrete::Discrete;
use crate::compile::{Compiled, DetectionField, FieldMask};
use crate::eval::Interpreter;
use crate::field::{Frame, Frames, Motion, Query};
use crate::math::{ColliderHandle, DVec3, Real, RigidBodyHandle, Rotation, Vector, to_dvec3};
use crate::number::real;
use crate::sample::{Moment, Samples};

/// All detection fields, and the moment at which they are evaluated.
#[derive(Clone, Copy)]
pub(super) struct DetectionFields<'a> {
    pub touch: &'a Discrete,
    pub compiled: &'a Compiled,
    pub moment: Moment,
}

impl<'a> DetectionFields<'a> {
    pub(super) fn new(touch: &'a Discrete, compiled: &'a Compiled, moment: Moment) -> Self {
        DetectionFields {
            touch,
            compiled,
            moment,
        }
    }

    /// The detection fields of a collider.
    pub(super) fn of(self, collider: ColliderHandle) -> impl Iterator<Item = &'a DetectionField> {
        let numbers = self.touch.detectors_of(collider).iter();
        numbers.map(move |number| &self.compiled.detectors[*number as usize])
    }
}

/// The samples and anchor frames at which masked detection fields are evaluated.
#[derive(Debug, Default)]
pub(super) struct FieldMasks {
    interpreter: Interpreter,
    samples: Samples,
    frames: Vec<Option<Frame>>,
}

/// The place at which a field is evaluated for a collider.
#[derive(Clone, Copy)]
pub(super) enum At<'a> {
    Now,
    /// At a given world point instead of the collider's own sample.
    Point(DVec3),
    /// At a predicted touch, and displaced from there.
    Touch(&'a NextTouch, Vector),
}

/// The next touch of two colliders, predicted from their present motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct NextTouch {
    pub pair: [ColliderHandle; 2],
    /// Time from now until they touch.
    pub time: Real,
    /// Displacements of the two colliders until then.
    pub ways: [Vector; 2],
    /// Displacements of the first into the second, by half the allowed linear error: along its velocity relative to the
    /// second, and along the normal, since a grazing hit hardly leads deeper.
    pub into: [Vector; 2],
}

impl NextTouch {
    /// The displacement of a collider until the touch, and on into the other: an overlap below half the allowed error
    /// counts as touching, and a region may end at the surface.
    fn way(&self, collider: ColliderHandle, into: Vector) -> Vector {
        match self.pair.iter().position(|it| *it == collider) {
            Some(0) => self.ways[0] + into,
            Some(_) => self.ways[1] - into,
            None => Vector::ZERO,
        }
    }
}

impl FieldMasks {
    pub(super) fn refresh(
        &mut self,
        compiled: &Compiled,
        frames: &impl Frames,
        samples: impl FnOnce(&mut Samples),
    ) {
        samples(&mut self.samples);
        self.frames.clear();
        self.frames
            .extend(compiled.anchors.iter().map(|anchor| frames.frame(anchor)));
    }

    /// Returns true if a detection field of either collider acts on the other.
    pub(super) fn any_acts(
        &mut self,
        fields: DetectionFields<'_>,
        [first, second]: [ColliderHandle; 2],
        at: At<'_>,
    ) -> bool {
        let mut sides = [[first, second], [second, first]].into_iter();
        sides.any(|[owner, other]| {
            let mut detectors = fields.of(owner);
            detectors.any(|detector| self.acts_on(fields, detector, other, at))
        })
    }

    /// As [`Self::any_acts`], with both colliders and all anchors moved on to a predicted touch, so that the borders
    /// of regions stand where they will be then. `gained` is the velocity that a body gains within Rapier's step.
    pub(super) fn let_meet(
        &mut self,
        fields: DetectionFields<'_>,
        constraint: &NextTouch,
        gained: impl Fn(RigidBodyHandle) -> Vector,
    ) -> bool {
        let now = self.frames.clone();
        for frame in self.frames.iter_mut().flatten() {
            let velocity = frame.velocity + frame.body.map_or(Vector::ZERO, &gained);
            frame.pose.translation += velocity * constraint.time;
            let turn = Rotation::from_scaled_axis(frame.angvel * constraint.time);
            frame.pose.rotation = (turn * frame.pose.rotation).normalize();
        }
        let mut into = constraint.into.into_iter();
        let lets =
            into.any(|into| self.any_acts(fields, constraint.pair, At::Touch(constraint, into)));
        self.frames = now;
        lets
    }

    /// Returns true if a detection field acts on `other` at a place, after its operators: it is not replaced or cut out
    /// there, and the place is in its region. A collider without a sample (fixed or kinematic) is judged at the
    /// sample of the field's owner.
    pub(super) fn acts_on(
        &mut self,
        fields: DetectionFields<'_>,
        detector: &DetectionField,
        other: ColliderHandle,
        at: At<'_>,
    ) -> bool {
        let Some(mask) = detector.mask else {
            return true;
        };
        let Some(query) = self.query(detector, other, fields.moment, at) else {
            return false;
        };
        let Some(program) = fields.compiled.programs.get(mask.program) else {
            return false;
        };
        let instance = mask.instance as usize;
        let motion = Motion::of(&query);
        self.interpreter
            .contributes(program, mask.leaf, instance, &self.frames, &query, &motion)
    }

    /// The force of the composite field in which a detection field stands; zero where it is undefined.
    pub(super) fn force(&mut self, compiled: &Compiled, mask: FieldMask, query: &Query) -> DVec3 {
        let program = compiled.programs.get(mask.program);
        let outcome = program.and_then(|program| {
            let (instance, frames) = (mask.instance as usize, &self.frames);
            let motion = Motion::of(query);
            self.interpreter
                .run(program, instance, frames, query, &motion)
        });
        outcome.map_or(DVec3::ZERO, |outcome| real(outcome.force))
    }

    /// The sample of a collider as a query for fields, if it has one.
    pub(super) fn sample(&self, collider: ColliderHandle, moment: Moment) -> Option<Query> {
        let place = self.samples.of_collider(collider)?;
        Some(self.samples.query(&self.samples.sites[place], moment))
    }

    /// The query at which a field is evaluated for `other`: its own sample, else that of the field's owner. `None` if
    /// neither is sampled.
    fn query(
        &self,
        detector: &DetectionField,
        other: ColliderHandle,
        moment: Moment,
        at: At<'_>,
    ) -> Option<Query> {
        let sample = |collider| {
            let mut query = self.sample(collider, moment)?;
            if let At::Touch(touch, into) = at {
                query.world_point += to_dvec3(touch.way(collider, into));
            }
            Some(query)
        };
        if let Some(mut query) = sample(other) {
            if let At::Point(point) = at {
                query.world_point = point;
            }
            return Some(query);
        }
        let owner = sample(detector.collider)?;
        Some(Query {
            world_point: owner.world_point,
            time: owner.time,
            dt: owner.dt,
            ..Query::default()
        })
    }
}
