//! Rough costs of evaluation, which show users which fields are expensive.
//!
//! The unit is nanoseconds, measured once on one core of a common x86-64 machine in `f32`, as the difference
//! between many and few fields of a kind on balls in their reach. Other machines are faster or slower by one factor,
//! so ratios of costs hold there, too. `f64` costs twice as much in the lanes of radial batches, and the same
//! elsewhere.

use super::entries::RadialBatch;
use super::index_kind::IndexKind;
use super::program::{Instruction, Program};
use crate::field::{Field, Formula, Profile};
use crate::math::to_f64;

/// All constants together, on a body.
pub(super) const CONSTANTS: f64 = 2.0;

/// A source of a law that has its own kernel in lanes: inverse square, Lennard-Jones.
const KERNEL: f64 = 1.5;

/// A source of any other radial law, one lane after the other.
const OTHER_LAW: f64 = 45.0;

/// A sample on cells within cells, for each doubling of the sources, at an opening angle of 1.
const CELLS: f64 = 100.0;

/// Costs of a program on one sample.
struct UnitCosts {
    /// An instance, without its fields: the query, and the outcome.
    instance: f64,
    /// A field within it: the sample in the field's frame, and a cheap formula.
    field: f64,
    /// A solid, interval or function in a region.
    border: f64,
    /// A scale, of a field or of a composite.
    scale: f64,
    /// A radial law, beyond a cheap formula.
    law: f64,
}

/// Samples one by one.
const SINGLE: UnitCosts = UnitCosts {
    instance: 60.0,
    field: 45.0,
    border: 40.0,
    scale: 60.0,
    law: 60.0,
};

/// Eight samples at once.
const IN_LANES: UnitCosts = UnitCosts {
    instance: 40.0,
    field: 20.0,
    border: 10.0,
    scale: 20.0,
    law: 20.0,
};

/// The cost of a formula beyond a cheap one.
fn formula(formula: &Formula, rates: &UnitCosts) -> f64 {
    match formula {
        Formula::Uniform(_) | Formula::Magnetic(_) | Formula::Closure(_) => 0.0,
        Formula::Radial(_) => rates.law,
        Formula::Nearest(_) | Formula::Path(_) => 90.0,
        Formula::Turbulence(_) => 1300.0,
        #[cfg(feature = "expression")]
        Formula::Expression(_) => 90.0,
        Formula::Wind(wind) => rates.field * 0.5 + self::formula(&wind.flow, rates),
        Formula::Contact(_) => 0.0,
        _ => rates.field * 0.5,
    }
}

fn field(field: &Field, rates: &UnitCosts) -> f64 {
    let whole = field.region.is_everywhere();
    let borders = if whole { 0 } else { field.region.steps.len() };
    let scale = if field.scale.is_some() {
        rates.scale
    } else {
        0.0
    };
    rates.field + formula(&field.formula, rates) + scale + rates.border * borders as f64
}

/// The cost of a batch on one sample: of one source that reaches it, if the sources are indexed; else of all sources.
pub(super) fn of_batch(batch: &RadialBatch) -> f64 {
    let power = matches!(batch.law.profile, Profile::Power { power: -2.0, .. });
    let kernel = power || matches!(batch.law.profile, Profile::LennardJones { .. });
    let own = kernel && batch.law.is_plain();
    let one = if own { KERNEL } else { OTHER_LAW };
    match batch.index_kind() {
        IndexKind::None => one * batch.sources.len() as f64,
        IndexKind::Cells => {
            let angle = batch.law.opening_angle.map_or(1.0, to_f64);
            CELLS * (batch.sources.len() as f64).log2() / (angle * angle)
        }
        _ => one,
    }
}

/// The cost of a program on one sample: of one instance that reaches it, if the reach is bounded; else of all.
pub(super) fn of_program(program: &Program) -> f64 {
    let rates = if program.in_lanes { &IN_LANES } else { &SINGLE };
    let fields: f64 = program.leaves.iter().map(|leaf| field(leaf, rates)).sum();
    let scales = program.steps.iter();
    let scales = scales
        .filter(|step| matches!(step, Instruction::Modify(_)))
        .count();
    let one = rates.instance + fields + rates.scale * scales as f64;
    match program.reach {
        None => one * program.instances.len() as f64,
        Some(_) => one,
    }
}
