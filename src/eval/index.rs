//! An index of the programs that may act at a point.

use super::frames::FrameCache;
use super::instances::InstanceReach;
use super::sampled_world::SampledWorld;
use crate::compile::{Compiled, Followed, Key, Keyed};
use crate::field::Frames;
use crate::math::{Real, Vector};
use crate::neighbors::Hierarchy;
use crate::rapier::parry::bounding_volume::Aabb;

/// With fewer programs than this, each is evaluated at every sample.
const FEWEST_FOR_INDEX: usize = 32;

/// Finds programs and their instances by the points they may act at. It follows changes of the compiled form and
/// anchors that move; programs that stay as they are cost nothing.
#[derive(Debug, Default)]
pub(super) struct ProgramIndex {
    followed: Followed,
    /// The reach of each program, by number.
    reaches: Vec<InstanceReach>,
    /// The bounded programs, if there are many.
    tree: Hierarchy,
    /// For each program, by number: true if the tree has it.
    in_tree: Vec<bool>,
    indexed: bool,
    /// The number of boxes inserted or removed since the tree was built.
    moved: usize,
}

impl ProgramIndex {
    /// Updates reaches and tree to the compiled form and the present anchors.
    pub(super) fn refresh(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        frames: &mut FrameCache,
    ) {
        let compiled = scene.compiled;
        let program_log = &compiled.program_log;
        let indexed = compiled.programs.len() >= FEWEST_FOR_INDEX;
        let changed = program_log.since(self.followed);
        let changed = changed.filter(|_| indexed == self.indexed);
        self.indexed = indexed;
        self.reaches.resize_with(
            compiled.programs.bound().max(self.reaches.len()),
            InstanceReach::default,
        );
        self.in_tree.resize(self.reaches.len(), false);
        match changed {
            // Boxes that are inserted one by one overlap more than needed, so the tree is rebuilt from time to
            // time.
            Some(_) if self.moved > 64 + 4 * compiled.programs.len() => {
                self.renew_all(scene, frames);
            }
            Some(changed) => {
                for (number, serial) in changed {
                    self.renew(scene, frames, *number, Some(*serial));
                }
                for number in program_log.moving() {
                    self.renew(scene, frames, *number, None);
                }
            }
            None => self.renew_all(scene, frames),
        }
        self.followed = program_log.now();
    }

    fn renew_all(&mut self, scene: &SampledWorld<'_, impl Frames>, frames: &mut FrameCache) {
        self.moved = 0;
        self.in_tree.fill(false);
        let programs = scene.compiled.programs.iter();
        for (number, program) in programs.filter(|(_, p)| p.has_force) {
            let reach = &mut self.reaches[number as usize];
            reach.refresh(scene, frames, program);
            let bounded = self.indexed && program.reach.is_some();
            self.in_tree[number as usize] = bounded && reach.bounds().is_some();
        }
        let boxes = self.reaches.iter().zip(&self.in_tree);
        let boxes = boxes.map(|(reach, in_tree)| reach.bounds().filter(|_| *in_tree));
        self.tree.build((0..).zip(boxes));
    }

    fn renew(
        &mut self,
        scene: &SampledWorld<'_, impl Frames>,
        frames: &mut FrameCache,
        number: u32,
        serial: Option<Key>,
    ) {
        let place = number as usize;
        let program = scene.compiled.programs.get(number);
        let program = program.filter(|program| program.has_force);
        let reach = &mut self.reaches[place];
        let bounded = match program {
            Some(program) => {
                let moved = match serial {
                    Some(serial) => reach.change(scene, frames, program, serial),
                    None => reach.refresh(scene, frames, program),
                };
                if !moved && self.in_tree[place] == program.reach.is_some() {
                    return;
                }
                self.indexed && program.reach.is_some()
            }
            None => {
                // The number may be given to another program.
                *reach = InstanceReach::default();
                false
            }
        };
        let bounds = reach.bounds().filter(|_| bounded);
        if self.in_tree[place] {
            self.tree.remove(number);
        }
        if let Some(bounds) = bounds {
            self.tree.insert(bounds, number);
        }
        self.moved += 1;
        self.in_tree[place] = bounds.is_some();
    }

    /// Returns true if programs are to be found by point; otherwise all are to be evaluated.
    pub(super) fn is_in_use(&self) -> bool {
        self.indexed
    }

    /// The numbers of bounded programs that may act at a point, in no order.
    pub(super) fn bounded_at(&self, point: Vector, visit: impl FnMut(u32)) {
        self.bounded_near(point, 0.0, visit);
    }

    /// [`Self::bounded_at`] for all points within a distance of `point`.
    pub(super) fn bounded_near(&self, point: Vector, distance: Real, visit: impl FnMut(u32)) {
        let here = Aabb::from_half_extents(point, Vector::splat(distance));
        self.tree.intersect_aabb(&here).for_each(visit);
    }

    /// All programs that may act at a point, in the order of their keys.
    pub(super) fn at(&self, compiled: &Compiled, point: Vector, found: &mut Vec<(Key, u32)>) {
        found.clear();
        let forces = |number: u32| {
            let program = compiled.programs.get(number);
            let program = program.filter(|program| program.has_force)?;
            Some((program.key(), number))
        };
        if !self.indexed {
            let numbers = compiled.programs.iter().map(|(number, _)| number);
            found.extend(numbers.filter_map(forces));
            return;
        }
        self.bounded_at(point, |number| found.extend(forces(number)));
        let unbounded = compiled.program_log.unbounded().iter().copied();
        found.extend(unbounded.filter_map(forces));
        found.sort_unstable();
    }

    pub(super) fn reach(&mut self, number: u32) -> &mut InstanceReach {
        &mut self.reaches[number as usize]
    }
}
