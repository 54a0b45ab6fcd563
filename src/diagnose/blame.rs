//! The field behind a force that Rapier cannot take, for errors and warnings.

use std::collections::HashSet;

use super::is_contact;
use super::sampled::SampledFields;
use crate::bridge::StepError;
use crate::compile::Prepared;
use crate::field::{FieldRef, FieldSet, Frames};
use crate::integrate::{FASTEST, Fault, FaultKind, FaultPolicy, StepWarning};
use crate::math::{ColliderHandle, Real, RigidBodyHandle, Vector, from_dvec3, to_dvec3};
use crate::reference::Fate;
use crate::rigid::Wrench;

/// The error for a fault, for its first body. Slow: it only runs when a step has failed.
pub(crate) fn blame(set: &FieldSet, fault: &Fault) -> StepError {
    let culprit = Culprit::of(set, fault, fault.places[0]);
    match fault.kind {
        FaultKind::NonFinite => StepError::NonFinite {
            field: culprit.field,
            body: culprit.body,
            collider: culprit.collider,
            world_point: culprit.world_point,
            force: culprit.force,
        },
        FaultKind::TooFast { speed } => StepError::TooFast {
            field: culprit.field,
            body: culprit.body,
            speed,
            limit: FASTEST,
        },
    }
}

/// The largest number of bodies × fields for which the fields are evaluated one by one.
const ASKED: usize = 1_000_000;

/// The warnings for a fault in a step that goes on, one for each of its bodies. With very many bodies and fields, the
/// field is named for the first bodies only.
pub(crate) fn warn_of(
    set: &FieldSet,
    fault: &Fault,
    policy: FaultPolicy,
    warnings: &mut Vec<StepWarning>,
) {
    let told = |warning: &StepWarning| match warning {
        StepWarning::LeftOut { body, .. } | StepWarning::Quarantined { body, .. } => Some(*body),
        _ => None,
    };
    let told: HashSet<_> = warnings.iter().filter_map(told).collect();
    let most = ASKED / set.nodes().leaves().count().max(1);
    let samples = &fault.scene.samples;
    let news = fault.places.iter();
    let news = news.filter(|place| !told.contains(&samples.bodies[**place]));
    for (number, place) in news.enumerate() {
        let culprit = if number <= most {
            Culprit::of(set, fault, *place)
        } else {
            Culprit::unknown(fault, *place)
        };
        warnings.push(match policy {
            FaultPolicy::LeaveOut => StepWarning::LeftOut {
                field: culprit.field,
                body: culprit.body,
                collider: culprit.collider,
                world_point: culprit.world_point,
                force: culprit.force,
            },
            _ => StepWarning::Quarantined {
                field: culprit.field,
                body: culprit.body,
                collider: culprit.collider,
                world_point: culprit.world_point,
                force: culprit.force,
            },
        });
    }
}

/// The wrenches on the bodies of a fault. For each term and sample, a contribution that is not finite is left out.
pub(crate) fn without_non_finite(set: &FieldSet, fault: &Fault) -> Vec<Wrench> {
    let fields = fields_of(set, fault);
    let of = |place: &usize| {
        let body = *place as u32;
        let mut sum = Wrench::ZERO;
        let mut add = |more: Wrench| {
            let all = sum.plus(more);
            if all.is_finite() {
                sum = all;
            }
        };
        add(fields.reaction(body, Vector::is_finite));
        fields.each_trace(body, |sample, _, trace| {
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

fn fields_of<'a>(set: &'a FieldSet, fault: &'a Fault) -> SampledFields<'a, impl Frames> {
    let scene = &fault.scene;
    SampledFields::new(set, &scene.frames, &scene.samples, scene.moment)
}

/// The worst contribution of a single field to a body: the largest, or the first that is not finite.
struct Culprit {
    field: FieldRef,
    body: RigidBodyHandle,
    collider: Option<ColliderHandle>,
    world_point: Vector,
    force: Vector,
}

impl Culprit {
    fn of(set: &FieldSet, fault: &Fault, place: usize) -> Self {
        let mut culprit = Culprit::unknown(fault, place);
        let (mut worst, mut leaf) = (-1.0, None);
        fields_of(set, fault).each_trace(place as u32, |sample, _, trace| {
            for given in &trace.contributions {
                let acts = given.fate != Fate::OutsideRegion && !is_contact(set, given.place);
                let force = given.force.map(from_dvec3);
                let size = force.unwrap_or(Vector::ZERO).length();
                let badness = if size.is_finite() {
                    size
                } else {
                    Real::INFINITY
                };
                if acts && badness > worst {
                    (worst, leaf) = (badness, Some(given.place));
                    culprit.collider = sample.collider;
                    culprit.world_point = sample.world_point;
                    culprit.force = force.unwrap_or(Vector::NAN);
                }
            }
        });
        if let Some(leaf) = leaf {
            culprit.field = set.field_ref(leaf);
        }
        culprit
    }

    /// A stand-in for a body whose fields are not evaluated one by one.
    fn unknown(fault: &Fault, place: usize) -> Self {
        let samples = &fault.scene.samples;
        Culprit {
            field: "one of the fields".into(),
            body: samples.bodies[place],
            collider: None,
            world_point: samples.centres[place].world_point,
            force: Vector::NAN,
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
        // The anchor of an instance may differ from those of all its fields.
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
    StepError::MissingAnchor {
        field: leaf.map_or_else(FieldRef::default, |leaf| compiled.set.field_ref(leaf)),
        anchor: compiled.anchors[missing as usize],
    }
}
