//! The potential energy of bodies in the fields of programs.

use super::cut::{BodyCuts, CutBody, SampleOf};
use crate::compile::{Instruction, Program};
use crate::field::{Field, Frame, LocalQuery, Open, Operator, Query};
use crate::sample::{Moment, Samples};

/// The potential energy of all samples in a program's fields (J), and true if it includes every field that acts. A
/// program whose steps do more than add fields has no potential: its energy is zero.
pub(super) fn program_energy(
    program: &Program,
    frames: &[Option<Frame>],
    samples: &Samples,
    moment: Moment,
) -> (f64, bool) {
    let adds = |step: &Instruction| match step {
        Instruction::Nowhere | Instruction::Leaf(_) => true,
        Instruction::Apply(operator) | Instruction::Join(operator, _) => {
            *operator == Operator::SumUnion
        }
        Instruction::Modify(_) | Instruction::Layers(..) => false,
    };
    let on = |leaf: &&Field| leaf.is_on(moment.span) && !leaf.is_contact();
    if !program.steps.iter().all(adds) {
        return (0.0, !program.leaves.iter().any(|leaf| on(&leaf)));
    }
    let all = program.leaves.iter().filter(on).all(Field::has_potential);
    let instances = 0..program.instances.len();
    let energy = |instance: usize, query: &Query| -> f64 {
        let leaves = 0..program.leaves.len();
        leaves
            .filter_map(|leaf| leaf_energy(program, frames, instance, leaf, query))
            .sum()
    };
    let mut total = 0.0;
    let rule = program.sampling_rule;
    let centres = samples.centres_for(rule);
    let centres = centres.filter(|centre| samples.cut(rule, centre.body).is_none());
    let sites = samples.uncut_sites_for(rule).map(|(_, sample)| sample);
    let runs = samples.uncut_runs_for(rule);
    let of_runs = runs.flat_map(|(_, run)| samples.of_run(run));
    for sample in centres.chain(sites).copied().chain(of_runs) {
        let query = samples.query(&sample, moment);
        total += instances
            .clone()
            .map(|instance| energy(instance, &query))
            .sum::<f64>();
    }
    let mut cuts = BodyCuts::default();
    for number in 0..samples.bodies.len() as u32 {
        let body = CutBody {
            samples,
            moment,
            number,
        };
        cuts.each(
            program,
            frames,
            instances.clone(),
            body,
            |instance, sample| {
                total += match sample {
                    SampleOf::Whole(query) => energy(instance, query),
                    SampleOf::Piece(query, weight, _) => energy(instance, query) * weight,
                };
            },
        );
    }
    (total, all)
}

/// The potential energy of a sample in one leaf of an instance (J); `None` if the leaf does not act on it, or has
/// no potential.
fn leaf_energy(
    program: &Program,
    frames: &[Option<Frame>],
    instance: usize,
    leaf: usize,
    query: &Query,
) -> Option<f64> {
    let field = program.leaves.get(leaf)?;
    let frame = program.frame(instance, leaf, frames)?;
    if !field.acts_on(query, frame) {
        return None;
    }
    let local = LocalQuery::new(query, frame);
    if !field.region.set(&local, &Open::<f64>::new()) {
        return None;
    }
    let potential = field.potential_of(program.strength(instance, leaf), &local)?;
    Some(potential * field.energy_share(frame.body.is_some()))
}
