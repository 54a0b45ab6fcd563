//! A bound of the places where a compiled set can act, with all anchors where they are now.

use super::compiled::Compiled;
use super::facts::Facts;
use crate::field::{Frame, Frames};
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
        if self.tally.any(Facts::UNBOUNDED) {
            return FieldReach::Everywhere;
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
                for source in &batch.sources {
                    add(source.anchor, range);
                }
            }
            let programs = self.roster.moving().iter();
            for program in programs.filter_map(|number| self.programs.get(*number)) {
                let reach = program.reach.unwrap_or(Real::INFINITY);
                for centre in &program.instances.centres {
                    add(*centre, reach);
                }
            }
        }
        bounds
            .filled()
            .map_or(FieldReach::Nowhere, FieldReach::Within)
    }
}
