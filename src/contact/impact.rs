//! An impact of a swept detection: what touches at one moment is answered, and goes on from there.

use super::FieldContact;
use super::solve::{ContactBody, Meeting, resolve};
use super::sweep::{Event, Scene, Sweep};
use super::time_of_impact::{ContactPoint, spot};
use crate::field::ContactLaw;
use crate::math::{DVec3, Real, from_dvec3, from_f64, to_f64};
use crate::rigid::Lookup;

impl Sweep {
    /// Lets touches of one moment happen.
    pub(super) fn happen(
        &mut self,
        batch: &[Event],
        scene: &mut Scene<'_>,
        world: &impl Lookup,
        dt: f64,
        contacts: &mut Vec<FieldContact>,
    ) {
        let time = batch[0].time;
        let mut numbers: Vec<usize> = batch.iter().flat_map(|event| event.tracks).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers.retain(|number| self.tracks.list[*number].resistance.is_some());
        let movers = numbers.iter().map(|n| self.tracks.list[*n].mover(time));
        let mut movers: Vec<ContactBody> = movers.flatten().collect();
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
            if matches!(meeting.law, ContactLaw::Impulse { restitution, .. } if restitution < 1.0) {
                self.count(event.parts, time, dt);
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
        self.go_on(&numbers, &movers, batch, world, [time, dt]);
    }

    fn spot(&self, event: &Event, time: f64) -> Option<ContactPoint> {
        let [a, b] = self.carried(event.tracks, event.parts);
        spot(a, b, time).filter(|spot| spot.point.is_finite())
    }

    /// The contact of an event as it is reported; `None` if no detection field acts there.
    fn contact(
        &self,
        event: &Event,
        spot: &ContactPoint,
        time: f64,
        scene: &mut Scene<'_>,
    ) -> Option<FieldContact> {
        let carried = self.carried(event.tracks, event.parts);
        let parts = carried.map(|carried| &carried.member.part);
        if let Some(masks) = scene.masks.as_deref_mut() {
            let lets = [(0, 1), (1, 0)].into_iter().any(|(owner, other)| {
                let place = carried[other].place(time);
                let point = carried[owner].track.carried_to_end(place, time);
                let numbers = scene.touch.detectors_of(parts[owner].collider).iter();
                numbers.copied().any(|number| {
                    let detector = &scene.compiled.detectors[number as usize];
                    let collider = parts[other].collider;
                    masks.lets_through_at(scene.compiled, detector, collider, scene.moment, point)
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
        spot: &ContactPoint,
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
    fn rests(
        &self,
        meeting: &Meeting,
        movers: &[ContactBody],
        spot: &ContactPoint,
        dt: f64,
    ) -> bool {
        let size = meeting.places.iter().flatten();
        let size = size.map(|place| (movers[*place].com - spot.point).length());
        let scale = spot.point.length() + size.fold(0.0, f64::max);
        meeting.approach(movers) * dt <= to_f64(Real::EPSILON) * scale
    }

    /// Puts pushed bodies on their new paths, and foresees what comes of it.
    fn go_on(
        &mut self,
        numbers: &[usize],
        movers: &[ContactBody],
        batch: &[Event],
        world: &impl Lookup,
        [time, dt]: [f64; 2],
    ) {
        let mut pushed = Vec::new();
        for (number, mover) in numbers.iter().zip(movers) {
            let sound = mover.linvel.is_finite() && mover.angvel.is_finite();
            if !(mover.pushed && sound) {
                continue;
            }
            let track = &mut self.tracks.list[*number];
            let body = track.body.and_then(|body| world.body(body));
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
            self.foresee(pair, time, world, dt);
        }
    }
}
