//! Who is to blame: the field behind a value that cannot be given to Rapier.

use super::error::StepError;
use crate::compile::Compiled;
use crate::eval::{Kind, Moment, Probe, Probes};
use crate::field::{Anchor, Frame, LocalQuery, Neighbourhood, real};
use crate::math::{Real, Vector, from_dvec3};

/// What one field gives at one probe.
struct Share<'a> {
    leaf: u32,
    probe: &'a Probe,
    force: Vector,
}

impl Share<'_> {
    /// Larger is worse; infinite and NaN are worst.
    fn badness(&self) -> Real {
        let size = self.force.length();
        if size.is_finite() {
            size
        } else {
            Real::INFINITY
        }
    }
}

/// The error for a body whose wrench is not finite.
pub(super) fn non_finite(
    compiled: &Compiled,
    frames: &[Option<Frame>],
    probes: &Probes,
    moment: Moment,
    body: usize,
) -> StepError {
    let handle = probes.bodies[body];
    let worst = worst(compiled, frames, probes, moment, body);
    StepError::NonFinite {
        field: worst
            .as_ref()
            .map_or_else(String::new, |share| compiled.label(share.leaf)),
        body: handle,
        collider: worst.as_ref().and_then(|share| share.probe.collider),
        world_point: worst
            .as_ref()
            .map_or(Vector::NAN, |share| share.probe.world_point),
        force: worst.as_ref().map_or(Vector::NAN, |share| share.force),
    }
}

/// The name of the field that gives a body the largest force.
pub(super) fn strongest(
    compiled: &Compiled,
    frames: &[Option<Frame>],
    probes: &Probes,
    moment: Moment,
    body: usize,
) -> String {
    let worst = worst(compiled, frames, probes, moment, body);
    worst.map_or_else(String::new, |share| compiled.label(share.leaf))
}

/// The error for an anchor that is not in the world.
pub(super) fn missing_anchor(compiled: &Compiled, missing: usize) -> StepError {
    let missing = missing as u32;
    let radials = compiled.radials.iter().flat_map(|batch| &batch.sources);
    let of_radial = radials
        .filter(|source| source.anchor == missing)
        .map(|source| source.leaf);
    let of_program = compiled.programs.iter().flat_map(|program| {
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
        field: leaf.map_or_else(String::new, |leaf| compiled.label(leaf)),
        anchor,
    }
}

/// Of everything that single fields give at the probes of a body, the worst; the first of those
/// that are not finite. Slow: this only runs when a step has failed.
fn worst<'a>(
    compiled: &Compiled,
    frames: &[Option<Frame>],
    probes: &'a Probes,
    moment: Moment,
    body: usize,
) -> Option<Share<'a>> {
    let mut worst: Option<Share<'a>> = None;
    let of_body = |probe: &&Probe| probe.body as usize == body;
    let centres = probes.centres.iter().filter(of_body);
    for probe in probes.list.iter().filter(of_body).chain(centres) {
        each_field(compiled, frames, probes, probe, moment, |leaf, force| {
            let share = Share { leaf, probe, force };
            if worst
                .as_ref()
                .is_none_or(|worst| share.badness() > worst.badness())
            {
                worst = Some(share);
            }
        });
    }
    worst
}

/// Visits what each single field gives at a probe, whatever operators it stands under.
fn each_field(
    compiled: &Compiled,
    frames: &[Option<Frame>],
    probes: &Probes,
    probe: &Probe,
    moment: Moment,
    mut visit: impl FnMut(u32, Vector),
) {
    let query = probes.query(probe, moment);
    let open = Neighbourhood::open();
    let mut field_at = |leaf: u32, anchor: u32| {
        let (Some(field), Some(frame)) =
            (compiled.tree.field(leaf), frames[anchor as usize].as_ref())
        else {
            return;
        };
        if !field.acts_on(&query, frame) {
            return;
        }
        let local = LocalQuery::new(&query, frame);
        if field.region.pieces(&local, &open).any() {
            visit(leaf, from_dvec3(real(&field.force(&local))));
        }
    };
    let batches = compiled.radials.iter();
    let taking = batches.filter(|batch| probes.takes(batch.how, probe));
    for source in taking.flat_map(|batch| &batch.sources) {
        field_at(source.leaf, source.anchor);
    }
    let programs = compiled.programs.iter();
    for program in programs.filter(|program| probes.takes(program.how, probe)) {
        for (place, anchor) in program.anchors.iter().enumerate() {
            field_at(program.places[place], *anchor);
        }
    }
    let constants = compiled.constants.iter();
    for constant in constants.filter(|_| probe.kind == Kind::Centre) {
        if let Some(field) = compiled.tree.field(constant.leaf) {
            let frame = Frame::at_rest(crate::math::Pose::IDENTITY);
            let local = LocalQuery::new(&query, &frame);
            visit(constant.leaf, from_dvec3(real(&field.force(&local))));
        }
    }
}
