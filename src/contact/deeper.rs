//! The depth at which parts that rest on each other touch again within a step of swept detection.
//!
//! The point at which two parts rest is Rapier's to hold. But a body that turns on may come down on another corner, one
//! that slides may reach the next face of a mesh, and a third body may press the two together. All of these make the
//! overlap deeper than rest does, so parts at rest are searched for the moment at which that happens.

use std::cell::Cell;

use super::laws::combined;
use super::moving_shape::{MovingShape, fastest_approach};
use super::shape_gap::{TouchDepth, overlap_at};
use super::solve::ContactPoint;
use super::sweep::{Event, Rest, Sweep};
use super::swept_body::SweptWorld;
use crate::math::{DVec3, to_f64};
use crate::rigid::Lookup;

/// Rest does not carry parts deeper into each other than this share of the thinner one, beyond which they may leave
/// on the other side.
const OF_THICKNESS: f64 = 0.25;

/// The least depth, in Rapier's allowed linear error, by which rest counts as disturbed.
const LEAST: f64 = 0.1;

impl Sweep {
    /// The depth at which two parts touch, which is zero unless they rest on each other. `None` if they rest, and cannot
    /// get deeper in `span`.
    pub(super) fn depth_of_touch(
        &self,
        tracks: [usize; 2],
        parts: [usize; 2],
        span: [f64; 2],
        world: &SweptWorld<'_, impl Lookup>,
        looks: &Cell<u64>,
    ) -> Option<TouchDepth> {
        let known = self.resting.get(&parts);
        let carried = self.carried(tracks, parts);
        let bearable = known.map_or_else(|| bearable(carried, world), |rest| rest.bearable);
        if known.is_none() && !self.is_held(tracks, parts) {
            return Some(TouchDepth {
                depth: 0.0,
                bearable,
            });
        }
        if fastest_approach(carried, span) * (span[1] - span[0]) <= bearable {
            return None;
        }
        let depth = known.map_or_else(
            || overlap_at(carried, span[0], looks),
            |rest| rest.spots[0].depth.max(0.0),
        );
        Some(TouchDepth {
            depth: depth + bearable,
            bearable,
        })
    }

    /// Returns true if Rapier held two parts, and they move too little in a step to pass through each other; the next
    /// step then finds an overlap that they get into. Two convex parts that Rapier holds get deeper only by rotation.
    /// Their paths need not be known yet.
    pub(super) fn lies_still(&self, tracks: [usize; 2], parts: [usize; 2], dt: f64) -> bool {
        if !self.is_held(tracks, parts) {
            return false;
        }
        let [a, b] = self.carried(tracks, parts);
        let swing = a.swing_in(dt) + b.swing_in(dt);
        let pieces = a.member.has_pieces() || b.member.has_pieces();
        let way = if pieces {
            a.track.way(dt) - b.track.way(dt)
        } else {
            DVec3::ZERO
        };
        let thin = a.member.thickness.min(b.member.thickness);
        way.length() + swing <= OF_THICKNESS * thin
    }

    /// Notes that the parts of an event rest on each other from then on.
    pub(super) fn rest(
        &mut self,
        event: &Event,
        spots: Vec<ContactPoint>,
        world: &SweptWorld<'_, impl Lookup>,
    ) {
        let pair = self.carried(event.tracks, event.parts);
        let rest = Rest {
            tracks: event.tracks,
            spots,
            resting_speed: resting_speed(pair, world),
            bearable: bearable(pair, world),
        };
        self.resting.insert(event.parts, rest);
    }

    /// Forgets that parts rest on each other where other impacts have made them approach at a moment.
    pub(super) fn disturb(&mut self, pushed: &[usize], batch: &[Event]) {
        let tracks = &self.tracks.list;
        self.resting.retain(|parts, rest| {
            let [a, b] = rest.tracks;
            if !(pushed.contains(&a) || pushed.contains(&b))
                || batch.iter().any(|event| event.parts == *parts)
            {
                return true;
            }
            let [a, b] = [a, b].map(|number| &tracks[number]);
            let approach = |spot: &ContactPoint| {
                let [one, two] = [a, b].map(|it| it.point_velocity(batch[0].time, spot.point));
                (one - two).dot(spot.normal)
            };
            rest.spots
                .iter()
                .all(|spot| approach(spot) <= rest.resting_speed)
        });
    }
}

/// The resting threshold of two parts.
fn resting_speed(pair: [MovingShape<'_>; 2], world: &SweptWorld<'_, impl Lookup>) -> f64 {
    let parts = pair.map(|shape| &shape.member.part);
    let law = combined(parts.map(|part| part.law));
    let bodies = parts.map(|part| part.body);
    law.map_or(0.0, |law| to_f64(world.starts.resting_speed(law, bodies)))
}

/// The way of two parts into each other that does not disturb their rest: that of a step at the resting threshold, and
/// Rapier's allowed linear error.
fn bearable(pair: [MovingShape<'_>; 2], world: &SweptWorld<'_, impl Lookup>) -> f64 {
    let rebound = to_f64(world.starts.rebound());
    let thin = pair[0].member.thickness.min(pair[1].member.thickness);
    let most = (OF_THICKNESS * thin).max(LEAST * rebound);
    (resting_speed(pair, world) * world.dt + rebound).min(most)
}
