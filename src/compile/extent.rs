//! A bound of the space in which fields that stand still can act.

use super::anchors::{AnchorId, Anchors};
use super::entries::{RadialBatch, RadialSource};
use super::instances::Instances;
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

/// The smallest box around the balls in which fields with a finite reach that are anchored to the world can act.
#[derive(Debug, Default)]
pub(super) struct Extent {
    pub still: Bounds,
    /// True if a ball was removed that reached to the border of the box.
    pub shrinks: bool,
}

impl Extent {
    pub(super) fn add_sources(&mut self, batch: &RadialBatch, anchors: &Anchors) {
        for (centre, range) in of_sources(&batch.sources, batch.range, anchors) {
            self.still.add(centre, range);
        }
    }

    pub(super) fn add_instances(&mut self, program: &Program, anchors: &Anchors) {
        for (centre, reach) in of_instances(&program.instances, bound(program), anchors) {
            self.still.add(centre, reach);
        }
    }

    /// Notes that balls are removed; their anchors must still be there.
    pub(super) fn remove(&mut self, balls: impl Iterator<Item = (Vector, Real)>) {
        for (centre, radius) in balls {
            let mut own = Bounds::default();
            own.add(centre, radius);
            let is_inside = own.low.cmpgt(self.still.low) & own.high.cmplt(self.still.high);
            self.shrinks |= !is_inside.all();
        }
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
    }
}

/// The balls in which sources that stand still can act.
pub(super) fn of_sources<'a>(
    sources: &'a [RadialSource],
    range: Option<Real>,
    anchors: &'a Anchors,
) -> impl Iterator<Item = (Vector, Real)> + 'a {
    let ids = sources.iter().map(|source| source.anchor);
    balls(ids, range, anchors)
}

/// The balls in which instances that stand still can act.
pub(super) fn of_instances<'a>(
    instances: &'a Instances,
    reach: Option<Real>,
    anchors: &'a Anchors,
) -> impl Iterator<Item = (Vector, Real)> + 'a {
    balls(instances.centres.iter().copied(), reach, anchors)
}

/// The finite reach of the forces of a program.
pub(super) fn bound(program: &Program) -> Option<Real> {
    program.reach.filter(|_| program.has_force)
}

fn balls<'a>(
    ids: impl Iterator<Item = AnchorId> + 'a,
    radius: Option<Real>,
    anchors: &'a Anchors,
) -> impl Iterator<Item = (Vector, Real)> + 'a {
    ids.filter_map(move |id| {
        let still = anchors.stands_still(id);
        let centre = || anchors[id as usize].local_pose().translation;
        Some((still.then(centre)?, radius?))
    })
}
