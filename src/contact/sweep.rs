//! Swept detection: all touches within a step, in the order of time, each answered when it happens.
//!
//! Rapier has moved the bodies. Their motion over the step is known exactly, or as a chord if something else pushed
//! them. Touches are predicted and queued. The earliest is taken: its bodies are put where they were then, pushed by
//! the law, and move on freely for the rest of the step; earlier predictions for them are discarded and made anew.
//! Touches at the same moment are answered together.

use std::cell::Cell;
use std::collections::{BTreeMap, HashMap, HashSet};

use super::FieldContact;
use super::field_mask::{DetectionFields, FieldMasks};
use super::hooks::PairOutcomes;
use super::moving_shape::MovingShape;
use super::near_pairs::{NearPairs, Place};
use super::ownership::PairOwner;
use super::rules::{Pairs, in_order};
use super::separation::Separations;
use super::shape_gap::may_touch;
use super::solve::ContactPoint;
use super::starts::Starts;
use super::swept_body::{SweptWorld, near_each_other};
use super::swept_parts::SweptBodies;
use super::time_of_impact::time_of_impact;
use super::touch_record::TouchRecord;
use crate::bridge::Push;
use crate::math::{ColliderHandle, from_dpose3, from_dvec3, from_f64};
use crate::rapier::geometry::{Aabb, BoundingVolume};
use crate::rigid::{Lookup, MidStepImpact};

/// The work of an impact, in looks at the gap between two parts.
const WORK_OF_IMPACT: u64 = 4;

/// The number of colliders for whose work there is always room.
const FEW_PARTS: u64 = 20;

/// Touches closer in time than this share of the step happen at once, because rounding decides which is first.
const AT_ONCE: f64 = 1e-12;

/// A pair of parts that loses speed, or approaches after its answer, and meets more often than this in one step would
/// meet endlessly. From then on it is left alone for `dt` / [`LOOKS`] after each impact.
const LASTING: u32 = 32;
const LOOKS: f64 = 64.0;

/// The state of a swept detection; its buffers and distances are kept between steps.
#[derive(Debug, Default)]
pub(super) struct Sweep {
    pub(super) tracks: SweptBodies,
    /// Pairs that Rapier held at rest. Until one of the bodies is hit in this step, they rest.
    held: Pairs,
    separations: Separations,
    /// By time. The new touch of a pair replaces a void one at the same time.
    queue: BTreeMap<(u64, [usize; 2]), Event>,
    /// Pairs of parts, by index, that need no more answers in this step.
    pub(super) settled: HashSet<[usize; 2]>,
    /// Pairs of parts that came to rest on each other within the step.
    pub(super) resting: HashMap<[usize; 2], Rest>,
    /// For pairs of parts that may meet endlessly: the number of impacts, and the time until which they are left
    /// alone.
    pub(super) lasting: HashMap<[usize; 2], (u32, f64)>,
    /// Pairs of bodies that may meet, by the bounds of the motion predicted at the start of the step.
    pub(super) near: NearPairs,
    places: Vec<Place>,
    /// The indices of bodies that an impact has put on another path, with the bounds of the rest of it.
    pub(super) redirected: Vec<(usize, Aabb)>,
    pub(super) moved: Vec<bool>,
    /// Pairs whose impulses were not finite, and were left out.
    pub(super) not_finite: Vec<[ColliderHandle; 2]>,
    /// The work after the first prediction of this step: looks at the gap between two parts, and what takes as long.
    pub(super) work: u64,
    /// The touches of the step; `None` unless the cross-check needs them.
    pub(super) log: Option<Vec<TouchRecord>>,
}

/// A predicted touch. Tracks and parts are indices into [`SweptBodies`]; it is void once a generation has changed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub time: f64,
    pub tracks: [usize; 2],
    pub parts: [usize; 2],
    generations: [u32; 2],
}

impl Event {
    /// The key by which events are ordered: bits of times, which are never negative, have the order of the times.
    fn key(&self) -> (u64, [usize; 2]) {
        (self.time.to_bits(), self.parts)
    }
}

/// Two parts at rest.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    pub tracks: [usize; 2],
    /// The points at which they touched when they came to rest; the first one is the deepest.
    pub spots: Vec<ContactPoint>,
    /// The resting threshold.
    pub resting_speed: f64,
    /// The further depth that rest explains.
    pub bearable: f64,
}

/// The inputs of a sweep.
pub(super) struct SweepScene<'a> {
    /// The detection fields, and the moment at which the step began.
    pub fields: DetectionFields<'a>,
    pub masks: Option<&'a mut FieldMasks>,
    pub starts: &'a Starts,
    /// The owner of a contact's pair.
    pub owner: &'a dyn Fn(&FieldContact) -> PairOwner,
    /// The decisions of the hooks on pairs of the fields during Rapier's step.
    pub outcomes: &'a PairOutcomes,
    /// See [`FieldSettings::swept_work`](crate::pipeline::FieldSettings::swept_work).
    pub work: u32,
}

impl Sweep {
    /// Finds and answers all touches in a step of length `dt`. Adds the contacts to `contacts` in the order of time,
    /// and the end states of the bodies that were hit to `pushes`. Returns the number of bodies that stopped where they
    /// touched, because the step reached its limit of work.
    pub(super) fn run(
        &mut self,
        mut scene: SweepScene<'_>,
        world: &impl Lookup,
        dt: f64,
        contacts: &mut Vec<FieldContact>,
        pushes: &mut Vec<Push>,
    ) -> usize {
        if scene.starts.all_still(world) {
            self.clear();
            return 0;
        }
        self.tracks
            .gather(scene.fields.touch, scene.starts, world, dt);
        self.held.clone_from(&scene.outcomes.held);
        self.separations.turn();
        let world = &SweptWorld {
            world,
            starts: scene.starts,
            dt,
        };
        self.foresee_all(world);
        // The first prediction is not counted: it takes as long as there are pairs that may meet.
        self.work = 0;
        let most = u64::from(scene.work) * (FEW_PARTS + self.tracks.parts.len() as u64);
        while let Some(batch) = self.next_batch(world) {
            if self.work >= most {
                self.hold(&batch, world);
                continue;
            }
            self.work += WORK_OF_IMPACT * batch.len() as u64;
            self.happen(&batch, &mut scene, world, contacts);
        }
        self.push(dt, pushes);
        let tracks = self.tracks.list.iter();
        tracks.filter(|track| track.is_stopped()).count()
    }

    /// Stops bodies where they touch, for touches beyond the limit of work.
    fn hold(&mut self, batch: &[Event], world: &SweptWorld<'_, impl Lookup>) {
        for number in batch.iter().flat_map(|event| event.tracks) {
            let track = &mut self.tracks.list[number];
            if !track.dynamic {
                continue;
            }
            track.prepare(world);
            track.stop(batch[0].time);
            if !std::mem::replace(&mut self.moved[number], true) {
                self.redirected
                    .push((number, track.bounds(batch[0].time, batch[0].time)));
            }
        }
    }

    /// Clears the results of the previous step.
    fn clear(&mut self) {
        self.queue.clear();
        self.settled.clear();
        self.resting.clear();
        self.lasting.clear();
        self.redirected.clear();
        if let Some(log) = &mut self.log {
            log.clear();
        }
    }

    /// Queues the first touch of each pair of bodies that may meet.
    fn foresee_all(&mut self, world: &SweptWorld<'_, impl Lookup>) {
        self.clear();
        self.moved.clear();
        self.moved.resize(self.tracks.list.len(), false);
        let places = self.tracks.list.iter().map(|track| track.place(world.dt));
        self.places.clear();
        self.places.extend(places);
        self.near.refresh(&self.places);
        let near = std::mem::take(&mut self.near);
        for pair in near.list.iter().map(|pair| pair.map(|it| it as usize)) {
            let [a, b] = pair.map(|number| &self.places[number]);
            if !b.bounded || a.bounds.intersects(&b.bounds) {
                self.foresee(pair, 0.0, world);
            }
        }
        self.near = near;
    }

    /// Queues the first touch of two bodies from a moment on.
    pub(super) fn foresee(
        &mut self,
        tracks: [usize; 2],
        from: f64,
        world: &SweptWorld<'_, impl Lookup>,
    ) {
        let [a, b] = tracks.map(|number| &self.tracks.list[number]);
        let idle = a.is_still() && b.is_still();
        if idle || !(a.dynamic || b.dynamic) || !(a.detects || b.detects) {
            return;
        }
        let Some(span) = near_each_other([a, b], [from, world.dt]) else {
            return;
        };
        let bounds = [a, b].map(|track| track.bounds(span[0], span[1]));
        let near = |(_, [one, two]): &(_, [MovingShape<'_>; 2])| {
            !one.stands_clear_of(&bounds[1]) && !two.stands_clear_of(&bounds[0])
        };
        if !self.pairs_of(tracks, world.dt).any(|pair| near(&pair)) {
            return;
        }
        for number in tracks {
            let track = &mut self.tracks.list[number];
            if !track.round {
                track.prepare(world);
            }
        }
        let [a, b] = tracks.map(|number| &self.tracks.list[number]);
        let (mut first, mut end) = (None, span[1]);
        let looks = Cell::new(0);
        let mut separations = std::mem::take(&mut self.separations);
        for (parts, [one, two]) in self.pairs_of(tracks, world.dt).filter(near) {
            let from = span[0].max(self.left_alone_until(parts));
            looks.set(looks.get() + 1);
            if from <= end
                && let Some(depth) = self.depth_of_touch(tracks, parts, [from, end], world, &looks)
                && may_touch([one, two], [from, end], &mut separations)
                && let Some(time) = time_of_impact([one, two], depth, [from, end], &looks)
                && first.is_none_or(|(earliest, _)| time < earliest)
            {
                first = Some((time, parts));
                end = time;
            }
        }
        let generations = [a.generation, b.generation];
        self.separations = separations;
        self.work += looks.get();
        if let Some((time, parts)) = first {
            let event = Event {
                time,
                tracks,
                parts,
                generations,
            };
            self.queue.insert(event.key(), event);
        }
    }

    /// Takes the earliest touches, which happen at once, out of the queue.
    fn next_batch(&mut self, world: &SweptWorld<'_, impl Lookup>) -> Option<Vec<Event>> {
        let mut batch: Vec<Event> = Vec::new();
        while let Some((_, &event)) = self.queue.first_key_value() {
            let stands = |which: usize| {
                let track = &self.tracks.list[event.tracks[which]];
                track.generation == event.generations[which]
            };
            let valid = stands(0) && stands(1);
            let first = batch.first().map_or(event.time, |first| first.time);
            if valid && event.time > first + AT_ONCE * world.dt {
                break;
            }
            self.queue.pop_first();
            if valid {
                batch.push(event);
                self.work += self.add_twins(event, &mut batch, world);
            }
        }
        (!batch.is_empty()).then_some(batch)
    }

    /// Adds other parts of the same two bodies that touch at the same moment. Returns its work.
    fn add_twins(
        &self,
        event: Event,
        batch: &mut Vec<Event>,
        world: &SweptWorld<'_, impl Lookup>,
    ) -> u64 {
        let looks = Cell::new(0);
        let span = [event.time, event.time + AT_ONCE * world.dt];
        for (parts, pair) in self.pairs_of(event.tracks, world.dt) {
            let due = self.left_alone_until(parts) <= event.time;
            if due
                && parts != event.parts
                && let Some(depth) = self.depth_of_touch(event.tracks, parts, span, world, &looks)
                && time_of_impact(pair, depth, span, &looks).is_some()
            {
                batch.push(Event { parts, ..event });
            }
        }
        looks.get()
    }

    /// The pairs of parts of two bodies that are still to be tested, with their indices.
    fn pairs_of(
        &self,
        tracks: [usize; 2],
        dt: f64,
    ) -> impl Iterator<Item = ([usize; 2], [MovingShape<'_>; 2])> {
        let [a, b] = tracks.map(|number| self.tracks.list[number].parts.clone());
        let pairs = a.flat_map(move |i| b.clone().map(move |j| [i, j]));
        let wanted = move |parts: &[usize; 2]| {
            let both = parts.map(|part| &self.tracks.parts[part].part);
            let detects = both.iter().any(|part| part.law.is_some());
            detects
                && both[0].may_touch(both[1])
                && !self.settled.contains(parts)
                && !self.lies_still(tracks, *parts, dt)
        };
        let carried = move |parts| (parts, self.carried(tracks, parts));
        pairs.filter(wanted).map(carried)
    }

    /// Returns true if an impact has put one of two bodies on another path.
    pub(super) fn is_hit(&self, tracks: [usize; 2]) -> bool {
        let mut tracks = tracks.into_iter();
        tracks.any(|number| self.tracks.list[number].generation > 0)
    }

    /// Returns true if Rapier held two parts, and neither of their bodies has been hit since.
    pub(super) fn is_held(&self, tracks: [usize; 2], parts: [usize; 2]) -> bool {
        let colliders = parts.map(|part| self.tracks.parts[part].part.collider);
        !self.is_hit(tracks) && self.held.contains(&in_order(colliders))
    }

    fn left_alone_until(&self, parts: [usize; 2]) -> f64 {
        self.lasting.get(&parts).map_or(0.0, |(_, until)| *until)
    }

    /// Counts an impact of two parts that may meet endlessly.
    pub(super) fn count(&mut self, parts: [usize; 2], time: f64, dt: f64) {
        let (times, until) = self.lasting.entry(parts).or_default();
        *times += 1;
        if *times > LASTING {
            *until = time + dt / LOOKS;
        }
    }

    pub(super) fn carried(&self, tracks: [usize; 2], parts: [usize; 2]) -> [MovingShape<'_>; 2] {
        [0, 1].map(|which| MovingShape {
            track: &self.tracks.list[tracks[which]],
            member: &self.tracks.parts[parts[which]],
        })
    }

    /// Adds the pairs of a redirected body with all bodies that it may meet.
    pub(super) fn neighbours(&self, number: usize, bounds: &Aabb, pairs: &mut Vec<[usize; 2]>) {
        let still = self.near.around(bounds).map(|other| other as usize);
        let still = still.filter(|other| !self.moved[*other]);
        let meets = |(other, their): &&(usize, Aabb)| {
            *other != number
                && their.mins.cmple(bounds.maxs).all()
                && bounds.mins.cmple(their.maxs).all()
        };
        let moved = self
            .redirected
            .iter()
            .filter(meets)
            .map(|(other, _)| *other);
        let others = still.chain(moved);
        pairs.extend(others.map(|other| [number.min(other), number.max(other)]));
    }

    /// Adds the end states of the bodies that were hit.
    fn push(&self, dt: f64, pushes: &mut Vec<Push>) {
        for (number, _) in &self.redirected {
            let track = &self.tracks.list[*number];
            let (pose, linvel, angvel) = track.finish(dt);
            if let Some(body) = track.body {
                pushes.push(Push {
                    body,
                    pose: Some(from_dpose3(&pose)),
                    linvel: from_dvec3(linvel),
                    angvel: from_dvec3(angvel),
                    hit: track.hit_at.map(|time| MidStepImpact {
                        body,
                        share: from_f64(time / dt),
                        presumed: track.presumed.map(|them| them.map(from_dvec3)),
                    }),
                });
            }
        }
    }
}
