//! A bound of the places where a compiled set can act, with all anchors where they are now.

use super::anchors::NO_ANCHOR;
use super::compiled::Compiled;
use super::extent::Bounds;
use super::term_flags::TermFlags;
use crate::field::{Anchor, Frame, Frames};
use crate::math::{Real, Vector};
use crate::rapier::parry::bounding_volume::Aabb;

/// A bound of the places where a compiled set can give a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FieldReach {
    /// Nowhere.
    Nowhere,
    /// In this box at most.
    Within(Aabb),
    /// Anywhere.
    Everywhere,
}

impl Compiled {
    /// The frame and range of the first radial field that is anchored to a body or collider.
    pub(crate) fn first_moving(&self, world: &impl Frames) -> Option<(Frame, Real)> {
        let moves = |anchor: u32| !self.anchors.stands_still(anchor);
        let batches = self.radials.iter().filter(|(_, batch)| batch.moving > 0);
        let (batch, source) = batches
            .flat_map(|(_, batch)| batch.sources.iter().map(move |source| (batch, source)))
            .find(|(_, source)| moves(source.anchor))?;
        let frame = world.frame(&self.anchors[source.anchor as usize])?;
        Some((frame, batch.range.unwrap_or(Real::INFINITY)))
    }

    /// Returns true if a force that depends on volumes may act somewhere in a box.
    pub(crate) fn displaces_near(&self, world: &impl Frames, [low, high]: [Vector; 2]) -> bool {
        let programs = self.programs.iter().map(|(_, program)| program);
        let mut displacing = programs.filter(|program| program.displaces());
        displacing.any(|program| {
            let reach = program.reach.unwrap_or(Real::INFINITY);
            let mut centres = program.instances.centres.iter();
            centres.any(|centre| {
                let frame = world.frame(&self.anchors[*centre as usize]);
                frame.is_some_and(|frame| {
                    let centre = frame.pose.translation;
                    (centre.clamp(low, high) - centre).length() <= reach
                })
            })
        })
    }

    /// A bound of the places where any force can act, with the anchors at their places in `world`. Looks up
    /// only anchors on bodies and colliders.
    pub(crate) fn reach(&self, world: &impl Frames) -> FieldReach {
        if self.flag_counts.any(TermFlags::UNBOUNDED) {
            return FieldReach::Everywhere;
        }
        self.reach_beside(self.extent.still, world, |_| true)
    }

    /// Returns true if a force is anchored to a body or collider chosen by `is_wanted`.
    pub(crate) fn moves_by(&self, is_wanted: impl Fn(&Anchor) -> bool) -> bool {
        self.moving_ranges().any(|(anchor, _)| is_wanted(anchor))
    }

    /// A bound of the places where forces can act that are anchored to bodies and colliders chosen by `is_wanted`.
    pub(crate) fn moving_reach(
        &self,
        world: &impl Frames,
        is_wanted: impl Fn(&Anchor) -> bool,
    ) -> FieldReach {
        self.reach_beside(Bounds::default(), world, is_wanted)
    }

    /// A bound of `bounds` and of the places where forces can act that are anchored to bodies and colliders chosen by
    /// `is_wanted`.
    fn reach_beside(
        &self,
        mut bounds: Bounds,
        world: &impl Frames,
        is_wanted: impl Fn(&Anchor) -> bool,
    ) -> FieldReach {
        for (anchor, range) in self.moving_ranges().filter(|it| is_wanted(it.0)) {
            if range == Real::INFINITY {
                return FieldReach::Everywhere;
            }
            if let Some(frame) = world.frame(anchor) {
                bounds.add(frame.pose.translation, range);
            }
        }
        bounds
            .filled()
            .map_or(FieldReach::Nowhere, FieldReach::Within)
    }

    /// The anchors of forces that are on bodies and colliders, with the range about each: infinite if there is none.
    fn moving_ranges(&self) -> impl Iterator<Item = (&Anchor, Real)> {
        let batches = self.radials.iter().filter(|(_, batch)| batch.moving > 0);
        let sources = batches.flat_map(|(_, batch)| {
            let range = batch.range.unwrap_or(Real::INFINITY);
            let ids = batch.sources.iter().map(|source| source.anchor);
            ids.map(move |id| (id, range))
        });
        let programs = self.program_log.moving().iter();
        let programs = programs.filter_map(|number| self.programs.get(*number));
        let instances = programs.flat_map(|program| {
            // Without a bound, fields beside the centre may be those that move.
            let (range, ids) = match program.reach {
                Some(range) => (range, &program.instances.centres),
                None => (Real::INFINITY, &program.instances.anchors),
            };
            ids.iter().map(move |id| (*id, range))
        });
        let all = sources.chain(instances);
        let moving = all.filter(|(id, _)| *id != NO_ANCHOR && !self.anchors.stands_still(*id));
        moving.map(|(id, range)| (&self.anchors[id as usize], range))
    }
}
