//! The potential energy of programs.

use crate::compile::{Program, Step};
use crate::field::{Field, Frame, LocalQuery, Neighbourhood, Operator, Query};
use crate::sample::{Moment, Samples};

/// The potential of a program's fields, of those that have one and are not changed on the way, and
/// whether these are all that act.
pub(super) fn program_energy(
    program: &Program,
    frames: &[Option<Frame>],
    samples: &Samples,
    moment: Moment,
) -> (f64, bool) {
    let adds = |step: &Step| match step {
        Step::Nowhere | Step::Leaf(_) => true,
        Step::Apply(operator, count) => *count == 1 || *operator == Operator::SumUnion,
        Step::Modify(_) | Step::Layers(..) => false,
    };
    let on = |leaf: &&Field| leaf.is_on(moment.time) && !leaf.is_contact();
    if !program.steps.iter().all(adds) {
        return (0.0, !program.leaves.iter().any(|leaf| on(&leaf)));
    }
    let all = program.leaves.iter().filter(on).all(Field::has_potential);
    let mut total = 0.0;
    let list = samples.samples_for(program.how).map(|(_, sample)| sample);
    for sample in samples.centres_for(program.how).chain(list) {
        let query = samples.query(sample, moment);
        for instance in 0..program.instances.len() {
            for number in 0..program.leaves.len() {
                let at = (program, frames, (instance, number));
                total += leaf_energy(at, &query).unwrap_or(0.0);
            }
        }
    }
    (total, all)
}

/// The potential energy of a sample in one leaf of an instance, if that acts on it and has one.
fn leaf_energy(
    (program, frames, (instance, number)): (&Program, &[Option<Frame>], (usize, usize)),
    query: &Query,
) -> Option<f64> {
    let field = program.leaves.get(number)?;
    let frame = program.frame(instance, number, frames)?;
    if !field.acts_on(query, frame) {
        return None;
    }
    let local = LocalQuery::new(query, frame);
    let here = Neighbourhood::open();
    if !field.region.pieces(&local, &here).any() {
        return None;
    }
    let potential = field.potential_of(program.strength(instance, number), &local)?;
    Some(potential * field.energy_share(frame.body.is_some()))
}
