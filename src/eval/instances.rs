//! An index of the instances of one program that may act at a point.

use std::collections::HashMap;

use super::frames::FrameCache;
use super::sampled_world::SampledWorld;
use crate::compile::{Bounds, IndexKind, Key, Program};
use crate::field::Frames;
use crate::math::{Real, Vector};
use crate::neighbors::Hierarchy;
use crate::rapier::parry::bounding_volume::Aabb;

type Ball = Option<(Vector, Real)>;

/// Balls around the instances of a program, or a hierarchy of these balls if there are many.
#[derive(Debug, Default)]
pub(super) struct InstanceReach {
    /// A box around all places at which any instance can act.
    extent: Bounds,
    /// The ball of each instance at the last build; empty once single terms were changed.
    balls: Vec<Ball>,
    bvh: Option<Hierarchy>,
    leaves: Leaves,
    found: Vec<u32>,
}

/// The instance of each leaf of a hierarchy. Instances change their numbers when terms before them come and go,
/// so they are identified by their term and their number within it.
#[derive(Debug, Default)]
struct Leaves {
    /// For each leaf, the term of its instance when the hierarchy was built.
    built: Vec<Key>,
    /// The leaves of the terms that were changed since then.
    changed: HashMap<Key, Vec<u32>>,
    /// The instance of each leaf; filled when the first term is changed.
    instances: Vec<(Key, u32)>,
    free: Vec<u32>,
}

impl Leaves {
    fn of(serials: &[Key]) -> Self {
        Leaves {
            built: serials.to_vec(),
            ..Leaves::default()
        }
    }

    /// Frees the leaves of a term, and returns them.
    fn take(&mut self, serial: Key) -> Vec<u32> {
        if self.instances.is_empty() {
            let mut within = 0;
            for (leaf, serial) in self.built.iter().enumerate() {
                let follows = leaf > 0 && self.built[leaf - 1] == *serial;
                within = if follows { within + 1 } else { 0 };
                self.instances.push((*serial, within));
            }
        }
        let taken = self.changed.insert(serial, Vec::new()).unwrap_or_else(|| {
            let start = self.built.partition_point(|known| *known < serial);
            let end = self.built.partition_point(|known| *known <= serial);
            (start as u32..end as u32).collect()
        });
        self.free.extend(taken.iter().rev());
        taken
    }

    /// A leaf for the next instance of a term whose leaves were freed.
    fn add(&mut self, serial: Key) -> u32 {
        let of_term = self.changed.entry(serial).or_default();
        let instance = (serial, of_term.len() as u32);
        let leaf = self.free.pop().unwrap_or(self.instances.len() as u32);
        match self.instances.get_mut(leaf as usize) {
            Some(known) => *known = instance,
            None => self.instances.push(instance),
        }
        of_term.push(leaf);
        leaf
    }
}

impl InstanceReach {
    /// Updates the balls to the present anchors. Returns true if any has changed.
    pub(super) fn refresh(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        frames: &mut FrameCache,
        program: &Program,
    ) -> bool {
        let mut same = self.balls.len() == program.instances.len();
        if !same {
            // The leaves would refer to other instances.
            self.bvh = None;
        }
        self.balls.resize(program.instances.len(), None);
        for (ball, centre) in self.balls.iter_mut().zip(&program.instances.centres) {
            let now = ball_at(program, frames.get(scene, *centre));
            same &= *ball == now;
            *ball = now;
        }
        // The hierarchy of instances that did not move is kept.
        if !same {
            self.build(program);
        }
        !same
    }

    fn build(&mut self, program: &Program) {
        self.extent = Bounds::default();
        for (centre, radius) in self.balls.iter().flatten() {
            self.extent.add(*centre, *radius);
        }
        self.leaves = Leaves::default();
        if program.index_kind() != IndexKind::Bvh {
            self.bvh = None;
            return;
        }
        let bvh = self.bvh.get_or_insert_default();
        let boxes = self.balls.iter().map(|ball| {
            let (centre, radius) = (*ball)?;
            Some(box_of(centre, radius))
        });
        bvh.build((0..).zip(boxes));
        if program.instances.moving == 0 {
            self.leaves = Leaves::of(&program.instances.serials);
        }
    }

    /// Updates the instances of one term, the count of which may have changed. Returns true if anything has changed.
    /// `program` already has the change.
    pub(super) fn change(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        frames: &mut FrameCache,
        program: &Program,
        serial: Key,
    ) -> bool {
        let known = !self.leaves.built.is_empty() && program.instances.moving == 0;
        let kept = known && program.index_kind() == IndexKind::Bvh;
        let Some(bvh) = self.bvh.as_mut().filter(|_| kept) else {
            return self.refresh(scene, frames, program);
        };
        self.balls.clear();
        for leaf in self.leaves.take(serial) {
            bvh.remove(leaf);
        }
        for place in program.instances.of_term(serial) {
            let centre = program.instances.centres[place];
            let ball = ball_at(program, frames.get(scene, centre));
            let leaf = self.leaves.add(serial);
            if let Some((centre, radius)) = ball {
                self.extent.add(centre, radius);
                bvh.insert(box_of(centre, radius), leaf);
            }
        }
        true
    }

    /// A box around all places at which any instance can act; `None` if there are none.
    pub(super) fn bounds(&self) -> Option<Aabb> {
        self.extent.filled()
    }

    /// Lists in `found` the instances that may act within a distance of a point, in their order.
    pub(super) fn near(
        &self,
        program: &Program,
        point: Vector,
        distance: Real,
        found: &mut Vec<u32>,
    ) {
        found.clear();
        let Some(bvh) = &self.bvh else {
            let reaches = |ball: &Ball| {
                ball.is_some_and(|(centre, radius)| {
                    (point - centre).abs().max_element() <= radius + distance
                })
            };
            let instances = self.balls.iter().enumerate();
            let near = instances.filter(|(_, ball)| reaches(ball));
            found.extend(near.map(|(instance, _)| instance as u32));
            return;
        };
        let here = Aabb::from_half_extents(point, Vector::splat(distance));
        found.extend(bvh.intersect_aabb(&here));
        if !self.leaves.instances.is_empty() {
            for number in &mut *found {
                let (serial, within) = self.leaves.instances[*number as usize];
                *number = program.instances.start_of(serial) + within;
            }
        }
        // Sorted, since sums must not depend on how the hierarchy was built.
        found.sort_unstable();
    }

    /// [`Self::near`] with a test of the bounds first, for points that are mostly out of reach of all.
    pub(super) fn around(
        &self,
        program: &Program,
        point: Vector,
        distance: Real,
        found: &mut Vec<u32>,
    ) {
        let (low, high) = (self.extent.low - distance, self.extent.high + distance);
        if point.cmplt(low).any() || point.cmpgt(high).any() {
            found.clear();
            return;
        }
        self.near(program, point, distance, found);
    }

    /// The instances that may act at a point, in their order.
    pub(super) fn at(&mut self, program: &Program, point: Vector) -> &[u32] {
        let mut found = std::mem::take(&mut self.found);
        self.around(program, point, 0.0, &mut found);
        self.found = found;
        &self.found
    }
}

/// The ball within which an instance can act, given the frame of its centre.
fn ball_at(program: &Program, centre: Option<crate::field::Frame>) -> Ball {
    let reach = program.reach.unwrap_or(Real::INFINITY);
    match (centre, program.reach) {
        (Some(frame), _) => Some((frame.pose.translation, reach)),
        // Without a common reach, fields with another anchor may still act.
        (None, None) => Some((Vector::ZERO, reach)),
        (None, Some(_)) => None,
    }
}

fn box_of(centre: Vector, radius: Real) -> Aabb {
    Aabb::from_half_extents(centre, Vector::splat(radius))
}
