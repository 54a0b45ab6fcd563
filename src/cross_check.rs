//! The cross-check: the contacts of detection fields are compared with those of Rapier's narrow phase at the same
//! poses, and the touches of swept detection with Parry's distance at their times.
//!
//! The contacts that Rapier reports after a step belong to the poses before it. So the contacts that fields found
//! before a step are kept, and compared after it.

mod answers;
mod bands;
mod comparable;
mod counts;
mod disagreement;
mod judge;
mod report;
mod settings;
mod sighting;
mod touches;

pub use answers::{Answered, Answers};
pub use counts::{ContactCounts, NotComparable, TouchCounts, TouchesNotComparable};
pub use disagreement::{Difference, Disagreement};
pub use report::CrossCheckReport;
pub use settings::CrossCheck;

pub(crate) use comparable::{Judging, Watched};
pub(crate) use sighting::Expected;

use std::collections::BTreeMap;

use bands::{Bands, Sizes};
use comparable::is_watched;
use judge::{FoundBy, Placed, Verdict, judge};
use sighting::{RapierPoint, spots};
use touches::TouchJudge;

use crate::contact::{FieldContact, TouchRecord, in_order};
use crate::math::{ColliderHandle, Pose, Real, Vector, to_f64};
use crate::rapier::dynamics::IntegrationParameters;
use crate::rapier::geometry::NarrowPhase;
use crate::rigid::{Lookup, world_pose};

/// The fields' contacts and the sleeping bodies before a step, for comparison after it.
pub(crate) fn expect(
    settings: &CrossCheck,
    contacts: &[FieldContact],
    world: &impl Lookup,
) -> Expected {
    let contacts = contacts.iter();
    let watched = contacts.filter(|contact| settings.watches(contact.colliders));
    let asleep = world.bodies().filter(|(_, body)| body.is_sleeping());
    Expected {
        contacts: watched.copied().collect(),
        asleep: asleep.map(|(handle, _)| handle).collect(),
    }
}

/// A pair's contact as the fields found it, and all contact points that Rapier holds for it.
#[derive(Default)]
struct SeenPair {
    colliders: [ColliderHandle; 2],
    ours: Option<FieldContact>,
    theirs: Vec<RapierPoint>,
}

type Key = [(u32, u32); 2];

fn key(pair: [ColliderHandle; 2]) -> Key {
    pair.map(ColliderHandle::into_raw_parts)
}

impl CrossCheckReport {
    /// Records settings of Rapier under which its contacts do not belong to the poses before the step.
    pub(crate) fn note(&mut self, settings: &CrossCheck, parameters: &IntegrationParameters) {
        self.recycling |= settings.lets_recycle && parameters.contact_recycling;
        self.ccd_substeps |= parameters.max_ccd_substeps > 1;
    }

    /// Compares the expected contacts with those of Rapier's step. `pose_before` returns the world pose that a collider
    /// had when that step began.
    pub(crate) fn compare(
        &mut self,
        judging: &Judging<'_, impl Lookup>,
        pose_before: impl Fn(ColliderHandle) -> Option<Pose>,
    ) {
        self.steps += 1;
        self.disagreements.clear();
        self.last_step = ContactCounts::default();
        self.last_touches = TouchCounts::default();
        self.last_step.not_comparable.sensor = judging.sensors();
        let mut pairs: BTreeMap<Key, SeenPair> = BTreeMap::new();
        for our in &judging.expected.contacts {
            let seen = pairs.entry(key(our.colliders)).or_default();
            (seen.colliders, seen.ours) = (our.colliders, Some(*our));
        }
        for pair in judging.narrow_phase.contact_pairs() {
            let handles = in_order([pair.collider1, pair.collider2]);
            if !judging.watches(handles) {
                continue;
            }
            let found = spots(pair, judging.world, &pose_before).unwrap_or_default();
            let overlaps = found.iter().any(|spot| spot.depth > 0.0);
            if overlaps || pairs.contains_key(&key(handles)) {
                let seen = pairs.entry(key(handles)).or_default();
                (seen.colliders, seen.theirs) = (handles, found);
            }
        }
        for seen in pairs.into_values() {
            self.weigh(judging, &seen, &pose_before);
        }
        self.total.add(self.last_step);
    }

    /// Adds the impulses by which the fields and Rapier answered contacts in a step.
    pub(crate) fn add_answers(
        &mut self,
        settings: &CrossCheck,
        watched: &Watched,
        contacts: &[FieldContact],
        narrow_phase: &NarrowPhase,
        world: &impl Lookup,
    ) {
        let ours = contacts.iter();
        for contact in ours.filter(|contact| settings.watches(contact.colliders)) {
            self.answers.add_field(contact, world);
        }
        for pair in narrow_phase.contact_pairs() {
            let handles = in_order([pair.collider1, pair.collider2]);
            if is_watched(settings, watched, handles) {
                self.answers.add_rapier(pair, world);
            }
        }
    }

    /// Compares the two sides of one pair, and counts the result.
    fn weigh(
        &mut self,
        judging: &Judging<'_, impl Lookup>,
        seen: &SeenPair,
        pose_before: impl Fn(ColliderHandle) -> Option<Pose>,
    ) {
        let (world, pair) = (judging.world, seen.colliders);
        let [one, two] = pair.map(|handle| world.collider(handle).zip(pose_before(handle)));
        let (Some(one), Some(two)) = (one, two) else {
            self.last_step.not_comparable.removed += 1;
            return;
        };
        let placed = Placed {
            colliders: [one.0, two.0],
            poses: [one.1, two.1],
        };
        let deepest = |a: &RapierPoint, b: &RapierPoint| a.depth.total_cmp(&b.depth);
        let their = seen.theirs.iter().copied().max_by(deepest);
        let ours = seen.ours.map(|our| (our.world_point, our.depth));
        let place = ours.or(their.map(|spot| (spot.world_point, spot.depth)));
        let Some((world_point, depth)) = place else {
            return;
        };
        let sizes = Sizes::of_colliders(placed.colliders);
        let bands = Bands::at(&sizes, world_point, depth, &seen.theirs);
        let reason = judging.obstacle(pair, seen.ours.is_some(), &seen.theirs, &bands);
        if let Some(reason) = reason {
            *reason(&mut self.last_step.not_comparable) += 1;
            return;
        }
        let verdict = judge(seen.ours.as_ref(), &seen.theirs, &bands, &placed);
        self.record(&verdict);
        self.notify(judging.settings, pair, world_point, verdict.differences);
    }

    fn record(&mut self, verdict: &Verdict) {
        let counts = &mut self.last_step;
        match verdict.found {
            FoundBy::Neither => {}
            FoundBy::WithinBand => counts.within_band += 1,
            FoundBy::OnlyField => counts.only_field += 1,
            FoundBy::OnlyRapier => counts.only_rapier += 1,
            FoundBy::Both => counts.both += 1,
            FoundBy::Ambiguous => {
                counts.both += 1;
                counts.ambiguous += 1;
            }
        }
        for (difference, _) in &verdict.differences {
            match difference {
                Difference::Depth { .. } => counts.depth += 1,
                Difference::Normal { .. } => counts.normal += 1,
                Difference::Point { .. } => counts.point += 1,
                _ => {}
            }
        }
        let largest = [
            &mut self.depth_error,
            &mut self.normal_error,
            &mut self.point_error,
        ];
        let sums = largest.into_iter().zip(&mut self.sums);
        for ((largest, sum), error) in sums.zip(verdict.errors) {
            let error: Real = error.unwrap_or(0.0);
            *largest = largest.max(error);
            *sum += to_f64(error);
        }
        self.judged += u64::from(verdict.errors[1].is_some());
        self.worst = self.worst.max(verdict.worst);
    }

    /// Lists the differences of a pair, each with its band, and calls the listener.
    fn notify(
        &mut self,
        settings: &CrossCheck,
        colliders: [ColliderHandle; 2],
        world_point: Vector,
        differences: Vec<(Difference, Real)>,
    ) {
        for (difference, band) in differences {
            let found = Disagreement {
                step: self.steps,
                world_point,
                colliders,
                difference,
                band,
            };
            self.disagreements.push(found);
            self.first = self.first.or(Some(found));
            if let Some(listener) = &settings.listener {
                listener(&found);
            }
        }
    }

    /// Judges the touches of a step of length `dt`. `world` is as Rapier left it; `pose_before` returns the world pose
    /// that a collider had when that step began.
    pub(crate) fn compare_touches(
        &mut self,
        settings: &CrossCheck,
        records: &[TouchRecord],
        world: &impl Lookup,
        dt: Real,
        pose_before: impl Fn(ColliderHandle) -> Option<Pose>,
    ) {
        let mut judge = TouchJudge::new(to_f64(dt));
        for record in records.iter().filter(|it| settings.watches(it.colliders)) {
            let [Some(one), Some(two)] = record.colliders.map(|it| world.collider(it)) else {
                self.last_touches.not_comparable.removed += 1;
                continue;
            };
            let pose_now = |it| world_pose(world.collider(it)?, |body| world.body(body));
            let ends = record.colliders.map(|it| [pose_before(it), pose_now(it)]);
            let outcome = judge.weigh(record, [one, two], ends);
            self.last_touches.add(outcome.counts);
            let (colliders, world_point) = (record.colliders, record.world_point);
            self.notify(settings, colliders, world_point, outcome.differences);
        }
        self.touches.add(self.last_touches);
    }
}
