//! The paper's law under operators: what the fields around touched parts give to the composites in
//! which they stand (§3.3, §3.4).

use std::collections::HashMap;

use super::FieldContact;
use super::discrete::Discrete;
use super::field_mask::FieldMasks;
use super::solve::{ContactBody, Meeting};
use crate::compile::{Compiled, FieldMask};
use crate::field::{ContactLaw, Query, Touch};
use crate::math::{ColliderHandle, DVec3};
use crate::sample::Moment;

/// The touches so far at one moment, and what each part got from them. All touches of one part are
/// evaluated together, as fields that overlap are: so a push is the difference that a touch makes.
pub(super) struct PaperPushes<'a> {
    pub masks: Option<&'a mut FieldMasks>,
    pub touch: &'a Discrete,
    pub compiled: &'a Compiled,
    pub moment: Moment,
    pub known: HashMap<ColliderHandle, (Vec<Touch>, DVec3)>,
}

impl PaperPushes<'_> {
    /// The changes of velocity of the two parts of a contact by each other's fields. `places` are
    /// where they are sampled, if elsewhere than where they are now.
    pub(super) fn note(
        &mut self,
        meeting: &mut Meeting,
        contact: &FieldContact,
        movers: &[ContactBody],
        places: [Option<DVec3>; 2],
    ) {
        if !meeting.law.is_vector() {
            return;
        }
        let speeds = meeting.velocities(movers).map(DVec3::length);
        let approach_speed = meeting.approach(movers);
        for part in 0..2 {
            if !contact.has_field[1 - part] {
                continue;
            }
            let touch = Touch {
                collider: contact.colliders[1 - part],
                world_normal: [-meeting.normal, meeting.normal][part],
                speed: speeds[part],
                approach_speed,
            };
            let pushed = contact.colliders[part];
            meeting.pushes[part] = self.push(meeting.law, pushed, touch, places[part]);
        }
    }

    fn push(
        &mut self,
        law: ContactLaw,
        part: ColliderHandle,
        touch: Touch,
        place: Option<DVec3>,
    ) -> DVec3 {
        let Some(masks) = self.masks.as_deref_mut() else {
            return plain(self.touch, self.compiled, law, &touch);
        };
        let Some(mut query) = masks.sample(part, self.moment) else {
            return DVec3::ZERO;
        };
        query.world_point = place.unwrap_or(query.world_point);
        let (touches, before) = self.known.entry(part).or_default();
        touches.push(touch);
        query.touches.clone_from(touches);
        let after = given(self.touch, self.compiled, law, masks, query);
        after - std::mem::replace(before, after)
    }
}

/// The push of those fields of a touched collider that stand by themselves: one push each. A pair has
/// one law: so a field that only observes pushes once, if the other side's law is the paper's.
fn plain(touch: &Discrete, compiled: &Compiled, law: ContactLaw, touched: &Touch) -> DVec3 {
    let numbers = touch.detectors_of(touched.collider).iter();
    let detectors = numbers.map(|number| &compiled.detectors[*number as usize]);
    let [mut pushing, mut observing] = [0.0_f64; 2];
    for detector in detectors.filter(|it| it.mask.is_none()) {
        if detector.law.is_vector() {
            pushing += 1.0;
        } else {
            observing = 1.0;
        }
    }
    law.push(touched) * pushing.max(observing)
}

/// The change of velocity that all that touches a part gives it.
fn given(
    touch: &Discrete,
    compiled: &Compiled,
    law: ContactLaw,
    masks: &mut FieldMasks,
    touching: Query,
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let mut composites: Vec<FieldMask> = Vec::new();
    for touched in &touching.touches {
        sum += plain(touch, compiled, law, touched);
        let numbers = touch.detectors_of(touched.collider).iter();
        let masks = numbers.filter_map(|number| compiled.detectors[*number as usize].mask);
        for mask in masks {
            if !composites.iter().any(|it| it.is_beside(&mask)) {
                composites.push(mask);
            }
        }
    }
    // A part may have no mass of its own, on a body that has it all: it is pushed as any.
    let mass = if touching.mass > 0.0 {
        touching.mass
    } else {
        1.0
    };
    let touching = Query { mass, ..touching };
    let alone = Query {
        touches: Vec::new(),
        ..touching.clone()
    };
    let weight = touching.dt / mass;
    for mask in composites {
        let mut force = |query: &Query| masks.force(compiled, mask, query);
        let difference = (force(&touching) - force(&alone)) * weight;
        if difference.is_finite() {
            sum += difference;
        }
    }
    sum
}
