//! Detection fields under operators: whether they act on what approaches.

use std::collections::HashMap;

use super::discrete::Discrete;
use crate::compile::{Compiled, DetectionField, FieldMask};
use crate::eval::Interpreter;
use crate::field::{Frame, Frames, Motion, Query, real};
use crate::math::{ColliderHandle, DVec3, Real, RigidBodyHandle, Rotation, Vector, to_dvec3};
use crate::sample::{Moment, Samples};

/// The present state of what masks may ask.
#[derive(Debug, Default)]
pub(super) struct FieldMasks {
    machine: Interpreter,
    samples: Samples,
    probe_of: HashMap<ColliderHandle, usize>,
    frames: Vec<Option<Frame>>,
}

/// Where a field is asked about a collider.
#[derive(Clone, Copy)]
enum At<'a> {
    Now,
    /// At a world point.
    Point(DVec3),
    Touch(&'a NextTouch),
}

/// Two colliders as they are about to touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct NextTouch {
    pub pair: [ColliderHandle; 2],
    /// In how long.
    pub time: Real,
    /// By how much their colliders have moved until then.
    pub ways: [Vector; 2],
    /// Into the second.
    pub into: Vector,
}

impl NextTouch {
    /// By how much a collider is moved: as far into the other as is not told from touching it.
    fn way(&self, collider: ColliderHandle) -> Vector {
        match self.pair.iter().position(|it| *it == collider) {
            Some(0) => self.ways[0] + self.into,
            Some(_) => self.ways[1] - self.into,
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
        self.probe_of.clear();
        for (place, sample) in self.samples.list.iter().enumerate() {
            self.probe_of
                .extend(sample.collider.map(|collider| (collider, place)));
        }
        self.frames.clear();
        self.frames
            .extend(compiled.anchors.iter().map(|anchor| frames.frame(anchor)));
    }

    /// Whether a detection field of one of two colliders acts on the other.
    pub(super) fn let_touch(
        &mut self,
        touch: &Discrete,
        compiled: &Compiled,
        [first, second]: [ColliderHandle; 2],
        moment: Moment,
    ) -> bool {
        [(first, second), (second, first)]
            .into_iter()
            .any(|(owner, other)| {
                let numbers = touch.detectors_of(owner).iter();
                let mut detectors = numbers.map(|number| &compiled.detectors[*number as usize]);
                detectors.any(|it| self.asks(compiled, it, other, moment, At::Now))
            })
    }

    /// The same, once two have gone on until they touch: what stands at the border of a region is there
    /// then. `gained` is by how much faster a body becomes.
    pub(super) fn let_meet(
        &mut self,
        touch: &Discrete,
        compiled: &Compiled,
        meeting: &NextTouch,
        moment: Moment,
        gained: impl Fn(RigidBodyHandle) -> Vector,
    ) -> bool {
        let now = self.frames.clone();
        for frame in self.frames.iter_mut().flatten() {
            let velocity = frame.velocity + frame.body.map_or(Vector::ZERO, &gained);
            frame.pose.translation += velocity * meeting.time;
            let turn = Rotation::from_scaled_axis(frame.angvel * meeting.time);
            frame.pose.rotation = (turn * frame.pose.rotation).normalize();
        }
        let [first, second] = meeting.pair;
        let lets = [(first, second), (second, first)]
            .into_iter()
            .any(|(owner, other)| {
                let numbers = touch.detectors_of(owner).iter();
                let mut detectors = numbers.map(|number| &compiled.detectors[*number as usize]);
                detectors.any(|it| self.asks(compiled, it, other, moment, At::Touch(meeting)))
            });
        self.frames = now;
        lets
    }

    /// Whether a detection field is still there, if `other` is at a world point, after its operators:
    /// not replaced, cut out or outside its region. What is no sample (a fixed or kinematic
    /// collider) is judged where the owner of the field is.
    pub(super) fn lets_through_at(
        &mut self,
        compiled: &Compiled,
        detector: &DetectionField,
        other: ColliderHandle,
        moment: Moment,
        world_point: DVec3,
    ) -> bool {
        self.asks(compiled, detector, other, moment, At::Point(world_point))
    }

    fn asks(
        &mut self,
        compiled: &Compiled,
        detector: &DetectionField,
        other: ColliderHandle,
        moment: Moment,
        at: At<'_>,
    ) -> bool {
        let Some(mask) = detector.mask else {
            return true;
        };
        let Some(query) = self.query(detector, other, moment, at) else {
            return false;
        };
        let Some(program) = compiled.programs.get(mask.program) else {
            return false;
        };
        let instance = mask.instance as usize;
        let motion = Motion::of(&query);
        let (leaf, frames) = ((program, mask.leaf), &self.frames);
        self.machine
            .contributes(leaf, instance, frames, &query, &motion)
    }

    /// The force of the composite in which a detection field stands, where it is defined.
    pub(super) fn force(&mut self, compiled: &Compiled, mask: FieldMask, query: &Query) -> DVec3 {
        let program = compiled.programs.get(mask.program);
        let outcome = program.and_then(|program| {
            let (instance, frames) = (mask.instance as usize, &self.frames);
            let motion = Motion::of(query);
            self.machine.run(program, instance, frames, query, &motion)
        });
        outcome.map_or(DVec3::ZERO, |outcome| real(outcome.force))
    }

    /// A collider as fields see it, if they do.
    pub(super) fn sample(&self, collider: ColliderHandle, moment: Moment) -> Option<Query> {
        let place = self.probe_of.get(&collider)?;
        Some(self.samples.query(&self.samples.list[*place], moment))
    }

    /// `other` as a sample for a field; `None` if neither of the two is sampled.
    fn query(
        &self,
        detector: &DetectionField,
        other: ColliderHandle,
        moment: Moment,
        at: At<'_>,
    ) -> Option<Query> {
        let sample = |collider| {
            let mut query = self.sample(collider, moment)?;
            if let At::Touch(touch) = at {
                query.world_point += to_dvec3(touch.way(collider));
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
