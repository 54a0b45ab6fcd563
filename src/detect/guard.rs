//! Detection fields under operators: whether they act on what approaches.

use std::collections::HashMap;

use crate::compile::{Compiled, Detector};
use crate::eval::{Machine, Moment, Probes};
use crate::field::{Frame, Frames, Motion};
use crate::math::{ColliderHandle, ColliderSet, DVec3, RigidBodySet};

/// The present state of what guards may ask.
#[derive(Debug, Default)]
pub(super) struct Guards {
    machine: Machine,
    probes: Probes,
    probe_of: HashMap<ColliderHandle, usize>,
    frames: Vec<Option<Frame>>,
}

impl Guards {
    pub(super) fn refresh(
        &mut self,
        compiled: &Compiled,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        probes: impl FnOnce(&mut Probes),
    ) {
        probes(&mut self.probes);
        self.probe_of.clear();
        for (place, probe) in self.probes.list.iter().enumerate() {
            self.probe_of
                .extend(probe.collider.map(|collider| (collider, place)));
        }
        self.frames.clear();
        let world = (bodies, colliders);
        self.frames
            .extend(compiled.anchors.iter().map(|anchor| world.frame(anchor)));
    }

    /// Whether a detection field is still there, where `other` is sampled, after its operators:
    /// not replaced, cut out or outside its region. What is no probe (a fixed or kinematic
    /// collider) is judged from the other side only.
    pub(super) fn lets_through(
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
        let Some(guard) = detector.guard else {
            return true;
        };
        let Some(place) = self.probe_of.get(&other) else {
            return false;
        };
        let mut query = self.probes.query(&self.probes.list[*place], moment);
        query.world_point = world_point.unwrap_or(query.world_point);
        let program = &compiled.programs[guard.program as usize];
        let instance = guard.instance as usize;
        let motion = Motion::of(&query);
        let outcome = self
            .machine
            .run(program, instance, &self.frames, &query, &motion);
        outcome.is_some_and(|outcome| outcome.leaves & (1_u64 << guard.leaf.min(63)) != 0)
    }
}
