//! Detection fields under operators: whether they act on what approaches.

use std::collections::HashMap;

use super::discrete::Discrete;
use crate::compile::{Compiled, Detector, FieldMask};
use crate::eval::Interpreter;
use crate::field::{Frame, Frames, Motion, Query, real};
use crate::math::{ColliderHandle, DVec3};
use crate::sample::{Moment, Samples};

/// The present state of what masks may ask.
#[derive(Debug, Default)]
pub(super) struct FieldMasks {
    machine: Interpreter,
    samples: Samples,
    probe_of: HashMap<ColliderHandle, usize>,
    frames: Vec<Option<Frame>>,
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
        (touch, compiled): (&Discrete, &Compiled),
        [first, second]: [ColliderHandle; 2],
        moment: Moment,
    ) -> bool {
        [(first, second), (second, first)]
            .into_iter()
            .any(|(owner, other)| {
                let numbers = touch.detectors_of(owner).iter();
                let mut detectors = numbers.map(|number| &compiled.detectors[*number as usize]);
                detectors.any(|detector| self.lets_through(compiled, detector, other, moment))
            })
    }

    /// Whether a detection field is still there, where `other` is sampled, after its operators:
    /// not replaced, cut out or outside its region. What is no sample (a fixed or kinematic
    /// collider) is judged where the owner of the field is.
    fn lets_through(
        &mut self,
        compiled: &Compiled,
        detector: &Detector,
        other: ColliderHandle,
        moment: Moment,
    ) -> bool {
        self.asks(compiled, detector, other, moment, None)
    }

    /// The same, as if `other` were at a world point.
    pub(super) fn lets_through_at(
        &mut self,
        compiled: &Compiled,
        detector: &Detector,
        other: ColliderHandle,
        moment: Moment,
        world_point: DVec3,
    ) -> bool {
        self.asks(compiled, detector, other, moment, Some(world_point))
    }

    fn asks(
        &mut self,
        compiled: &Compiled,
        detector: &Detector,
        other: ColliderHandle,
        moment: Moment,
        world_point: Option<DVec3>,
    ) -> bool {
        let Some(mask) = detector.mask else {
            return true;
        };
        let Some(query) = self.query(detector, other, moment, world_point) else {
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
        outcome.map_or(DVec3::ZERO, |outcome| real(&outcome.force))
    }

    /// A collider as fields see it, if they do.
    pub(super) fn sample(&self, collider: ColliderHandle, moment: Moment) -> Option<Query> {
        let place = self.probe_of.get(&collider)?;
        Some(self.samples.query(&self.samples.list[*place], moment))
    }

    /// What `other` is to a field; `None` of two that are not sampled.
    fn query(
        &self,
        detector: &Detector,
        other: ColliderHandle,
        moment: Moment,
        world_point: Option<DVec3>,
    ) -> Option<Query> {
        let sample = |collider| self.sample(collider, moment);
        if let Some(mut query) = sample(other) {
            query.world_point = world_point.unwrap_or(query.world_point);
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
