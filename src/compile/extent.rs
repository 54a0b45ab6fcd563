//! A bound of the space in which fields that stand still can act.

use super::anchors::Anchors;
use super::entries::RadialBatch;
use super::ordered::Ordered;
use super::program::Program;
use crate::math::{Real, Vector};
use crate::rapier::parry::bounding_volume::Aabb;

/// A box; empty by default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub low: Vector,
    pub high: Vector,
}

impl Default for Bounds {
    fn default() -> Self {
        let infinity = Vector::splat(Real::INFINITY);
        Bounds {
            low: infinity,
            high: -infinity,
        }
    }
}

impl Bounds {
    /// Enlarges the box by one around a ball.
    pub(crate) fn add(&mut self, centre: Vector, radius: Real) {
        self.low = self.low.min(centre - Vector::splat(radius));
        self.high = self.high.max(centre + Vector::splat(radius));
    }

    /// The box; `None` if it is empty.
    pub(crate) fn filled(&self) -> Option<Aabb> {
        let filled = self.low.cmple(self.high).all();
        filled.then(|| Aabb::new(self.low, self.high))
    }
}

/// A box that holds all places at which fields with a finite reach that are anchored to the world can act. Changes
/// only enlarge it, so it is computed anew once changes outnumber the terms by far.
#[derive(Debug, Default)]
pub(super) struct Extent {
    pub still: Bounds,
    changes: usize,
}

impl Extent {
    pub(super) fn add_sources(&mut self, batch: &RadialBatch, anchors: &Anchors) {
        self.changes += 1;
        let Some(range) = batch.range else { return };
        for source in &batch.sources {
            if anchors.stands_still(source.anchor) {
                let pose = anchors[source.anchor as usize].local_pose();
                self.still.add(pose.translation, range);
            }
        }
    }

    pub(super) fn add_instances(&mut self, program: &Program, anchors: &Anchors) {
        self.changes += 1;
        let Some(reach) = program.reach.filter(|_| program.has_force) else {
            return;
        };
        for centre in &program.instances.centres {
            if anchors.stands_still(*centre) {
                let pose = anchors[*centre as usize].local_pose();
                self.still.add(pose.translation, reach);
            }
        }
    }

    pub(super) fn is_stale(&self, terms: usize) -> bool {
        self.changes > 2 * terms + 64
    }

    pub(super) fn renew(
        &mut self,
        radials: &Ordered<RadialBatch>,
        programs: &Ordered<Program>,
        anchors: &Anchors,
    ) {
        *self = Extent::default();
        for (_, batch) in radials.iter() {
            self.add_sources(batch, anchors);
        }
        for (_, program) in programs.iter() {
            self.add_instances(program, anchors);
        }
        self.changes = 0;
    }
}
