//! How far forces can reach at all.

use super::anchors::Anchors;
use super::ordered::Ordered;
use super::{Compiled, Program, RadialBatch};
use crate::compile::facts::Facts;
use crate::field::Frames;
use crate::math::{Real, Vector};
use crate::rapier::parry::bounding_volume::Aabb;

/// A box.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds {
    low: Vector,
    high: Vector,
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
    fn add(&mut self, centre: Vector, radius: Real) {
        self.low = self.low.min(centre - Vector::splat(radius));
        self.high = self.high.max(centre + Vector::splat(radius));
    }
}

/// Holds all that fields in the world's frame can reach. Grows with every change, and is made anew
/// after as many changes as there are terms.
#[derive(Debug, Default)]
pub(super) struct Extent {
    still: Bounds,
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

/// Where forces can be felt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Reach {
    /// Nowhere.
    Nowhere,
    /// In this box at most.
    Within(Aabb),
    /// Anywhere.
    Everywhere,
}

impl Compiled {
    /// Where any force can be felt, the anchors being where they are in `world`. Looks up only
    /// those that hang on bodies and colliders.
    pub(crate) fn reach(&self, world: &impl Frames) -> Reach {
        if self.tally.any(Facts::UNBOUNDED) {
            return Reach::Everywhere;
        }
        let mut bounds = self.extent.still;
        let mut add = |anchor: u32, radius: Real| {
            if !self.anchors.stands_still(anchor)
                && let Some(frame) = world.frame(&self.anchors[anchor as usize])
            {
                bounds.add(frame.pose.translation, radius);
            }
        };
        if self.tally.any(Facts::MOVES) {
            let moving = self.radials.iter().filter(|(_, batch)| batch.moving > 0);
            for (_, batch) in moving {
                let range = batch.range.unwrap_or(Real::INFINITY);
                batch
                    .sources
                    .iter()
                    .for_each(|source| add(source.anchor, range));
            }
            let programs = self.roster.moving().iter();
            for program in programs.filter_map(|number| self.programs.get(*number)) {
                let reach = program.reach.unwrap_or(Real::INFINITY);
                program
                    .instances
                    .centres
                    .iter()
                    .for_each(|centre| add(*centre, reach));
            }
        }
        match bounds.low.cmple(bounds.high).all() {
            true => Reach::Within(Aabb::new(bounds.low, bounds.high)),
            false => Reach::Nowhere,
        }
    }
}
