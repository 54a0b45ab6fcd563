//! The impact of a swept detection: all touches of one moment are answered, and the bodies move on from there.

use std::collections::HashMap;

use super::FieldContact;
use super::contact_body::ContactBody;
use super::field_mask::At;
use super::ownership::PairOwner;
use super::paper_push::PaperPushes;
use super::solve::{ContactConstraint, ContactPoint, resolve};
use super::sweep::{Event, Sweep, SweepScene};
use super::swept_body::SweptWorld;
use super::touch_points::spots;
use super::touch_record::TouchRecord;
use crate::field::ContactLaw;
use crate::math::{DVec3, Real, from_dvec3, from_f64, to_f64};
use crate::rigid::Lookup;

/// A touch that is answered.
struct AnsweredTouch<'a> {
    contact: FieldContact,
    event: &'a Event,
    /// The points at which the parts touch; the first one is the deepest.
    spots: Vec<ContactPoint>,
    /// The range of its points in the list of all that are answered together.
    constraints: std::ops::Range<usize>,
}

impl Sweep {
    /// Answers the touches of one moment, and puts the bodies that were hit on new paths.
    pub(super) fn happen(
        &mut self,
        batch: &[Event],
        scene: &mut SweepScene<'_>,
        world: &SweptWorld<'_, impl Lookup>,
        contacts: &mut Vec<FieldContact>,
    ) {
        let (time, dt) = (batch[0].time, world.dt);
        let mut numbers: Vec<usize> = batch.iter().flat_map(|event| event.tracks).collect();
        numbers.sort_unstable();
        numbers.dedup();
        for number in &numbers {
            self.tracks.list[*number].prepare(world);
        }
        numbers.retain(|number| self.tracks.list[*number].resistance.is_some());
        let contact_bodies = numbers
            .iter()
            .map(|n| self.tracks.list[*n].contact_body(time));
        let mut contact_bodies: Vec<ContactBody> = contact_bodies.flatten().collect();
        let mut constraints = Vec::new();
        let mut found = Vec::new();
        let mut known = HashMap::new();
        for event in batch {
            let carried = self.carried(event.tracks, event.parts);
            let spots = spots(carried, time);
            let contact = spots.first().filter(|spot| spot.point.is_finite());
            let contact = contact.and_then(|spot| self.contact(event, spot, time, scene));
            let Some(mut contact) = contact else {
                self.settled.insert(event.parts);
                continue;
            };
            let places = event.tracks.map(|track| numbers.binary_search(&track).ok());
            let first = constraints.len();
            // All laws but Newton's act once, at the first point.
            let count = match contact.law {
                ContactLaw::Impulse { .. } => spots.len(),
                _ => 1,
            };
            let constraint = |spot| self.constraint(event, spot, &contact, places, scene);
            constraints.extend(spots[..count].iter().map(constraint));
            let own = &mut constraints[first..];
            let sampled = self.sampled(event, &contact, time).map(Some);
            let mut paper = PaperPushes {
                masks: scene.masks.as_deref_mut(),
                fields: scene.fields,
                known,
            };
            paper.note(&mut own[0], &contact, &contact_bodies, sampled);
            known = paper.known;
            let approach = own
                .iter()
                .map(|constraint: &ContactConstraint| constraint.approach(&contact_bodies));
            let approach = approach.fold(f64::NEG_INFINITY, f64::max);
            contact.approach_speed = from_f64(approach);
            let again =
                self.resting.contains_key(&event.parts) || self.is_held(event.tracks, event.parts);
            if let Some(mut log) = self.log.take_if(|_| !again) {
                let carried = self.carried(event.tracks, event.parts);
                log.push(TouchRecord::of(carried, &contact, time));
                self.log = Some(log);
            }
            let law = own[0].law;
            if law == ContactLaw::Observe {
                self.settled.insert(event.parts);
            } else if approach <= own[0].resting_speed {
                // A contact below the resting threshold is held by Rapier, unless it was fast when Rapier's step began.
                self.rest(event, spots.clone(), world);
                let falls = scene.outcomes.lifted.contains(&contact.colliders);
                own.iter_mut()
                    .for_each(|constraint| constraint.lay_down(falls, &mut contact_bodies));
            } else if self.rests(&own[0], &contact_bodies, &spots[0], dt) {
                // The contact is answered once more and then rests, so that an endless series of bounces ends.
                self.rest(event, spots.clone(), world);
            }
            own.iter_mut().for_each(|constraint| constraint.depth = 0.0);
            found.push(AnsweredTouch {
                contact,
                event,
                spots,
                constraints: first..constraints.len(),
            });
        }
        resolve(&mut contact_bodies, &mut constraints, 0.0);
        for touch in &mut found {
            self.close(touch, &constraints, &contact_bodies, world);
        }
        contacts.extend(found.into_iter().map(|touch| touch.contact));
        self.go_on(&numbers, &contact_bodies, batch, world);
    }

    /// Notes the answer to a touch, and whether its parts rest on each other or may meet endlessly.
    fn close(
        &mut self,
        touch: &mut AnsweredTouch<'_>,
        constraints: &[ContactConstraint],
        contact_bodies: &[ContactBody],
        world: &SweptWorld<'_, impl Lookup>,
    ) {
        let (event, contact) = (touch.event, &mut touch.contact);
        let own = &constraints[touch.constraints.clone()];
        own.iter()
            .for_each(|constraint| contact.add_impulses(constraint.impulses));
        if own.iter().any(|constraint| constraint.failed) {
            self.not_finite.push(contact.colliders);
        }
        if !contact.is_answered() && !self.resting.contains_key(&event.parts) {
            self.settled.insert(event.parts);
        }
        let approaches = own
            .iter()
            .map(|it| (it.approach(contact_bodies), it.rounding(contact_bodies)));
        let approaches = approaches.filter(|(approach, rounding)| approach > rounding);
        let left = approaches.map(|(approach, _)| approach).fold(0.0, f64::max);
        // The solver leaves approaches below the resting threshold. Faster ones are answered again, up to a limit.
        let resting_speed = own[0].resting_speed;
        if left > 0.0 && left <= resting_speed {
            self.rest(event, std::mem::take(&mut touch.spots), world);
        }
        let loses_speed = !own.iter().all(|constraint| constraint.law.keeps_speed());
        if loses_speed || left > resting_speed {
            self.count(event.parts, event.time, world.dt);
        }
    }

    /// The contact of an event as it is reported; `None` if no detection field acts there.
    fn contact(
        &self,
        event: &Event,
        spot: &ContactPoint,
        time: f64,
        scene: &mut SweepScene<'_>,
    ) -> Option<FieldContact> {
        let carried = self.carried(event.tracks, event.parts);
        let parts = carried.map(|carried| &carried.member.part);
        if let Some(masks) = scene.masks.as_deref_mut() {
            // The border of a region may be at the point of touch, so a point deeper by the allowed linear error counts
            // as well.
            let into = spot.normal * to_f64(scene.starts.rebound());
            let sides = [(0, 1, -into), (1, 0, into)];
            let lets = sides.into_iter().any(|(owner, other, into)| {
                let place = carried[other].place(time);
                let track = carried[owner].track;
                let points = [place, place + into].map(|it| track.carried_to_end(it, time));
                let (owner, other) = (parts[owner].collider, parts[other].collider);
                scene.fields.of(owner).any(|detector| {
                    let mut places = points.into_iter().map(At::Point);
                    places.any(|at| masks.acts_on(scene.fields, detector, other, at))
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
            time_of_impact: Some(scene.fields.moment.time + time),
            ..contact
        })
    }

    /// The places at which fields are sampled for a contact, in its order: the middle of each part at the moment of
    /// touch, carried on to the end of the step with the other part's body.
    fn sampled(&self, event: &Event, contact: &FieldContact, time: f64) -> [DVec3; 2] {
        let carried = self.carried(event.tracks, event.parts);
        let places = [0, 1].map(|part: usize| {
            let middle = carried[part].place(time);
            carried[1 - part].track.carried_to_end(middle, time)
        });
        if contact.colliders[0] == carried[0].member.part.collider {
            places
        } else {
            [places[1], places[0]]
        }
    }

    fn constraint(
        &self,
        event: &Event,
        spot: &ContactPoint,
        contact: &FieldContact,
        places: [Option<usize>; 2],
        scene: &SweepScene<'_>,
    ) -> ContactConstraint {
        let swapped = contact.colliders[0] != self.tracks.parts[event.parts[0]].part.collider;
        let (places, normal) = if swapped {
            ([places[1], places[0]], -spot.normal)
        } else {
            (places, spot.normal)
        };
        // A spring pushes from the end of the step on, when there is an overlap.
        let later = matches!(contact.law, ContactLaw::Penalty { .. });
        let answered = match (scene.owner)(contact) {
            PairOwner::Fields(_) | PairOwner::Both => true,
            // Rapier has made its step before the impact that put one of the bodies on another path.
            PairOwner::HandedOver(_) => self.is_hit(event.tracks),
            PairOwner::Rapier | PairOwner::Solver(_) => false,
        };
        let law = if answered && !later {
            contact.law
        } else {
            ContactLaw::Observe
        };
        let resting_speed = to_f64(scene.starts.resting_speed(contact.law, contact.bodies));
        ContactConstraint::new(law, resting_speed, places, ContactPoint { normal, ..*spot })
    }

    /// Returns true if two parts approach so slowly that a whole step takes them no deeper than rounding.
    fn rests(
        &self,
        constraint: &ContactConstraint,
        contact_bodies: &[ContactBody],
        spot: &ContactPoint,
        dt: f64,
    ) -> bool {
        let size = constraint.places.iter().flatten();
        let size = size.map(|place| (contact_bodies[*place].com - spot.point).length());
        let scale = spot.point.length() + size.fold(0.0, f64::max);
        constraint.approach(contact_bodies) * dt <= to_f64(Real::EPSILON) * scale
    }

    /// Puts the bodies that were pushed on their new paths, and predicts their next touches.
    fn go_on(
        &mut self,
        numbers: &[usize],
        contact_bodies: &[ContactBody],
        batch: &[Event],
        world: &SweptWorld<'_, impl Lookup>,
    ) {
        let (time, dt) = (batch[0].time, world.dt);
        let mut pushed = Vec::new();
        for (number, contact_body) in numbers.iter().zip(contact_bodies) {
            let sound = contact_body.linvel.is_finite() && contact_body.angvel.is_finite();
            if !(contact_body.pushed && sound) {
                continue;
            }
            let track = &mut self.tracks.list[*number];
            let body = track.body.and_then(|body| world.world.body(body));
            let free =
                body.is_some_and(|body| body.is_dynamic() && body.gyroscopic_forces_enabled());
            track.redirect(contact_body, free, [time, dt]);
            self.work += track.path.turn.pieces() as u64;
            let bounds = track.bounds(time, dt);
            pushed.push(*number);
            if !std::mem::replace(&mut self.moved[*number], true) {
                self.redirected.push((*number, bounds));
            } else if let Some(known) = self.redirected.iter_mut().find(|(n, _)| n == number) {
                known.1 = bounds;
            }
        }
        self.disturb(&pushed, batch);
        let mut pairs = Vec::new();
        for number in &pushed {
            self.neighbours(
                *number,
                &self.tracks.list[*number].bounds(time, dt),
                &mut pairs,
            );
        }
        // Pairs of the batch of which neither body was pushed may touch again too.
        let unpushed = |event: &&Event| !event.tracks.iter().any(|track| pushed.contains(track));
        pairs.extend(batch.iter().filter(unpushed).map(|event| event.tracks));
        pairs.sort_unstable();
        pairs.dedup();
        for pair in pairs {
            self.foresee(pair, time, world);
        }
    }
}
