//! The paper's contact law under operators: the velocity that the detection fields around touched parts give, as part
//! of the composite fields in which they stand (§3.3 and §3.4 of the paper).

use std::collections::HashMap;

use super::FieldContact;
use super::contact_body::ContactBody;
use super::field_mask::{DetectionFields, FieldMasks};
use super::solve::ContactConstraint;
use crate::compile::FieldMask;
use crate::field::{ContactLaw, Query, Touch};
use crate::math::{ColliderHandle, DVec3};

/// The touches so far at one moment, and the velocity that each part got from them. All touches of a part are evaluated
/// together, like fields that overlap, so a push is the difference that one more touch makes.
pub(super) struct PaperPushes<'a> {
    pub masks: Option<&'a mut FieldMasks>,
    pub fields: DetectionFields<'a>,
    pub known: HashMap<ColliderHandle, (Vec<Touch>, DVec3)>,
}

impl PaperPushes<'_> {
    /// Sets the velocity changes of the two parts of a contact by each other's fields. `places` are world points at
    /// which to sample the parts instead of their present ones.
    pub(super) fn note(
        &mut self,
        constraint: &mut ContactConstraint,
        contact: &FieldContact,
        contact_bodies: &[ContactBody],
        places: [Option<DVec3>; 2],
    ) {
        if !constraint.law.is_vector() {
            return;
        }
        let speeds = constraint.velocities(contact_bodies).map(DVec3::length);
        let approach_speed = constraint.approach(contact_bodies);
        for part in 0..2 {
            if !contact.has_field[1 - part] {
                continue;
            }
            let touch = Touch {
                collider: contact.colliders[1 - part],
                world_normal: [-constraint.normal, constraint.normal][part],
                speed: speeds[part],
                approach_speed,
            };
            let pushed = contact.colliders[part];
            constraint.pushes[part] = self.push(constraint.law, pushed, touch, places[part]);
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
            return plain(self.fields, law, &touch);
        };
        let Some(mut query) = masks.sample(part, self.fields.moment) else {
            return DVec3::ZERO;
        };
        query.world_point = place.unwrap_or(query.world_point);
        let (touches, before) = self.known.entry(part).or_default();
        touches.push(touch);
        query.touches.clone_from(touches);
        let after = given(self.fields, law, masks, query);
        after - std::mem::replace(before, after)
    }
}

/// The push of the fields on a touched collider that stand under no operator: one push for each field with the paper's
/// law. A pair has one law, so if only the other side has the paper's, a field that observes pushes once.
fn plain(fields: DetectionFields<'_>, law: ContactLaw, touched: &Touch) -> DVec3 {
    let detectors = fields.of(touched.collider);
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

/// The velocity change of a part by everything that touches it.
fn given(
    fields: DetectionFields<'_>,
    law: ContactLaw,
    masks: &mut FieldMasks,
    touching: Query,
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let mut composites: Vec<FieldMask> = Vec::new();
    for touched in &touching.touches {
        sum += plain(fields, law, touched);
        let masks = fields.of(touched.collider).filter_map(|field| field.mask);
        for mask in masks {
            if !composites.iter().any(|it| it.is_beside(&mask)) {
                composites.push(mask);
            }
        }
    }
    // The mass of a body may all be in other parts: a part without mass is pushed like any other.
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
        let mut force = |query: &Query| masks.force(fields.compiled, mask, query);
        let difference = (force(&touching) - force(&alone)) * weight;
        if difference.is_finite() {
            sum += difference;
        }
    }
    sum
}
