//! Who is to blame: the field behind a value that cannot be given to Rapier.

use super::{ExplainedField, Explanation, each_trace, explain, reaction};
use crate::bridge::StepError;
use crate::compile::Prepared;
use crate::field::{Anchor, FieldSet};
use crate::integrate::{FASTEST, Fault, FaultKind, FaultPolicy, StepWarning};
use crate::math::{ColliderHandle, Vector, from_dvec3, to_dvec3};
use crate::rigid::Wrench;

/// The error for a fault, that of its first body. Slow: this only runs when a step has failed.
pub(crate) fn blame(set: &FieldSet, fault: &Fault) -> StepError {
    let explanation = explain_one(set, fault, fault.places[0]);
    let Culprit {
        field,
        collider,
        world_point,
        force,
    } = Culprit::of(&explanation);
    let body = explanation.body;
    match fault.kind {
        FaultKind::NonFinite => StepError::NonFinite {
            field,
            body,
            collider,
            world_point,
            force,
        },
        FaultKind::TooFast { speed } => StepError::TooFast {
            field,
            body,
            speed,
            limit: FASTEST,
        },
    }
}

/// The warnings for a fault, of each of its bodies, in a step that goes on; as slow.
pub(crate) fn warn_of(
    set: &FieldSet,
    fault: &Fault,
    policy: FaultPolicy,
    warnings: &mut Vec<StepWarning>,
) {
    for place in &fault.places {
        let explanation = explain_one(set, fault, *place);
        let body = explanation.body;
        let told = |warning: &StepWarning| match warning {
            StepWarning::LeftOut { body: told, .. } => *told == body,
            StepWarning::Quarantined { body: told, .. } => *told == body,
            _ => false,
        };
        if warnings.iter().any(told) {
            continue;
        }
        let Culprit {
            field,
            collider,
            world_point,
            force,
        } = Culprit::of(&explanation);
        warnings.push(match policy {
            FaultPolicy::LeaveOut => StepWarning::LeftOut {
                field,
                body,
                collider,
                world_point,
                force,
            },
            _ => StepWarning::Quarantined {
                field,
                body,
                collider,
                world_point,
                force,
            },
        });
    }
}

/// The wrenches on the bodies of a fault without what is not finite of them, term by term and sample by
/// sample.
pub(crate) fn sifted(set: &FieldSet, fault: &Fault) -> Vec<Wrench> {
    let scene = &fault.scene;
    let (samples, frames, moment) = (&scene.samples, &scene.frames, scene.moment);
    let of = |place: &usize| {
        let body = *place as u32;
        let mut sum = Wrench::ZERO;
        let mut add = |more: Wrench| {
            let all = sum.plus(more);
            if all.is_finite() {
                sum = all;
            }
        };
        add(reaction(
            set,
            frames,
            samples,
            moment,
            body,
            Vector::is_finite,
        ));
        each_trace(set, frames, samples, moment, body, |sample, _, trace| {
            if let Some(force) = trace.force {
                let torque = from_dvec3(to_dvec3(sample.arm).cross(force));
                let force = from_dvec3(force);
                add(Wrench { force, torque });
            }
        });
        sum
    };
    fault.places.iter().map(of).collect()
}

fn explain_one(set: &FieldSet, fault: &Fault, place: usize) -> Explanation {
    let scene = &fault.scene;
    let (samples, place) = (&scene.samples, place as u32);
    explain(set, &scene.frames, samples, scene.moment, place)
}

/// Of all that single fields give a body, the worst.
struct Culprit {
    field: String,
    collider: Option<ColliderHandle>,
    world_point: Vector,
    force: Vector,
}

impl Culprit {
    fn of(explanation: &Explanation) -> Self {
        let worst = explanation.worst();
        let of = |get: fn(&ExplainedField) -> Vector| worst.map_or(Vector::NAN, get);
        Culprit {
            field: worst.map_or_else(String::new, |worst| worst.field.clone()),
            collider: worst.and_then(|worst| worst.collider),
            world_point: of(|worst| worst.world_point),
            force: of(|worst| worst.force.unwrap_or(Vector::NAN)),
        }
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
