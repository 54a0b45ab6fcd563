//! Swept detection: all first touches of a step, in the order of time, each answered when it
//! happens.
//!
//! Rapier has moved the bodies; their motion over the step is known exactly, or as a chord where
//! something else pushed them. Touches are foreseen and queued. The earliest is taken: its bodies
//! stand where they were then, are pushed by the law, and move on from there, freely, for the rest
//! of the step; what was foreseen of them is void and foreseen anew. What touches at the same
//! moment is answered together.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashSet};

use super::FieldContact;
use super::guard::Guards;
use super::meet::{Carried, Spot, first_meeting, spot};
use super::solve::{Meeting, Mover, resolve};
use super::touch::Touch;
use super::track::{Starts, Tracks};
use crate::compile::Compiled;
use crate::eval::{Moment, hierarchy};
use crate::field::ContactLaw;
use crate::math::{
    ColliderSet, DPose3, DVec3, Pose, Real, RigidBodySet, Rotation, from_dvec3, from_f64, to_f64,
};
use crate::rapier::geometry::Aabb;
use crate::rapier::parry::partitioning::{Bvh, BvhWorkspace};

/// Impacts of one step, at most: so many, and so many per body. A billiard of mass ratio 10⁴ has
/// 314 in all; only what cannot come to rest goes beyond.
const MOST_IMPACTS: usize = 10_000;
const MOST_PER_BODY: usize = 256;

/// Touches closer in time than this share of the step are at the same time: rounding decides
/// which is first.
const AT_ONCE: f64 = 1e-12;

/// Swept detection; keeps its buffers between steps.
#[derive(Debug, Default)]
pub(super) struct Sweep {
    pub starts: Starts,
    tracks: Tracks,
    queue: BinaryHeap<Event>,
    /// Pairs of parts done with in this step: only observed, or at rest.
    settled: HashSet<[usize; 2]>,
    /// All that is bounded, by the motion foreseen at the start.
    tree: Bvh,
    unbounded: Vec<usize>,
    /// Tracks that an impact has put on another path, and where they can still go.
    redirected: Vec<(usize, Aabb)>,
    moved: Vec<bool>,
}

/// A touch foreseen.
#[derive(Clone, Copy, Debug)]
struct Event {
    time: f64,
    tracks: [usize; 2],
    parts: [usize; 2],
    generations: [u32; 2],
}

impl Ord for Event {
    /// The earliest is the greatest, for the heap.
    fn cmp(&self, other: &Self) -> Ordering {
        let later = other.time.total_cmp(&self.time);
        later.then_with(|| other.parts.cmp(&self.parts))
    }
}

impl PartialOrd for Event {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Event {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Event {}

/// What a sweep needs to know of the world and of the fields.
pub(super) struct Scene<'a> {
    pub compiled: &'a Compiled,
    pub touch: &'a Touch,
    pub guards: Option<&'a mut Guards>,
    pub colliders: &'a ColliderSet,
    /// The moment when the step began.
    pub moment: Moment,
    /// Whether the fields answer a contact.
    pub answers: &'a dyn Fn(&FieldContact) -> bool,
}

/// What a sweep did.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Swept {
    pub written: usize,
    /// Whether there were more impacts than one step may have.
    pub exhausted: bool,
}

impl Sweep {
    /// Finds and answers all touches of a step of length `dt`, and moves the bodies to where they
    /// lead. Adds them to `contacts`, in the order of time.
    pub(super) fn run(
        &mut self,
        mut scene: Scene<'_>,
        bodies: &mut RigidBodySet,
        dt: f64,
        contacts: &mut Vec<FieldContact>,
    ) -> Swept {
        let world = (&*bodies, scene.colliders);
        self.tracks.gather(scene.touch, &self.starts, world, dt);
        self.foresee_all(bodies, dt);
        let mut left = MOST_IMPACTS + MOST_PER_BODY * self.tracks.list.len();
        while let Some(batch) = self.next_batch(dt) {
            if left < batch.len() {
                self.queue.clear();
                break;
            }
            left -= batch.len();
            self.happen(&batch, &mut scene, bodies, dt, contacts);
        }
        Swept {
            written: self.write(bodies, dt),
            exhausted: left == 0,
        }
    }

    /// Queues the first touch of every pair that may meet.
    fn foresee_all(&mut self, bodies: &RigidBodySet, dt: f64) {
        self.queue.clear();
        self.settled.clear();
        self.redirected.clear();
        self.unbounded.clear();
        self.moved.clear();
        self.moved.resize(self.tracks.list.len(), false);
        let mut leaves = Vec::with_capacity(self.tracks.list.len());
        for (number, track) in self.tracks.list.iter().enumerate() {
            if track.is_bounded() {
                leaves.push((number, track.bounds(0.0, dt)));
            } else {
                self.unbounded.push(number);
            }
        }
        let bounded: Vec<usize> = leaves.iter().map(|(number, _)| *number).collect();
        self.tree = hierarchy(leaves);
        let mut pairs = Vec::new();
        let mut workspace = BvhWorkspace::default();
        self.tree
            .traverse_bvtt_single_tree::<false>(&mut workspace, &mut |a, b| {
                pairs.push([a.min(b) as usize, a.max(b) as usize]);
            });
        for wall in &self.unbounded {
            pairs.extend(bounded.iter().map(|number| [*number, *wall]));
        }
        // The tree's order depends on its history.
        pairs.sort_unstable();
        for [a, b] in pairs {
            self.foresee([a, b], 0.0, bodies, dt);
        }
    }

    /// Queues the first touch of two tracks from a moment on.
    fn foresee(&mut self, tracks: [usize; 2], from: f64, bodies: &RigidBodySet, dt: f64) {
        let [a, b] = tracks.map(|number| &self.tracks.list[number]);
        if !(a.dynamic || b.dynamic) || !(a.detects || b.detects) {
            return;
        }
        let Some(span) = near_each_other([a, b], [from, dt]) else {
            return;
        };
        for number in tracks {
            self.tracks.list[number].prepare(bodies, dt);
        }
        let [a, b] = tracks.map(|number| &self.tracks.list[number]);
        let (mut first, mut end) = (None, span[1]);
        for i in a.parts.clone() {
            for j in b.parts.clone() {
                let (one, two) = (&self.tracks.parts[i], &self.tracks.parts[j]);
                let detects = one.part.law.is_some() || two.part.law.is_some();
                if !detects || self.settled.contains(&[i, j]) {
                    continue;
                }
                let one = Carried {
                    track: a,
                    member: one,
                };
                let two = Carried {
                    track: b,
                    member: two,
                };
                if let Some(time) = first_meeting(one, two, [span[0], end])
                    && first.is_none_or(|(earliest, _)| time < earliest)
                {
                    first = Some((time, [i, j]));
                    end = time;
                }
            }
        }
        if let Some((time, parts)) = first {
            let generations = [a.generation, b.generation];
            self.queue.push(Event {
                time,
                tracks,
                parts,
                generations,
            });
        }
    }

    /// The earliest touches, all at the same moment.
    fn next_batch(&mut self, dt: f64) -> Option<Vec<Event>> {
        let mut batch: Vec<Event> = Vec::new();
        while let Some(event) = self.queue.peek().copied() {
            let stands = |which: usize| {
                let track = &self.tracks.list[event.tracks[which]];
                track.generation == event.generations[which]
            };
            let valid = stands(0) && stands(1);
            let first = batch.first().map_or(event.time, |first| first.time);
            if valid && event.time > first + AT_ONCE * dt {
                break;
            }
            self.queue.pop();
            if valid {
                batch.push(event);
                self.add_twins(event, &mut batch, dt);
            }
        }
        (!batch.is_empty()).then_some(batch)
    }

    /// Other parts of the same two bodies that touch at the same moment.
    fn add_twins(&self, event: Event, batch: &mut Vec<Event>, dt: f64) {
        let [a, b] = event.tracks.map(|number| &self.tracks.list[number]);
        for i in a.parts.clone() {
            for j in b.parts.clone() {
                let (one, two) = (&self.tracks.parts[i], &self.tracks.parts[j]);
                let detects = one.part.law.is_some() || two.part.law.is_some();
                if [i, j] == event.parts || !detects || self.settled.contains(&[i, j]) {
                    continue;
                }
                let one = Carried {
                    track: a,
                    member: one,
                };
                let two = Carried {
                    track: b,
                    member: two,
                };
                let span = [event.time, event.time + AT_ONCE * dt];
                if first_meeting(one, two, span).is_some() {
                    batch.push(Event {
                        parts: [i, j],
                        ..event
                    });
                }
            }
        }
    }

    /// Lets touches of one moment happen.
    fn happen(
        &mut self,
        batch: &[Event],
        scene: &mut Scene<'_>,
        bodies: &RigidBodySet,
        dt: f64,
        contacts: &mut Vec<FieldContact>,
    ) {
        let time = batch[0].time;
        let mut numbers: Vec<usize> = batch.iter().flat_map(|event| event.tracks).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers.retain(|number| self.tracks.list[*number].resistance.is_some());
        let movers = numbers.iter().map(|n| self.tracks.list[*n].mover(time));
        let mut movers: Vec<Mover> = movers.flatten().collect();
        let mut meetings = Vec::new();
        let mut found = Vec::new();
        for event in batch {
            let Some(spot) = self.spot(event, time) else {
                self.settled.insert(event.parts);
                continue;
            };
            let Some(mut contact) = self.contact(event, &spot, time, scene) else {
                self.settled.insert(event.parts);
                continue;
            };
            let places = event.tracks.map(|track| numbers.binary_search(&track).ok());
            let mut meeting = self.meeting(event, &spot, &contact, places, scene);
            contact.approach_speed = from_f64(meeting.approach(&movers));
            if meeting.law == ContactLaw::Observe {
                self.settled.insert(event.parts);
            } else if self.rests(&meeting, &movers, &spot, dt) {
                // Answered once more, and then no longer: Zeno's bounces come to rest.
                self.settled.insert(event.parts);
            }
            meeting.depth = 0.0;
            meetings.push(meeting);
            found.push((contact, event.parts));
        }
        resolve(&mut movers, &mut meetings, 0.0);
        for ((contact, parts), meeting) in found.iter_mut().zip(&meetings) {
            contact.impulses = meeting.impulses.map(from_dvec3);
            let unanswered = meeting.impulses == [DVec3::ZERO; 2];
            if unanswered || meeting.approach(&movers) > meeting.rounding(&movers) {
                self.settled.insert(*parts);
            }
        }
        contacts.extend(found.into_iter().map(|(contact, _)| contact));
        self.go_on(&numbers, &movers, batch, bodies, [time, dt]);
    }

    fn carried(&self, event: &Event) -> [Carried<'_>; 2] {
        [0, 1].map(|which| Carried {
            track: &self.tracks.list[event.tracks[which]],
            member: &self.tracks.parts[event.parts[which]],
        })
    }

    fn spot(&self, event: &Event, time: f64) -> Option<Spot> {
        let [a, b] = self.carried(event);
        spot(a, b, time).filter(|spot| spot.point.is_finite())
    }

    /// The contact of an event as it is reported; nothing if no detection field acts there.
    fn contact(
        &self,
        event: &Event,
        spot: &Spot,
        time: f64,
        scene: &mut Scene<'_>,
    ) -> Option<FieldContact> {
        let carried = self.carried(event);
        let parts = carried.map(|carried| &carried.member.part);
        if let Some(guards) = scene.guards.as_deref_mut() {
            let lets = [(0, 1), (1, 0)].into_iter().any(|(owner, other)| {
                let place = carried[other].place(time);
                let point = carried[owner].track.carried_to_end(place, time);
                let numbers = scene.touch.detectors_of(parts[owner].collider).iter();
                numbers.copied().any(|number| {
                    let detector = &scene.compiled.detectors[number as usize];
                    let collider = parts[other].collider;
                    guards.lets_through_at(scene.compiled, detector, collider, scene.moment, point)
                })
            });
            if !lets {
                return None;
            }
        }
        let contact = FieldContact::new(
            parts,
            from_dvec3(spot.point),
            from_dvec3(spot.normal),
            from_f64(spot.depth.max(0.0)),
        );
        Some(FieldContact {
            time_of_impact: Some(scene.moment.time + time),
            ..contact
        })
    }

    fn meeting(
        &self,
        event: &Event,
        spot: &Spot,
        contact: &FieldContact,
        places: [Option<usize>; 2],
        scene: &Scene<'_>,
    ) -> Meeting {
        let swapped = contact.colliders[0] != self.tracks.parts[event.parts[0]].part.collider;
        let (places, normal) = if swapped {
            ([places[1], places[0]], -spot.normal)
        } else {
            (places, spot.normal)
        };
        // A spring begins to push when there is something to push against.
        let later = matches!(contact.law, ContactLaw::Penalty { .. });
        let law = if later || !(scene.answers)(contact) {
            ContactLaw::Observe
        } else {
            contact.law
        };
        Meeting {
            places,
            point: spot.point,
            normal,
            depth: spot.depth,
            law,
            has_field: contact.has_field,
            impulses: [DVec3::ZERO; 2],
        }
    }

    /// Whether two parts approach so slowly that a step does not take them deeper than rounding.
    fn rests(&self, meeting: &Meeting, movers: &[Mover], spot: &Spot, dt: f64) -> bool {
        let size = meeting.places.iter().flatten();
        let size = size.map(|place| (movers[*place].com - spot.point).length());
        let scale = spot.point.length() + size.fold(0.0, f64::max);
        meeting.approach(movers) * dt <= to_f64(Real::EPSILON) * scale
    }

    /// Puts pushed bodies on their new paths, and foresees what comes of it.
    fn go_on(
        &mut self,
        numbers: &[usize],
        movers: &[Mover],
        batch: &[Event],
        bodies: &RigidBodySet,
        [time, dt]: [f64; 2],
    ) {
        let mut pushed = Vec::new();
        for (number, mover) in numbers.iter().zip(movers) {
            let sound = mover.linvel.is_finite() && mover.angvel.is_finite();
            if !(mover.pushed && sound) {
                continue;
            }
            let track = &mut self.tracks.list[*number];
            let body = track.body.and_then(|body| bodies.get(body));
            let free =
                body.is_some_and(|body| body.is_dynamic() && body.gyroscopic_forces_enabled());
            track.redirect(mover, free, [time, dt]);
            let bounds = track.bounds(time, dt);
            pushed.push(*number);
            if !std::mem::replace(&mut self.moved[*number], true) {
                self.redirected.push((*number, bounds));
            } else if let Some(known) = self.redirected.iter_mut().find(|(n, _)| n == number) {
                known.1 = bounds;
            }
        }
        let mut pairs = Vec::new();
        for number in &pushed {
            self.neighbours(
                *number,
                &self.tracks.list[*number].bounds(time, dt),
                &mut pairs,
            );
        }
        // Who was not pushed may touch again all the same.
        let unpushed = |event: &&Event| !event.tracks.iter().any(|track| pushed.contains(track));
        pairs.extend(batch.iter().filter(unpushed).map(|event| event.tracks));
        pairs.sort_unstable();
        pairs.dedup();
        for pair in pairs {
            self.foresee(pair, time, bodies, dt);
        }
    }

    /// All pairs of a redirected track with whom it may meet.
    fn neighbours(&self, number: usize, bounds: &Aabb, pairs: &mut Vec<[usize; 2]>) {
        let still = self.tree.intersect_aabb(bounds).map(|other| other as usize);
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
        let walls = self
            .unbounded
            .iter()
            .copied()
            .filter(|other| *other != number);
        let others = still.chain(moved).chain(walls);
        pairs.extend(others.map(|other| [number.min(other), number.max(other)]));
    }

    /// Writes the bodies that were pushed; returns how many.
    fn write(&self, bodies: &mut RigidBodySet, dt: f64) -> usize {
        let mut written = 0;
        for (number, _) in &self.redirected {
            let track = &self.tracks.list[*number];
            let (pose, linvel, angvel) = track.finish(dt);
            let body = track.body.and_then(|body| bodies.get_mut(body));
            let rounded = (rounded(&pose), from_dvec3(linvel), from_dvec3(angvel));
            let sound = rounded.0.is_some() && rounded.1.is_finite() && rounded.2.is_finite();
            if let (Some(body), Some(pose), true) = (body, rounded.0, sound) {
                // A contact wakes whom it hits, as Rapier's do.
                body.set_position(pose, true);
                body.set_linvel(rounded.1, true);
                body.set_angvel(rounded.2, true);
                written += 1;
            }
        }
        written
    }
}

/// When the spheres around two tracks overlap, within a span; nothing if they do not.
fn near_each_other(tracks: [&super::track::Track; 2], [from, to]: [f64; 2]) -> Option<[f64; 2]> {
    let [a, b] = tracks;
    let reach = a.reach + b.reach;
    if !reach.is_finite() {
        return Some([from, to]);
    }
    let apart = b.path.com(from) - a.path.com(from);
    let closing = b.path.velocity - a.path.velocity;
    // A little early and late, against rounding.
    let reach = reach * (1.0 + 1e-9) + 1e-12 * (a.path.com.length() + b.path.com.length());
    let (square, half, rest) = (
        closing.length_squared(),
        apart.dot(closing),
        apart.length_squared() - reach * reach,
    );
    if square == 0.0 {
        return (rest <= 0.0).then_some([from, to]);
    }
    let inside = half * half - square * rest;
    if inside < 0.0 {
        return None;
    }
    let root = inside.sqrt();
    let slack = 1e-9 * (root / square);
    let enter = if rest <= 0.0 {
        0.0
    } else {
        (-half - root) / square - slack
    };
    let leave = (-half + root) / square + slack;
    let span = [(from + enter).max(from), (from + leave).min(to)];
    (span[0] <= span[1]).then_some(span)
}

fn rounded(pose: &DPose3) -> Option<Pose> {
    let [x, y, z, w] = pose.rotation.to_array().map(from_f64);
    let rotation = Rotation::from_xyzw(x, y, z, w).normalize();
    let translation = from_dvec3(pose.translation);
    (rotation.is_finite() && translation.is_finite())
        .then(|| Pose::from_parts(translation, rotation))
}
