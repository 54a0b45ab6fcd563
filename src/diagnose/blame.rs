//! Who is to blame: the field behind a value that cannot be given to Rapier.

use super::explain;
use crate::bridge::StepError;
use crate::compile::Prepared;
use crate::field::{Anchor, FieldSet};
use crate::integrate::{FASTEST, Fault, FaultKind};
use crate::math::Vector;

/// The error for a fault. Slow: this only runs when a step has failed.
pub(crate) fn blame(set: &FieldSet, fault: &Fault) -> StepError {
    let scene = &fault.scene;
    let (samples, place) = (&scene.samples, fault.place as u32);
    let explanation = explain(set, &scene.frames, samples, scene.moment, place);
    let worst = explanation.worst();
    let field = worst.map_or_else(String::new, |worst| worst.field.clone());
    match fault.kind {
        FaultKind::NonFinite => StepError::NonFinite {
            field,
            body: explanation.body,
            collider: worst.and_then(|worst| worst.collider),
            world_point: worst.map_or(Vector::NAN, |worst| worst.world_point),
            force: worst.and_then(|worst| worst.force).unwrap_or(Vector::NAN),
        },
        FaultKind::TooFast { speed } => StepError::TooFast {
            field,
            body: explanation.body,
            speed,
            limit: FASTEST,
        },
    }
}

/// The error for an anchor that is not in the world.
pub(crate) fn missing_anchor(compiled: Prepared<'_>, missing: usize) -> StepError {
    let missing = missing as u32;
    let radials = compiled
        .radials
        .iter()
        .flat_map(|(_, batch)| &batch.sources);
    let of_radial = radials
        .filter(|source| source.anchor == missing)
        .map(|source| source.leaf);
    let of_program = compiled.programs.iter().flat_map(|(_, program)| {
        let program = &program.instances;
        let anchors = program.anchors.iter().enumerate();
        let here = anchors.filter(|(_, anchor)| **anchor == missing);
        let from_leaf = here.map(|(place, _)| program.places[place]);
        // The anchor of an instance need not be that of any of its fields.
        let from_centre = program
            .centres
            .contains(&missing)
            .then(|| program.places[0]);
        from_leaf.chain(from_centre)
    });
    let detectors = compiled.detectors.iter();
    let of_detector = detectors
        .filter(|detector| detector.anchor == missing)
        .map(|detector| detector.leaf);
    let leaf = of_radial.chain(of_program).chain(of_detector).next();
    let anchor = match compiled.anchors[missing as usize] {
        Anchor::World { .. } => "the world".to_owned(),
        Anchor::Body { handle, .. } => format!("body {handle:?}"),
        Anchor::Collider { handle, .. } => format!("collider {handle:?}"),
    };
    StepError::MissingAnchor {
        field: leaf.map_or_else(String::new, |leaf| compiled.set.label(leaf)),
        anchor,
    }
}
