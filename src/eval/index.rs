//! Which programs, and which of their instances, may act at a point.

use super::frames::FrameCache;
use crate::compile::{AnchorId, Compiled, Followed, IndexKind, Key, Program};
use crate::field::{Frame, Frames};
use crate::math::{Real, Vector};
use crate::neighbors::hierarchy;
use crate::rapier::parry::bounding_volume::Aabb;
use crate::rapier::parry::partitioning::Bvh;

/// Fewer programs than this are each asked for every sample.
const FEWEST_FOR_INDEX: usize = 32;

/// Finds programs and their instances by the point they may act at. Follows the compiled form, and
/// what moves; what stands still costs nothing.
#[derive(Debug, Default)]
pub(super) struct ProgramIndex {
    followed: Followed,
    /// By number of a program.
    reaches: Vec<Reach>,
    /// Bounded programs, if there are many.
    tree: Bvh,
    /// By number: whether the tree holds it.
    in_tree: Vec<bool>,
    indexed: bool,
}

impl ProgramIndex {
    /// Takes up where the programs are now.
    pub(super) fn refresh(
        &mut self,
        compiled: &Compiled,
        frames: &mut FrameCache,
        world: &impl Frames,
    ) {
        let roster = &compiled.roster;
        let indexed = compiled.programs.len() >= FEWEST_FOR_INDEX;
        let changed = roster.since(self.followed);
        let changed = changed.filter(|_| indexed == self.indexed);
        self.indexed = indexed;
        self.reaches.resize_with(
            compiled.programs.bound().max(self.reaches.len()),
            Reach::default,
        );
        self.in_tree.resize(self.reaches.len(), false);
        match changed {
            Some(changed) => {
                for number in changed.iter().chain(roster.moving()) {
                    self.renew(compiled, frames, world, *number);
                }
            }
            None => self.renew_all(compiled, frames, world),
        }
        self.followed = roster.now();
    }

    fn renew_all(&mut self, compiled: &Compiled, frames: &mut FrameCache, world: &impl Frames) {
        self.in_tree.fill(false);
        let mut boxes = Vec::new();
        for (number, program) in compiled.programs.iter().filter(|(_, p)| p.has_force) {
            let reach = &mut self.reaches[number as usize];
            reach.refresh(compiled, frames, world, program);
            if self.indexed
                && program.reach.is_some()
                && let Some(bounds) = reach.bounds()
            {
                boxes.push((number as usize, bounds));
                self.in_tree[number as usize] = true;
            }
        }
        self.tree = hierarchy(boxes);
    }

    fn renew(
        &mut self,
        compiled: &Compiled,
        frames: &mut FrameCache,
        world: &impl Frames,
        number: u32,
    ) {
        let place = number as usize;
        let program = compiled.programs.get(number);
        let program = program.filter(|program| program.has_force);
        let reach = &mut self.reaches[place];
        let bounded = match program {
            Some(program) => {
                let moved = reach.refresh(compiled, frames, world, program);
                if !moved && self.in_tree[place] == program.reach.is_some() {
                    return;
                }
                self.indexed && program.reach.is_some()
            }
            None => false,
        };
        let bounds = reach.bounds().filter(|_| bounded);
        match bounds {
            Some(bounds) => self.tree.insert(bounds, number),
            None if self.in_tree[place] => self.tree.remove(number),
            None => {}
        }
        self.in_tree[place] = bounds.is_some();
    }

    /// Whether programs are to be asked for by point; otherwise each one is to be asked.
    pub(super) fn is_in_use(&self) -> bool {
        self.indexed
    }

    /// The numbers of bounded programs that may act at a point, in no order.
    pub(super) fn bounded_at(&self, point: Vector, mut visit: impl FnMut(u32)) {
        let here = Aabb::new(point, point);
        self.tree.intersect_aabb(&here).for_each(&mut visit);
    }

    /// All programs that may act at a point, in their order.
    pub(super) fn at(&self, compiled: &Compiled, point: Vector, found: &mut Vec<(Key, u32)>) {
        found.clear();
        let forces = |number: u32| {
            let program = compiled.programs.get(number);
            let program = program.filter(|program| program.has_force)?;
            Some((program.key(), number))
        };
        if !self.indexed {
            found.extend(
                compiled
                    .programs
                    .iter()
                    .filter_map(|(number, _)| forces(number)),
            );
            return;
        }
        self.bounded_at(point, |number| found.extend(forces(number)));
        found.extend(
            compiled
                .roster
                .unbounded()
                .iter()
                .filter_map(|n| forces(*n)),
        );
        found.sort_unstable();
    }

    pub(super) fn reach(&mut self, number: u32) -> &mut Reach {
        &mut self.reaches[number as usize]
    }
}

/// Which instances of a program may act at a point.
#[derive(Debug, Default)]
pub(super) struct Reach {
    /// Holds all that any instance can reach.
    low: Vector,
    high: Vector,
    balls: Vec<Option<(Vector, Real)>>,
    bvh: Option<Bvh>,
    found: Vec<u32>,
}

impl Reach {
    /// Takes up where the instances are now; whether that is elsewhere.
    fn refresh(
        &mut self,
        compiled: &Compiled,
        frames: &mut FrameCache,
        world: &impl Frames,
        program: &Program,
    ) -> bool {
        for centre in &program.instances.centres {
            frames.get(compiled, world, *centre);
        }
        self.take_up(program, frames.all())
    }

    fn take_up(&mut self, program: &Program, frames: &[Option<Frame>]) -> bool {
        let reach = program.reach.unwrap_or(Real::INFINITY);
        let ball = |centre: &AnchorId| match (&frames[*centre as usize], program.reach) {
            (Some(frame), _) => Some((frame.pose.translation, reach)),
            // Some field hangs elsewhere, and may be there still.
            (None, None) => Some((Vector::ZERO, reach)),
            (None, Some(_)) => None,
        };
        let balls = program.instances.centres.iter().map(ball);
        // Zones that stand still keep their hierarchy.
        if balls.clone().eq(self.balls.iter().copied()) {
            return false;
        }
        self.balls.clear();
        self.balls.extend(balls);
        let bounds = self
            .balls
            .iter()
            .enumerate()
            .filter_map(|(instance, ball)| {
                let (centre, radius) = (*ball)?;
                let extent = Vector::splat(radius);
                Some((instance, Aabb::from_half_extents(centre, extent)))
            });
        let infinity = Vector::splat(Real::INFINITY);
        (self.low, self.high) = bounds
            .clone()
            .fold((infinity, -infinity), |(low, high), (_, bounds)| {
                (low.min(bounds.mins), high.max(bounds.maxs))
            });
        self.bvh = (program.index_kind() == IndexKind::Bvh).then(|| hierarchy(bounds.collect()));
        true
    }

    /// A box that holds all that any instance can reach, if there is anything.
    fn bounds(&self) -> Option<Aabb> {
        let filled = self.low.cmple(self.high).all() && !self.balls.is_empty();
        filled.then(|| Aabb::new(self.low, self.high))
    }

    /// Puts into `found` the instances that may act within a distance of a point, in their order.
    pub(super) fn near(&self, point: Vector, distance: Real, found: &mut Vec<u32>) {
        found.clear();
        let reaches = |ball: &Option<(Vector, Real)>| {
            ball.is_some_and(|(centre, radius)| {
                (point - centre).abs().max_element() <= radius + distance
            })
        };
        match &self.bvh {
            Some(bvh) => {
                let here = Aabb::from_half_extents(point, Vector::splat(distance));
                found.extend(bvh.intersect_aabb(&here));
                found.sort_unstable();
            }
            None => {
                let instances = self.balls.iter().enumerate();
                let near = instances.filter(|(_, ball)| reaches(ball));
                found.extend(near.map(|(instance, _)| instance as u32));
            }
        }
    }

    /// The instances that may act at a point, in their order.
    pub(super) fn at(&mut self, point: Vector) -> &[u32] {
        self.found.clear();
        if point.cmplt(self.low).any() || point.cmpgt(self.high).any() {
            return &self.found;
        }
        match &self.bvh {
            Some(bvh) => {
                let here = Aabb::new(point, point);
                self.found.extend(bvh.intersect_aabb(&here));
                // Sums must not depend on how the hierarchy was built.
                self.found.sort_unstable();
            }
            None => {
                let acts = |ball: &Option<(Vector, Real)>| {
                    ball.is_some_and(|(centre, radius)| {
                        (point - centre).abs().max_element() <= radius
                    })
                };
                let instances = self.balls.iter().enumerate();
                let acting = instances.filter(|(_, ball)| acts(ball));
                self.found
                    .extend(acting.map(|(instance, _)| instance as u32));
            }
        }
        &self.found
    }
}
